// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: how files of VTK that Tetwarp writes say which lattice a mesh was made of.
#include <string>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp {

/// Name of an array of the whole dataset: the lattice's geometry, `mesh_lattice_numbers`.
constexpr char kMeshLatticeArray[] = "tetwarp_lattice";
/// Name of an array of the points: the number of the lattice's vertex (i fastest) that each rests at, -1 for none.
constexpr char kMeshLatticeVertexArray[] = "tetwarp_lattice_vertex";
constexpr std::size_t kMeshLatticeNumbers = 18;

/// A lattice's geometry as numbers: size, spacing (mm), origin (LPS mm) and the three columns of the direction, in this
/// order.
std::vector<double> mesh_lattice_numbers(const Geometry& lattice);
/// The geometry of a lattice from `mesh_lattice_numbers`. @throws InputError for numbers that are no lattice of two
/// vertices or more on every axis
Geometry mesh_lattice_of(const std::vector<double>& numbers, const std::string& file);

}  // namespace tetwarp
