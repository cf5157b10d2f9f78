// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/intervals/mesh_raster.h"

#include <algorithm>
#include <glm/common.hpp>

#include "deform/core/visit_cell.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::cpu {

namespace {

constexpr std::int64_t kBin = kTile;      ///< voxels of a bin along an axis
constexpr std::size_t kAtOnce = 1 << 16;  ///< tetrahedra between two looks at a request to stop

}  // namespace

Region MeshRaster::bin(const glm::i64vec3& at) const {
  const glm::i64vec3 begin = at * kBin;
  return {begin, glm::min(begin + kBin, size_)};
}

/// Calls `visit(number)` for each bin that a tetrahedron may reach.
template <class Visit>
void MeshRaster::for_each_bin(const Tetrahedron& t, Visit&& visit) const {
  const Region voxels = detail::candidates(mesh_->nudge, box_of(t), {glm::i64vec3(0), size_});
  if (is_empty(voxels)) return;
  const glm::i64vec3 begin = voxels.begin / kBin, end = (voxels.end - std::int64_t{1}) / kBin;
  if (begin == end) return visit(bin_number(begin));
  const TetrahedronPlanes planes(t);
  for (std::int64_t z = begin.z; z <= end.z; ++z) {
    for (std::int64_t y = begin.y; y <= end.y; ++y) {
      for (std::int64_t x = begin.x; x <= end.x; ++x) {
        const Region in = intersection(bin({x, y, z}), {voxels.begin, voxels.end});
        if (planes.may_reach({in.begin, in.end})) visit(bin_number({x, y, z}));
      }
    }
  }
}

void MeshRaster::build(const SnappedMesh& mesh, const Geometry& output, const Control& control) {
  mesh_ = &mesh;
  size_ = output.size;
  bins_ = (size_ + (kBin - 1)) / kBin;
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
      if (n % kAtOnce == 0 && control.stop.stop_requested()) throw Cancelled();
      for_each_bin(mesh.tetrahedron(n), [&](std::size_t number) { visit(number, n); });
    }
  };
  lists_.build(static_cast<std::size_t>(bins_.x * bins_.y * bins_.z), for_each_pair);
}

void MeshRaster::find(const Region& box, bool counts, IntervalTile& tile, IntervalSink* sink) const {
  tile.begin(box, mesh_->nudge, counts, sink);
  const glm::i64vec3 begin = box.begin / kBin, end = (box.end - std::int64_t{1}) / kBin;
  if (begin == end) {
    const std::size_t number = bin_number(begin);
    for (const std::uint32_t* n = lists_.begin(number); n != lists_.end(number); ++n)
      tile.enter(*n, mesh_->tetrahedron(*n));
    tile.end();
    return;
  }
  std::vector<std::uint32_t> listed;  // of several bins: numbers must rise
  for (std::int64_t z = begin.z; z <= end.z; ++z) {
    for (std::int64_t y = begin.y; y <= end.y; ++y) {
      for (std::int64_t x = begin.x; x <= end.x; ++x)
        listed.insert(listed.end(), lists_.begin(bin_number({x, y, z})), lists_.end(bin_number({x, y, z})));
    }
  }
  std::sort(listed.begin(), listed.end());
  listed.erase(std::unique(listed.begin(), listed.end()), listed.end());
  for (const std::uint32_t n : listed) tile.enter(n, mesh_->tetrahedron(n));
  tile.end();
}

}  // namespace tetwarp::cpu
