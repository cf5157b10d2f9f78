// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>

#include "deform/resampler.h"

namespace tetwarp {

/// Displacement (LPS mm, deformed minus rest) of a point (LPS mm) of the undeformed volume. Called from several
/// threads.
using PointMap = std::function<glm::dvec3(const glm::dvec3& point)>;

/// Values of a map at the vertices of a lattice, in parallel.
VertexField sample_on(const Geometry& lattice, const PointMap& map, Limits limits = {}, const Control& control = {});

/// The piecewise affine map of a field at any point of its lattice: the same five tetrahedra that the resampler uses.
/// The field must outlive the map. @throws InputError (when called) for a point outside the lattice
PointMap piecewise_affine(const VertexField& field);

/// Moves every vertex on: where the field brought it, `next` displaces it further. The result holds for `field`'s
/// lattice.
void compose(VertexField& field, const PointMap& next, Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
