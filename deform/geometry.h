// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "deform/core/host_device.h"

namespace tetwarp {

/// Grid of voxels or vertices in patient space, LPS millimetres, as in ITK.
///
/// A voxel is a point sample at its centre: continuous index (i, j, k) lies at
/// `origin + direction * (spacing * index)`; column c of `direction` is the unit vector along which index c grows.
///
/// A source may also be sheared, as a gantry tilt leaves it: the columns of `direction` are not perpendicular then. And
/// its slices may be unevenly far apart: `slices` says where they are, and `spacing.z` is their mean distance, so that
/// the first and the last slice lie where an even stack has them.
struct Geometry {
  glm::i64vec3 size{0};             ///< samples along i, j, k
  glm::dvec3 spacing{1};            ///< mm between neighbours along i, j, k, each > 0
  glm::dvec3 origin{0};             ///< LPS mm of the centre of sample (0, 0, 0)
  glm::dmat3 direction{1};          ///< columns: directions of i, j, k in LPS
  std::vector<double> slices = {};  ///< empty: even; else mm along k of each slice, from 0, rising (sources only)

  friend bool operator==(const Geometry&, const Geometry&) = default;
};

/// Box of voxels, half open: begin <= voxel < end on every axis.
struct Region {
  glm::i64vec3 begin{0}, end{0};

  friend bool operator==(const Region&, const Region&) = default;
};

/// x -> linear * x + offset. Maps read right to left, so they compose: `a_from_b * b_from_c`.
struct AffineMap {
  glm::dmat3 linear{1};
  glm::dvec3 offset{0};

  TETWARP_HD glm::dvec3 operator()(const glm::dvec3& x) const { return linear * x + offset; }
  AffineMap operator*(const AffineMap& first) const { return {linear * first.linear, linear * first.offset + offset}; }
};

/// Continuous index to LPS mm.
AffineMap point_from_index(const Geometry& geometry);
/// LPS mm to continuous index. @throws InputError where the geometry has no inverse
AffineMap index_from_point(const Geometry& geometry);

std::int64_t voxel_count(const Geometry& geometry);
std::int64_t voxel_count(const Region& region);
Region whole(const Geometry& geometry);
bool is_empty(const Region& region);
bool contains(const Region& outer, const Region& inner);
Region intersection(const Region& a, const Region& b);

/// LPS mm of the middle: the mean of the eight corner voxel centres (semantics: c).
glm::dvec3 centre(const Geometry& geometry);

/// Whether both grids have the same size and every corner voxel centre agrees within `tolerance_mm`.
bool same_grid(const Geometry& a, const Geometry& b, double tolerance_mm);

/// Lattice with a vertex every `cell_size` voxels of `volume`: ceil((N - 1) / B) + 1 vertices an axis, so that the last
/// cell may overhang the volume. @throws InputError for a cell size below 1 or fewer than two voxels on an axis
Geometry lattice_over(const Geometry& volume, std::int64_t cell_size);

/// Whether rows, columns and stack are not perpendicular, by more than rounding: 1e-6 in a cosine.
bool is_sheared(const Geometry& geometry);

/// The grid that a sheared or uneven volume is resampled onto where it is to keep "its" grid: rows and columns as they
/// are, the third axis row x column, its step the smallest distance of two slices along it, grown by whole voxels until
/// all slices lie inside. Others are returned as they are.
Geometry straightened(const Geometry& geometry);

/// Three-letter anatomical code of the directions in which i, j, k grow, "LPS" for the identity direction.
std::string orientation_code(const Geometry& geometry);

/// What the spacing of a grid may be, in mm: no scanner and no microscope is near either end, and a number beyond them
/// is a mistaken unit or a damaged file.
constexpr double kSmallestSpacing = 1e-6, kLargestSpacing = 1e6;

/// @throws InputError unless sizes are positive, spacings within the bounds above, all numbers finite, and the
/// direction can be inverted; or for `slices` that are not one a slice, rising from 0 to the last slice of the even
/// stack; `what` names the grid
void require_valid(const Geometry& geometry, const std::string& what);

/// "512 x 512 x 300", the way messages show a size.
std::string to_string(const glm::i64vec3& size);

}  // namespace tetwarp
