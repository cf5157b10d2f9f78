// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/snapshot.h"

#include <sys/mman.h>

#include <cstring>
#include <new>

namespace tetwarp::viewer {

Snapshot::Snapshot(const simulate::PhasePlayer::State& state) : open_(state.open), size_(state.of_nodes.size()) {
  if (size_ == 0) return;
  void* const pages = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) throw std::bad_alloc();
  bytes_ = pages;
  std::memcpy(bytes_, state.of_nodes.data(), size_);
}

Snapshot::~Snapshot() {
  if (bytes_) munmap(bytes_, size_);
}

simulate::PhasePlayer::State Snapshot::state() const {
  const auto* const bytes = static_cast<const std::byte*>(bytes_);
  return {open_, {bytes, bytes + size_}};
}

}  // namespace tetwarp::viewer
