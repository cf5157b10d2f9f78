// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "deform/render/camera.h"
#include "view/session/picture.h"
#include "view/session/request.h"

namespace tetwarp::viewer {

/// A picture of a pane, as a file.
struct Picture {
  request::Pane pane = request::Pane::axial;
  std::uint32_t number = 0;   ///< of the pictures of this pane, from 1
  std::uint32_t request = 0;  ///< number of the last request that it shows
  bool is_exact = false;      ///< whether each pixel is what it is at rest; then a PNG, else a JPEG
  int width = 0, height = 0;
  std::int64_t voxel = 0;          ///< of a slice: index along its normal
  std::optional<ViewPlane> plane;  ///< of the volume
  std::vector<std::byte> bytes;
};

/// Threads that do one thing after the other.
class Encoders {
 public:
  explicit Encoders(unsigned threads);
  /// Waits for what is under way, and forgets the rest.
  ~Encoders();
  Encoders(const Encoders&) = delete;
  Encoders& operator=(const Encoders&) = delete;
  void add(std::function<void()> work);

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> work_;
  bool ends_ = false;
  std::vector<std::jthread> threads_;
};

/// The way of a pane's pictures to the page: one is being made into a file, one waits, and one is on its way. So the
/// pace is that of the slowest, and what is shown is the latest.
class PaneLine {
 public:
  /// @param send  gets a picture that may go on its way
  /// @param free  is called when another one may be made
  PaneLine(request::Pane pane, Encoders& encoders, std::function<void(Picture)> send, std::function<void()> free);

  /// Size on the screen, pixels; 0: the pane is not seen.
  void set_size(int width, int height);
  int width() const { return width_; }
  int height() const { return height_; }
  bool is_seen() const { return width_ > 0 && height_ > 0; }

  /// What was shown last is not what is to be seen any more.
  void make_stale() { is_stale_ = true, is_sharp_ = false; }
  bool is_stale() const { return is_stale_ && is_seen(); }
  /// Number of the last picture that was made.
  std::uint32_t number() const { return number_; }
  /// Whether the last picture was exact.
  bool is_sharp() const { return is_sharp_ || !is_seen(); }
  /// Whether a picture may be made now.
  bool is_free() const;
  /// Takes an image, and makes a picture of it.
  /// @param about  all that is known of the picture but number, size and bytes
  void take(PaneImage image, Picture about);
  /// The page has shown a picture. Any number is taken, so that nothing waits for one that got lost.
  void shown();
  /// A new page has nothing on its way.
  void begin_anew();

 private:
  void encoded(Picture picture);

  const request::Pane pane_;
  Encoders& encoders_;
  const std::function<void(Picture)> send_;
  const std::function<void()> free_;
  int width_ = 0, height_ = 0;
  bool is_stale_ = true, is_sharp_ = false;
  std::uint32_t number_ = 0;

  mutable std::mutex mutex_;  ///< of what follows
  bool is_encoding_ = false, is_on_way_ = false;
  std::optional<Picture> ready_;
  std::uint32_t first_ = 0;  ///< number of the first picture for the page that looks now
};

}  // namespace tetwarp::viewer
