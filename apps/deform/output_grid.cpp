// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/output_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cmath>
#include <filesystem>
#include <glm/common.hpp>

#include "apps/cli/input.h"
#include "deform/field_check.h"
#include "deform/resampler.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

struct Bounds {
  glm::dvec3 low{INFINITY}, high{-INFINITY};

  void grow(const glm::dvec3& at) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
};

Bounds bounds_of_mesh(const TetrahedralMesh& mesh, const Geometry& volume) {
  Bounds bounds;
  const AffineMap index = index_from_point(volume);
  for (std::size_t n = 0; n < mesh.rest.size(); ++n)
    bounds.grow(index(mesh.rest[n] + glm::dvec3(mesh.displacement[n])));
  return bounds;
}

Bounds bounds_of_lattice(const VertexField& field, const Geometry& volume) {
  const AffineMap index_from_lattice = index_from_point(volume) * point_from_index(field.lattice);
  const glm::dmat3 index_from_mm = index_from_point(volume).linear;
  const glm::i64vec3 size = field.lattice.size;
  using Rows = tbb::blocked_range<std::int64_t>;
  return tbb::parallel_reduce(
      Rows(0, size.y * size.z), Bounds{},
      [&](const Rows& rows, Bounds bounds) {
        for (std::int64_t row = rows.begin(); row != rows.end(); ++row) {
          const glm::vec3* by = field.displacement.data() + row * size.x;
          for (std::int64_t i = 0; i < size.x; ++i) {
            bounds.grow(index_from_lattice(glm::dvec3(i, row % size.y, row / size.y)) +
                        index_from_mm * glm::dvec3(by[i]));
          }
        }
        return bounds;
      },
      [](Bounds a, const Bounds& b) {
        a.grow(b.low);
        a.grow(b.high);
        return a;
      });
}

/// Where the deformed vertices lie in a volume's continuous index: those of the lattice, of the mesh that takes the
/// place of some of its cells, or of a mesh that stands alone.
Bounds bounds_of(const VertexField& field, const Geometry& volume) {
  Bounds bounds = bounds_of_mesh(field.mesh, volume);
  if (!field.mesh.is_empty() && field.replaced.empty()) return bounds;
  const Bounds of_lattice = bounds_of_lattice(field, volume);
  bounds.grow(of_lattice.low);
  bounds.grow(of_lattice.high);
  return bounds;
}

Geometry grown(const Geometry& volume, const Bounds& bounds) {
  constexpr double kNearly = 1.0 / 1024;  // voxels: rounding adds no slice
  constexpr double kFar = 1 << 18;
  require(glm::all(glm::lessThan(glm::abs(bounds.low), glm::dvec3(kFar))) &&
              glm::all(glm::lessThan(glm::abs(bounds.high), glm::dvec3(kFar))),
          "the field moves vertices more than 262144 voxels away, too far for --grid fit; give --grid FILE");
  const glm::i64vec3 begin = glm::min(glm::i64vec3(0), glm::i64vec3(glm::floor(bounds.low + kNearly))),
                     last = glm::max(volume.size - std::int64_t{1}, glm::i64vec3(glm::ceil(bounds.high - kNearly)));
  Geometry grid = volume;
  grid.origin = point_from_index(volume)(glm::dvec3(begin));
  grid.size = last - begin + std::int64_t{1};
  return grid;
}

}  // namespace

bool is_same_grid(const std::string& wanted) { return wanted == "same"; }

bool is_fitting_grid(const std::string& wanted) { return wanted == "fit"; }

bool names_volume(const std::string& wanted) { return !is_same_grid(wanted) && !is_fitting_grid(wanted); }

InputOptions grid_volume(const std::string& wanted) {
  InputOptions volume;
  volume.path = wanted;
  volume.uneven = true;
  return volume;
}

void check_grid(const std::string& wanted, bool pull) {
  if (is_fitting_grid(wanted) && pull) {
    throw UsageError("--grid fit needs to know where vertices go, which --pull-field does not say; give --grid FILE");
  }
  if (names_volume(wanted) && !std::filesystem::exists(wanted)) {
    throw UsageError("--grid is \"" + wanted + "\", expected same, fit, or a volume that exists");
  }
}

Geometry grid_of_volume(const std::string& wanted, NiftiFrame frame) {
  if (has_image_suffix(wanted)) return read_image_header(wanted, frame).geometry;
  return straightened(open_input(grid_volume(wanted), {.stop = interrupt_token()}).geometry);
}

Geometry fitting_grid(const Geometry& input, const VertexField& field, Outside outside) {
  const Geometry volume = straightened(input);
  // What does not reach over the volume is refused.
  if (field.mesh.is_empty()) {
    make_lattice_frame(volume, view(field, outside));
  } else {
    make_cpu_resampler(volume)->set_field(view(field, outside));
  }
  return grown(volume, bounds_of(field, volume));
}

}  // namespace tetwarp::apps
