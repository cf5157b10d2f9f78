// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <set>
#include <string>
#include <utility>

#include "deform/simulate/phase_player.h"

namespace tetwarp::viewer {

/// A state of the simulation that is kept for long. Its memory comes from the system and goes back to it: on the heap,
/// pictures would fill part of the place of a state that was let go of, and the next one would find none.
class Snapshot {
 public:
  /// Copies a state. @throws std::bad_alloc
  explicit Snapshot(const simulate::PhasePlayer::State& state);
  ~Snapshot();
  Snapshot(Snapshot&& other) noexcept { *this = std::move(other); }
  Snapshot& operator=(Snapshot&& other) noexcept {
    std::swap(open_, other.open_);
    std::swap(bytes_, other.bytes_);
    std::swap(size_, other.size_);
    return *this;
  }

  simulate::PhasePlayer::State state() const;
  std::size_t bytes() const { return size_; }

 private:
  std::set<std::string> open_;  ///< names of the open cuts
  void* bytes_ = nullptr;       ///< pages of the system; null where there are none
  std::size_t size_ = 0;
};

}  // namespace tetwarp::viewer
