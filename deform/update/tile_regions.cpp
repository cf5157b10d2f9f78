// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/update/tile_regions.h"

#include "deform/geometry.h"

namespace tetwarp {

std::vector<Region> regions_of_tiles(std::span<const std::uint8_t> marked, const glm::i64vec3& tiles,
                                     const glm::i64vec3& size, const glm::i64vec3& origin, const Region& all) {
  std::vector<Region> regions;
  std::size_t n = 0;
  for (std::int64_t z = 0; z < tiles.z; ++z) {
    for (std::int64_t y = 0; y < tiles.y; ++y) {
      std::int64_t begin = -1;
      for (std::int64_t x = 0; x <= tiles.x; ++x) {
        const bool is_marked = x < tiles.x && marked[n + static_cast<std::size_t>(x)] != 0;
        if (is_marked && begin < 0) begin = x;
        if (is_marked || begin < 0) continue;
        regions.push_back(intersection(
            {origin + glm::i64vec3(begin, y, z) * size, origin + glm::i64vec3(x, y + 1, z + 1) * size}, all));
        begin = -1;
      }
      n += static_cast<std::size_t>(tiles.x);
    }
  }
  return regions;
}

}  // namespace tetwarp
