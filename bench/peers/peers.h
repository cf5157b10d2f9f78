// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "deform/vertex_field.h"

namespace tetwarp::bench {

/// What people use for the same work today. Runs once on the volume and the field that it was made for, from data in
/// memory to an output in memory, i fastest, which it gives back; what it allocates the first time is kept. Empty where
/// this build has no such program.
using Peer = std::function<std::span<const std::int16_t>()>;
/// What people use to invert a displacement field. Like `Peer`, it runs once on what it was made for; it gives back the
/// undeformed minus the deformed place of each voxel.
using InversePeer = std::function<std::span<const glm::vec3>()>;

/// What a peer works on. Everything must stay while the peer is used.
struct PeerInput {
  const Volume<std::int16_t>& volume;  ///< spacing 1, origin 0
  std::int16_t background = 0;         ///< outside the source, where the peer has such a value
  int threads = 1;
};

/// "5.2.1"; none where this build has no ITK.
std::optional<std::string> itk_version();
/// ITK's WarpImageFilter, linear, given the inverse.
///
/// @param inverse  on the volume's grid, finite
Peer make_itk_warp(const PeerInput& input, const PullField& inverse);
/// ITK's InvertDisplacementFieldImageFilter with its defaults (20 iterations at most, 0 at the border), then
/// WarpImageFilter.
///
/// @param field  a vertex on every voxel
Peer make_itk_invert_and_warp(const PeerInput& input, const VertexField& field);

/// ITK's filters that invert a displacement field on the whole grid, with their defaults. Not among them is
/// InverseDisplacementFieldImageFilter, a thin-plate spline through every 16th vertex: the matrix of its landmarks
/// grows with the square of their number, and the time with the cube.
enum class ItkInverter : std::uint8_t {
  fixed_border,  ///< InvertDisplacementFieldImageFilter: 20 iterations at most, 0 at the border
  free_border,   ///< the same with EnforceBoundaryCondition off
  iterative      ///< IterativeInverseDisplacementFieldImageFilter: 5 iterations, which run in one thread
};

///
///
/// @param field  spacing 1, origin 0; must stay while the peer is used
InversePeer make_itk_inverter(ItkInverter inverter, const VertexField& field, int threads);

/// "9.1.0, threads by TBB"; none where this build has no VTK.
std::optional<std::string> vtk_version();
/// VTK's vtkProbeFilter: the deformed vtkStructuredGrid with the volume's values at its points, probed at the voxel
/// centres.
///
/// @param field  a vertex on every voxel
Peer make_vtk_probe(const PeerInput& input, const VertexField& field);

}  // namespace tetwarp::bench
