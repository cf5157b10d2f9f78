// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/core/region.h"

namespace tetwarp {

/// Regular grid of voxels or vertices in patient space: LPS coordinates in mm, as in ITK.
///
/// A voxel is a point sample at its centre. Continuous index (i, j, k) lies at `origin + direction * (spacing *
/// index)`; column c of `direction` is the unit vector along which index c grows.
///
/// The grid of a source may be sheared, as a gantry tilt leaves it; then the columns of `direction` are not
/// perpendicular. Its slices may also lie at unequal distances. Then `slices` states where they lie, and `spacing.z` is
/// their mean distance, so that the first and the last slice lie where those of an even stack would.
struct Geometry {
  glm::i64vec3 size{0};     ///< number of samples along i, j, k
  glm::dvec3 spacing{1};    ///< mm between neighbouring samples along i, j, k, each above 0
  glm::dvec3 origin{0};     ///< LPS mm of the centre of sample (0, 0, 0)
  glm::dmat3 direction{1};  ///< its columns are the unit vectors of i, j, k in LPS
  /// Position along k of each slice, mm, from 0 upwards; empty for an even stack. Only sources may be uneven.
  std::vector<double> slices = {};

  /// Whether all numbers are equal.
  friend bool operator==(const Geometry&, const Geometry&) = default;
};

/// The map x -> linear * x + offset. Maps read from right to left, and so compose: `a_from_b * b_from_c`.
struct AffineMap {
  glm::dmat3 linear{1};  ///< linear part
  glm::dvec3 offset{0};  ///< image of the point 0

  /// The image of a point.
  TETWARP_HD glm::dvec3 operator()(const glm::dvec3& x) const { return linear * x + offset; }
  /// The map that applies `first`, then this one.
  AffineMap operator*(const AffineMap& first) const { return {linear * first.linear, linear * first.offset + offset}; }
};

/// The inverse of a map whose linear part has one; not finite without.
AffineMap inverse_of(const AffineMap& map);

/// The map from continuous index to LPS mm. Of a grid with `slices` it is that of the even stack.
AffineMap point_from_index(const Geometry& geometry);
/// The map from LPS mm to continuous index. Of a grid with `slices` it is that of the even stack.
/// @throws InputError for a geometry that has no inverse
AffineMap index_from_point(const Geometry& geometry);

/// Number of samples of a grid.
std::int64_t voxel_count(const Geometry& geometry);
/// Number of voxels in a box.
std::int64_t voxel_count(const Region& region);
/// All voxels of a grid.
Region whole(const Geometry& geometry);
/// Whether `outer` holds every voxel of `inner`.
bool contains(const Region& outer, const Region& inner);
/// The voxels that lie in both boxes.
Region intersection(const Region& a, const Region& b);

/// LPS mm of the middle of a grid: the mean of its eight corner voxel centres.
glm::dvec3 centre(const Geometry& geometry);

/// Whether both grids have the same size and each pair of corner voxel centres lies within `tolerance_mm` of each
/// other.
bool same_grid(const Geometry& a, const Geometry& b, double tolerance_mm);

/// The lattice with a vertex on every voxel of `volume` whose index is a multiple of `cell_size`, B: ceil((N - 1) / B)
/// + 1 vertices on an axis of N voxels, so its last cell may extend beyond the volume.
/// @throws InputError for a cell size below 1, or fewer than two voxels on an axis
Geometry lattice_over(const Geometry& volume, std::int64_t cell_size);

/// Whether two columns of `direction` are not perpendicular: the cosine of their angle exceeds 1e-6, which rounding
/// does not explain.
bool is_sheared(const Geometry& geometry);

/// The straight, even grid onto which a sheared or uneven volume is resampled to keep its place. Any other grid is
/// returned unchanged.
/// Rows and columns stay. The third axis is row x column, its step is the smallest distance of two slices along it, and
/// the grid grows by whole voxels until it holds all slices.
Geometry straightened(const Geometry& geometry);

/// Three-letter anatomical code of the directions in which i, j, k grow: "LPS" for the identity direction.
std::string orientation_code(const Geometry& geometry);

constexpr double kSmallestSpacing = 1e-6,  ///< smallest spacing of a grid, mm; less is a mistaken unit or damage
    kLargestSpacing = 1e6;                 ///< largest spacing of a grid, mm
/// Whether a number, mm, can be a spacing of a grid.
inline bool is_spacing(double mm) { return mm >= kSmallestSpacing && mm <= kLargestSpacing; }

/// Checks a grid.
/// @param geometry  the grid
/// @param what      its name in the message
/// @throws InputError unless sizes are positive, spacings lie between kSmallestSpacing and kLargestSpacing, all numbers
///         are finite, the direction has an inverse, and `slices` is empty or has one number a slice that rise from 0
///         to the last slice of the even stack
void require_valid(const Geometry& geometry, const std::string& what);

/// The size as messages show it: "512 x 512 x 300".
std::string to_string(const glm::i64vec3& size);

}  // namespace tetwarp
