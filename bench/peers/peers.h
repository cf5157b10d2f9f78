// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "deform/vertex_field.h"

namespace tetwarp::bench {

/// What people use for the same work today, run on the volume and the field that it was made for.
class Peer {
 public:
  virtual ~Peer() = default;

  /// Once, from data in memory to an output in memory. What it allocates the first time is kept.
  virtual void run() = 0;
  /// Of the last run, i fastest.
  virtual std::span<const std::int16_t> output() const = 0;
};

/// What a peer works on. Everything must stay while the peer is used.
struct PeerInput {
  const Volume<std::int16_t>& volume;  ///< spacing 1, origin 0
  std::int16_t background = 0;         ///< outside the source, where the peer has such a value
  int threads = 1;
};

/// "5.2.1"; none where this build has no ITK.
std::optional<std::string> itk_version();
/// ITK's WarpImageFilter, linear, given the inverse. Null without ITK.
///
/// @param inverse  on the volume's grid, finite
std::unique_ptr<Peer> make_itk_warp(const PeerInput& input, const PullField& inverse);
/// ITK's InvertDisplacementFieldImageFilter with its defaults (20 iterations at most, 0 at the border), then
/// WarpImageFilter. Null without ITK.
///
/// @param field  a vertex on every voxel
std::unique_ptr<Peer> make_itk_invert_and_warp(const PeerInput& input, const VertexField& field);

/// A peer that makes the inverse of a displacement field.
class InversePeer {
 public:
  virtual ~InversePeer() = default;

  /// Once, from the field in memory to its inverse in memory. What it allocates the first time is kept.
  virtual void run() = 0;
  /// Of the last run: undeformed minus deformed place, i fastest.
  virtual std::span<const glm::vec3> inverse() const = 0;
};

/// ITK's filters that invert a displacement field on the whole grid, with their defaults. Not among them is
/// InverseDisplacementFieldImageFilter, a thin-plate spline through every 16th vertex: the matrix of its landmarks
/// grows with the square of their number, and the time with the cube.
enum class ItkInverter : std::uint8_t {
  fixed_border,  ///< InvertDisplacementFieldImageFilter: 20 iterations at most, 0 at the border
  free_border,   ///< the same with EnforceBoundaryCondition off
  iterative      ///< IterativeInverseDisplacementFieldImageFilter: 5 iterations, which run in one thread
};

/// Null without ITK.
///
/// @param field  spacing 1, origin 0; must stay while the peer is used
std::unique_ptr<InversePeer> make_itk_inverter(ItkInverter inverter, const VertexField& field, int threads);

/// "9.1.0, threads by TBB"; none where this build has no VTK.
std::optional<std::string> vtk_version();
/// VTK's vtkProbeFilter: the deformed vtkStructuredGrid with the volume's values at its points, probed at the voxel
/// centres. Null without VTK.
///
/// @param field  a vertex on every voxel
std::unique_ptr<Peer> make_vtk_probe(const PeerInput& input, const VertexField& field);

}  // namespace tetwarp::bench
