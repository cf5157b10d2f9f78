// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/mesh_raster.h"

#include <algorithm>
#include <glm/common.hpp>

#include "deform/core/row_interval.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::cpu {

namespace {

constexpr std::int64_t kBin = kMostRowTile;  ///< voxels of a bin along an axis
constexpr std::size_t kAtOnce = 1 << 16;     ///< tetrahedra between two looks at a request to stop

/// Enters a tetrahedron as the owner of the voxels of a run that have none yet: numbers rise from call to call.
void give(std::uint32_t number, std::size_t first, int count, bool wants_count, MeshOwners& owners) {
  std::uint32_t* owner = owners.owner.data() + first;
  for (int n = 0; n < count; ++n) owner[n] = std::min(owner[n], number);
  if (!wants_count) return;
  std::uint16_t* several = owners.count.data() + first;
  for (int n = 0; n < count; ++n) several[n] = static_cast<std::uint16_t>(several[n] + (several[n] < UINT16_MAX));
}

}  // namespace

Region MeshRaster::bin(const glm::i64vec3& at) const {
  const glm::i64vec3 begin = origin_ + at * kBin;
  return {glm::max(begin, glm::i64vec3(0)), glm::min(begin + kBin, size_)};
}

/// Calls `visit(number)` for each bin that a tetrahedron may reach.
template <class Visit>
void MeshRaster::for_each_bin(const Tetrahedron& t, Visit&& visit) const {
  const Region voxels = detail::candidates(mesh_->nudge, box_of(t), {glm::i64vec3(0), size_});
  if (is_empty(voxels)) return;
  const glm::i64vec3 begin = (voxels.begin - origin_) / kBin, end = (voxels.end - std::int64_t{1} - origin_) / kBin;
  const auto number = [&](const glm::i64vec3& at) {
    return static_cast<std::size_t>((at.z * bins_.y + at.y) * bins_.x + at.x);
  };
  if (begin == end) return visit(number(begin));
  const TetrahedronPlanes planes(t);
  for (std::int64_t z = begin.z; z <= end.z; ++z) {
    for (std::int64_t y = begin.y; y <= end.y; ++y) {
      for (std::int64_t x = begin.x; x <= end.x; ++x) {
        const Region in = intersection(bin({x, y, z}), {voxels.begin, voxels.end});
        if (planes.may_reach({in.begin, in.end})) visit(number({x, y, z}));
      }
    }
  }
}

void MeshRaster::build(const SnappedMesh& mesh, const Geometry& output, const Control& control) {
  mesh_ = &mesh;
  size_ = output.size;
  for (int axis = 0; axis < 3; ++axis) {
    origin_[axis] = tile_origin(0, size_[axis], mesh.nudge.first_down(axis), kBin);
    bins_[axis] = (size_[axis] - origin_[axis] + kBin - 1) / kBin;
  }
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
      if (n % kAtOnce == 0 && control.stop.stop_requested()) throw Cancelled();
      for_each_bin(mesh.tetrahedron(n), [&](std::size_t number) { visit(number, n); });
    }
  };
  lists_.build(static_cast<std::size_t>(bins_.x * bins_.y * bins_.z), for_each_pair);
}

void MeshRaster::find(const Region& box, bool wants_count, MeshOwners& owners) const {
  const auto voxels = static_cast<std::size_t>(voxel_count(box));
  owners.owner.assign(voxels, MeshOwners::kNobody);
  if (wants_count) owners.count.assign(voxels, 0);
  const glm::i64vec3 begin = (box.begin - origin_) / kBin, end = (box.end - std::int64_t{1} - origin_) / kBin;
  for (std::int64_t z = begin.z; z <= end.z; ++z) {
    for (std::int64_t y = begin.y; y <= end.y; ++y) {
      for (std::int64_t x = begin.x; x <= end.x; ++x) {
        const auto number = static_cast<std::size_t>((z * bins_.y + y) * bins_.x + x);
        find_in_bin(number, intersection(bin({x, y, z}), box), box, wants_count, owners);
      }
    }
  }
}

/// Finds the owners in one bin. @param part  the part of the box within the bin
void MeshRaster::find_in_bin(std::size_t number, const Region& part, const Region& box, bool wants_count,
                             MeshOwners& owners) const {
  const glm::i32vec3 signs = mesh_->nudge.signs(part.begin);
  const glm::ivec3 first(part.begin), size(part.end - part.begin);
  const glm::i64vec3 box_size = box.end - box.begin;
  const auto offset = [&](int y, int z) {
    const glm::i64vec3 at = part.begin + glm::i64vec3(0, y, z) - box.begin;
    return static_cast<std::size_t>((at.z * box_size.y + at.y) * box_size.x + at.x);
  };
  for (const std::uint32_t* listed = lists_.begin(number); listed != lists_.end(number); ++listed) {
    const Tetrahedron t = mesh_->tetrahedron(*listed);
    const Region reached = detail::candidates(mesh_->nudge, box_of(t), part);
    if (is_empty(reached)) continue;
    const glm::ivec3 begin = glm::ivec3(reached.begin) - first, end = glm::ivec3(reached.end) - first;
    RowFaces faces{};
    const bool has_faces = make_row_faces(t, first, signs, size, faces);
    for (int y = begin.y; y < end.y; ++y) {
      const RowsAlongZ rows(faces, y);
      for (int z = begin.z; z < end.z; ++z) {
        bool is_certain = false;
        RowInterval in{0, 0};
        if (has_faces) in = rows.interval(z, size.x, is_certain);
        if (!is_certain) in = exact_row(t, first, signs, y, z, size.x);
        if (in.is_empty()) continue;
        give(*listed, offset(y, z) + static_cast<std::size_t>(in.begin), in.end - in.begin, wants_count, owners);
      }
    }
  }
}

}  // namespace tetwarp::cpu
