// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "deform/core/cell_weights.h"
#include "deform/core/pull_frame.h"
#include "deform/core/trilinear.h"
#include "deform/cpu/first_refusal.h"
#include "deform/cpu/tiles.h"
#include "deform/fields/point_map.h"
#include "deform/large_memory.h"

namespace tetwarp {

namespace {

/// Whether a displacement says that its place has no source.
bool is_missing(const glm::vec3& displacement) {
  return std::isnan(displacement.x) || std::isnan(displacement.y) || std::isnan(displacement.z);
}

/// Where the samples of a grid begin before a map moves them on.
enum class Start : std::uint8_t {
  at_rest,   ///< their displacements are not read
  displaced  ///< those without a place (NaN) stay so
};

/// Moves every sample of a grid to where `map` takes its place.
void move_samples(const Geometry& grid, std::span<glm::vec3> displacement, const PointMap& map, Start start,
                  const Limits& limits, const Control& control) {
  constexpr std::int64_t kAtOnce = 512;
  const AffineMap point = point_from_index(grid);
  const glm::i64vec3 size = grid.size;
  cpu::WorkProgress progress(control, size.z);
  cpu::FirstRefusal refusal;
  cpu::Arena arena(limits);
  const auto change_slice = [&](std::int64_t z) {
    std::array<glm::dvec3, kAtOnce> from, by;
    std::array<std::size_t, kAtOnce> which;
    for (std::int64_t y = 0; y < size.y; ++y) {
      for (std::int64_t begin = 0; begin < size.x; begin += kAtOnce) {
        glm::vec3* const row = displacement.data() + (z * size.y + y) * size.x + begin;
        const auto samples = static_cast<std::size_t>(std::min(kAtOnce, size.x - begin));
        std::size_t count = 0;
        for (std::size_t n = 0; n < samples; ++n) {
          if (start == Start::displaced && is_missing(row[n])) continue;
          which[count] = n;
          from[count] = point(glm::dvec3(begin + static_cast<std::int64_t>(n), y, z));
          if (start == Start::displaced) from[count] += glm::dvec3(row[n]);
          ++count;
        }
        map.of_row({from.data(), count}, by.data());
        for (std::size_t n = 0; n < count; ++n) {
          glm::vec3& sample = row[which[n]];
          sample = glm::vec3(start == Start::displaced ? glm::dvec3(sample) + by[n] : by[n]);
        }
      }
    }
    progress.done(1);
  };
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z,
                      [&](std::int64_t z) { refusal.attempt(z * size.x * size.y, [&] { change_slice(z); }); });
  });
  refusal.rethrow();
}

}  // namespace

VertexField sample_on(const Geometry& lattice, const PointMap& map, Limits limits, const Control& control) {
  require_valid(lattice, "field lattice");
  VertexField field{lattice, {}};
  resize_large(field.displacement, static_cast<std::size_t>(voxel_count(lattice)), limits.threads);
  move_samples(field.lattice, field.displacement, map, Start::at_rest, limits, control);
  return field;
}

namespace {

void compose(TetrahedralMesh& mesh, const PointMap& next, const Limits& limits, const Control& control) {
  constexpr std::size_t kGrain = 4096;
  cpu::WorkProgress progress(control, static_cast<std::int64_t>(mesh.rest.size()));
  cpu::FirstRefusal refusal;
  cpu::Arena arena(limits);
  const auto move_on = [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      const glm::dvec3 displacement(mesh.displacement[n]);
      mesh.displacement[n] = glm::vec3(displacement + next(mesh.rest[n] + displacement));
    }
    progress.done(static_cast<std::int64_t>(range.size()));
  };
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.rest.size(), kGrain), [&](const auto& range) {
      refusal.attempt(static_cast<std::int64_t>(range.begin()), [&] { move_on(range); });
    });
  });
  refusal.rethrow();
}

}  // namespace

void compose(VertexField& field, const PointMap& next, Limits limits, const Control& control) {
  if (!field.mesh.is_empty()) compose(field.mesh, next, limits, control);
  if (!field.mesh.is_empty() && field.replaced.empty()) return;
  move_samples(field.lattice, field.displacement, next, Start::displaced, limits, control);
}

void compose(PullField& field, const PointMap& next, Limits limits, const Control& control) {
  move_samples(field.grid, field.displacement, next, Start::displaced, limits, control);
}

PointMap piecewise_affine(const VertexField& field) {
  require(field.mesh.is_empty(), "a mesh says where its own vertices go alone; let it be the first field");
  const AffineMap lattice_from_point = index_from_point(field.lattice);
  return [&field, lattice_from_point](const glm::dvec3& point) {
    constexpr double kSlack = 1e-6;  // of a cell, by which rounding may put a point outside
    const glm::dvec3 index = lattice_from_point(point);
    const glm::i64vec3 size = field.lattice.size;
    glm::i64vec3 cell;
    for (int axis = 0; axis < 3; ++axis) {
      require(index[axis] >= -kSlack && index[axis] <= static_cast<double>(size[axis] - 1) + kSlack,
              "a vertex is moved to (" + std::to_string(point.x) + ", " + std::to_string(point.y) + ", " +
                  std::to_string(point.z) + ") mm, outside the lattice of the field that follows");
      cell[axis] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(index[axis])), 0, size[axis] - 2);
    }
    const CellWeights w =
        weights_in_cell(glm::clamp(index - glm::dvec3(cell), 0.0, 1.0), ((cell.x + cell.y + cell.z) & 1) != 0);
    const auto at = [&](int corner) {
      const glm::i64vec3 vertex = cell + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
      return glm::dvec3(
          field.displacement[static_cast<std::size_t>((vertex.z * size.y + vertex.y) * size.x + vertex.x)]);
    };
    const glm::dvec3 d = at(w.corners.d);
    return d + w.a * (at(w.corners.a) - d) + w.b * (at(w.corners.b) - d) + w.c * (at(w.corners.c) - d);
  };
}

PointMap between_samples(const PullField& field) {
  const AffineMap grid_from_point = index_from_point(field.grid);
  return [&field, grid_from_point](const glm::dvec3& point) {
    constexpr double kBorderRounding = PullFrame::kBorderRounding;
    const glm::i64vec3 size = field.grid.size;
    const glm::dvec3 index = grid_from_point(point), last(size - std::int64_t{1});
    const glm::dvec3 inside = glm::clamp(index, glm::dvec3(0), last);
    if (glm::any(glm::greaterThan(glm::abs(index - inside), glm::dvec3(kBorderRounding)))) return glm::dvec3(NAN);
    return trilinear(size, inside, [&](const glm::i64vec3& at) {
      return field.displacement[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)];
    });
  };
}

}  // namespace tetwarp
