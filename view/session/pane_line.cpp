// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/pane_line.h"

#include <exception>
#include <utility>

namespace tetwarp::viewer {

Encoders::Encoders(unsigned threads) {
  for (unsigned n = 0; n < threads; ++n) threads_.emplace_back([this] { run(); });
}

Encoders::~Encoders() {
  const std::lock_guard lock(mutex_);
  ends_ = true;
  work_.clear();
  wake_.notify_all();
}

void Encoders::add(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  work_.push_back(std::move(work));
  wake_.notify_one();
}

void Encoders::run() {
  for (;;) {
    std::function<void()> work;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return ends_ || !work_.empty(); });
      if (ends_) return;
      work = std::move(work_.front());
      work_.pop_front();
    }
    work();
  }
}

PaneLine::PaneLine(request::Pane pane, Encoders& encoders, std::function<void(Picture)> send,
                   std::function<void()> free)
    : pane_(pane), encoders_(encoders), send_(std::move(send)), free_(std::move(free)) {}

void PaneLine::set_size(int width, int height) {
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  make_stale();
}

bool PaneLine::is_free() const {
  const std::lock_guard lock(mutex_);
  return !is_encoding_ && !ready_;
}

void PaneLine::take(PaneImage image, Picture about) {
  is_stale_ = false;
  is_sharp_ = about.is_exact;
  about.pane = pane_;
  about.number = ++number_;
  about.width = image.width;
  about.height = image.height;
  {
    const std::lock_guard lock(mutex_);
    is_encoding_ = true;
  }
  encoders_.add([this, image = std::move(image), about = std::move(about)]() mutable {
    try {
      about.bytes = about.is_exact ? encode_png(image) : encode_jpeg(image);
    } catch (const std::exception&) {  // no memory: the next picture may fare better
      about.number = 0;
    }
    encoded(std::move(about));
  });
}

void PaneLine::encoded(Picture picture) {
  {
    const std::lock_guard lock(mutex_);
    is_encoding_ = false;
    if (picture.number > 0 && picture.number >= first_) {
      if (std::exchange(is_on_way_, true)) {
        ready_ = std::move(picture);
      } else {
        send_(std::move(picture));
      }
    }
  }
  free_();
}

void PaneLine::shown() {
  {
    const std::lock_guard lock(mutex_);
    is_on_way_ = ready_.has_value();
    if (ready_) send_(std::move(*std::exchange(ready_, std::nullopt)));
  }
  free_();
}

void PaneLine::begin_anew() {
  make_stale();
  const std::lock_guard lock(mutex_);
  ready_.reset();
  is_on_way_ = false;
  first_ = number_ + 1;
}

}  // namespace tetwarp::viewer
