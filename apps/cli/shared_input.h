// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/input.h"

namespace tetwarp::apps {

/// An input that several cases may need at the same time. The first case that needs it reads it, and the others wait.
class SharedInput {
 public:
  enum class Users { one, several };
  SharedInput(InputOptions options, Users users) : options_(std::move(options)), users_(users) {}

  /// The header.
  /// @throws whatever open_input throws; then the next caller tries again
  const InputHeader& open(const CommonOptions& common);
  /// The voxels, after `open`.
  /// @throws whatever read_input throws; then the next caller tries again
  const InputVolume& read(const CommonOptions& common, const Control& control);
  /// Headers of a DICOM series that was read, for one run: each of several runs has its own copy. Null for a file.
  std::shared_ptr<const DicomHeaders> headers();
  /// SHA-256 of its bytes as they were when it was read, hexadecimal. @throws InputError
  std::string sha256() const { return hash_.valid() ? hash_.get() : volume_->dicom->sha256; }

 private:
  InputOptions options_;
  Users users_;
  std::optional<InputHeader> header_;
  std::optional<InputVolume> volume_;
  std::mutex mutex_;
  std::shared_future<std::string> hash_;  ///< of a file; the last member: ends before what it refers to
};

/// The inputs of cases that are in work: those that several have in common are read once, and kept until the last of
/// these cases lets go.
class SharedInputs {
 public:
  std::shared_ptr<SharedInput> get(const InputOptions& options);

 private:
  std::vector<std::pair<InputOptions, std::weak_ptr<SharedInput>>> inputs_;
  std::mutex mutex_;
};

}  // namespace tetwarp::apps
