// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/score/error_picture.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "io/png.h"

namespace tetwarp::apps {

std::vector<std::uint8_t> error_picture(score::Truth& truth, const PullField& result, const ConstVolumeView& volume,
                                        std::span<const score::Counts> counts, const glm::dvec3& where) {
  constexpr double kMostMm = 10, kLowHu = -1000, kHighHu = 400;
  const Geometry& grid = truth.grid();
  const glm::i64vec3 size = grid.size;
  const auto k =
      std::clamp(static_cast<std::int64_t>(std::lround(index_from_point(grid)(where).z)), std::int64_t{0}, size.z - 1);
  const score::TruthSlab slab = truth.slab({{0, 0, k}, {size.x, size.y, k + 1}}, {});
  const int larger = std::max(1, static_cast<int>(512 / std::max(size.x, size.y)));
  Picture picture(static_cast<int>(size.x) * larger, static_cast<int>(size.y) * larger);
  dispatch(volume.type, [&]<class V>(V) {
    const V* values = reinterpret_cast<const V*>(volume.voxels) + k * size.x * size.y;
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const auto n = static_cast<std::size_t>(i + size.x * j);
        const double grey = std::clamp((static_cast<double>(values[n]) - kLowHu) / (kHighHu - kLowHu), 0.0, 1.0);
        const std::size_t voxel = n + static_cast<std::size_t>(k * size.x * size.y);
        const glm::vec3 found = result.displacement[voxel];
        double red = grey, green = grey, blue = grey;
        if (counts[voxel] == score::Counts::yes && slab.is_known[n]) {
          if (std::isnan(found.x)) {
            blue = 1;
          } else {
            const double error = glm::distance(glm::dvec3(found), glm::dvec3(slab.displacement[n])),
                         share = std::min(error / kMostMm, 1.0);
            red += share * (1 - red), green *= 1 - share, blue *= 1 - share;
          }
        }
        const auto byte = [](double part) { return static_cast<std::uint8_t>(std::lround(255 * part)); };
        picture.fill(static_cast<int>(i) * larger, static_cast<int>(j) * larger, larger, larger,
                     {byte(red), byte(green), byte(blue)});
      }
    }
  });
  return png_bytes(picture);
}

}  // namespace tetwarp::apps
