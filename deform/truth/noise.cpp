// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/noise.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "deform/cpu/arena.h"
#include "deform/errors.h"
#include "deform/phantom/grain.h"

namespace tetwarp::truth {

namespace {

template <class V>
V stored(double value) {
  if constexpr (std::is_floating_point_v<V>) return static_cast<V>(value);
  constexpr auto kLow = static_cast<double>(std::numeric_limits<V>::min()),
                 kHigh = static_cast<double>(std::numeric_limits<V>::max());
  return static_cast<V>(std::nearbyint(std::clamp(value, kLow, kHigh)));
}

}  // namespace

std::uint64_t noise_seed(std::uint64_t seed, std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return phantom::hash(hash ^ phantom::hash(seed));
}

void add_noise(const ConstVolumeView& volume, double deviation, std::uint64_t seed, const VolumeView& output,
               const Limits& limits) {
  constexpr double kAirHu = -1000;
  require(volume.voxels && output.voxels && volume.memory == Memory::host && output.memory == Memory::host &&
              volume.components == 1 && output.components == 1 && volume.type == output.type &&
              volume.buffered == whole(*volume.geometry) && output.buffered == volume.buffered,
          "noise is added to a whole volume of one value a voxel in host memory, into one of the same kind");
  const glm::i64vec3 size = volume.geometry->size;
  const std::int64_t area = size.x * size.y;
  cpu::Arena arena(limits);
  dispatch(volume.type, [&]<class V>(V) {
    const V* from = reinterpret_cast<const V*>(volume.voxels);
    V* to = reinterpret_cast<V*>(output.voxels);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
        phantom::GrainRows rows(size, k, seed);
        std::vector<float> noise(static_cast<std::size_t>(size.x));
        for (std::int64_t row = k * area; row < (k + 1) * area; row += size.x) {
          rows.next(noise);
          for (std::int64_t i = 0; i < size.x; ++i) {
            const V value = from[row + i];
            const double hu = static_cast<double>(value);
            to[row + i] = hu < kAirHu
                              ? value
                              : stored<V>(hu + deviation * static_cast<double>(noise[static_cast<std::size_t>(i)]));
          }
        }
      });
    });
  });
}

}  // namespace tetwarp::truth
