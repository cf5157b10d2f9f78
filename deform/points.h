#pragma once

#include <span>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp {

/// What became of a point.
enum class PointStatus : std::uint8_t {
  moved,   ///< by the tetrahedron that holds it; also where that rests
  outside  ///< of the undeformed lattice: it stays where it is
};

/// Moves landmarks or the vertices of a surface by the forward map of a field, as a resampler onto `output` sees it:
/// what the source shows at a point before, the output shows where the point comes to lie.
///
/// Rest and deformed vertices are snapped to 2^-12 voxel of `output` as for volumes (`LatticeFrame::snap_vertex`). A
/// point is moved by the affine map of the one of the five undeformed tetrahedra of a cell that holds it, in double. A
/// point on the border of the lattice, to within 2^-12 voxel, is inside. Which of several tetrahedra that share a face
/// is taken does not matter, for they agree there. Where the field folds, the forward map still has one value.
///
/// @param output  grid that volumes are resampled onto; it decides how vertices are snapped
/// @param field   in host memory
/// @param points  LPS mm, moved in place; a point whose tetrahedron rests keeps its bits
/// @return one status a point
/// @throws InputError for a field that `Resampler::set_field` refuses, or a vertex near a point that is not finite;
/// Cancelled
std::vector<PointStatus> move_points(const Geometry& output, const FieldView& field, std::span<glm::dvec3> points,
                                     Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
