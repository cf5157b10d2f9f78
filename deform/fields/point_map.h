// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>

#include "deform/resampler.h"

namespace tetwarp {

/// Displacement (LPS mm, deformed minus undeformed) of a point (LPS mm) of the undeformed volume. It may be called from
/// several threads at a time.
using PointMap = std::function<glm::dvec3(const glm::dvec3& point)>;

/// The values of a map at the vertices of a lattice, computed in parallel.
/// @throws Cancelled; an InputError of the map, of several that for the first vertex, whatever the threads do
VertexField sample_on(const Geometry& lattice, const PointMap& map, Limits limits = {}, const Control& control = {});

/// The map of a field between its vertices: affine in the same five tetrahedra of each cell that the resampler uses.
/// The field must outlive the map. A call of the map throws InputError for a point outside the lattice.
PointMap piecewise_affine(const VertexField& field);

/// Appends a second deformation to a field: each vertex is moved on by the displacement that `next` has at the place to
/// which `field` moved it. The lattice stays.
/// @throws Cancelled; an InputError of `next`, of several that for the first vertex, and the field is of no use then
void compose(VertexField& field, const PointMap& next, Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
