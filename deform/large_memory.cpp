// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/large_memory.h"

#include <sys/mman.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>

#include "deform/cpu/tiles.h"

namespace tetwarp {

void prepare_memory([[maybe_unused]] std::span<std::byte> untouched, [[maybe_unused]] int threads) {
#ifdef MADV_POPULATE_WRITE
  constexpr std::size_t kPageBytes = std::size_t{2} << 20, kPartBytes = 4 * kPageBytes;
  if (untouched.size() < 2 * kPageBytes) return;
  const std::size_t before = -reinterpret_cast<std::uintptr_t>(untouched.data()) % kPageBytes;
  const std::span<std::byte> pages = untouched.subspan(before, (untouched.size() - before) / kPageBytes * kPageBytes);
  const auto touch = [&](std::size_t n) {
    const std::size_t begin = n * kPartBytes;
    ::madvise(pages.data() + begin, std::min(kPartBytes, pages.size() - begin), MADV_POPULATE_WRITE);
  };
  cpu::Arena arena({.threads = threads});
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, (pages.size() + kPartBytes - 1) / kPartBytes, touch); });
#endif
}

}  // namespace tetwarp
