// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/shared_input.h"

#include <algorithm>

#include "apps/cli/in_background.h"

namespace tetwarp::apps {

const InputHeader& SharedInput::open(const CommonOptions& common) {
  const std::lock_guard lock(mutex_);
  if (!header_) header_ = open_input(options_, common);
  return *header_;
}

const InputVolume& SharedInput::read(const CommonOptions& common, const Control& control) {
  const std::lock_guard lock(mutex_);
  if (volume_) return *volume_;
  if (!header_->series)  // of a series the reader finds it
    hash_ = in_background([this] { return hash_file(options_.path); });
  volume_ = read_input(options_, *header_, common, control);
  return *volume_;
}

std::shared_ptr<const DicomHeaders> SharedInput::headers() {
  const std::lock_guard lock(mutex_);
  if (!volume_->is_dicom()) return nullptr;
  return users_ == Users::one ? volume_->dicom->headers : copy_headers(*volume_->dicom->headers);
}

std::shared_ptr<SharedInput> SharedInputs::get(const InputOptions& options) {
  const std::lock_guard lock(mutex_);
  std::erase_if(inputs_, [](const auto& input) { return input.second.expired(); });
  const auto found =
      std::find_if(inputs_.begin(), inputs_.end(), [&](const auto& input) { return input.first == options; });
  if (found != inputs_.end())
    if (auto input = found->second.lock()) return input;
  auto input = std::make_shared<SharedInput>(options, SharedInput::Users::several);
  inputs_.emplace_back(options, input);
  return input;
}

}  // namespace tetwarp::apps
