// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/value_counts.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <unordered_map>

#include "deform/cpu/arena.h"

namespace tetwarp {

std::map<double, std::uint64_t> count_values(const ConstVolumeView& volume, const Limits& limits) {
  require(volume.voxels && volume.memory == Memory::host && volume.components == 1 &&
              volume.buffered == whole(*volume.geometry),
          "values are counted of a whole volume of one value a voxel in host memory");
  using Counts = std::unordered_map<double, std::uint64_t>;
  tbb::enumerable_thread_specific<Counts> parts;
  const std::int64_t area = volume.geometry->size.x * volume.geometry->size.y;
  cpu::Arena arena(limits);
  dispatch(volume.type, [&]<class V>(V) {
    const V* voxels = reinterpret_cast<const V*>(volume.voxels);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, volume.geometry->size.z, [&](std::int64_t k) {
        Counts& counts = parts.local();
        const V *run = voxels + k * area, *end = run + area;
        while (run < end) {
          const V* next = run + 1;
          while (next < end && *next == *run) ++next;
          // NaN equals nothing, so each of its runs has one voxel.
          if (*run == *run) counts[static_cast<double>(*run)] += static_cast<std::uint64_t>(next - run);
          run = next;
        }
      });
    });
  });
  std::map<double, std::uint64_t> all;
  for (const Counts& part : parts)
    for (const auto& [value, count] : part) all[value] += count;
  return all;
}

}  // namespace tetwarp
