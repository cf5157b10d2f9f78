// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tetwarp::bench {

/// The methods that are compared; bench/paper/baselines.h says what each is. Those "per voxel" are the same loops, of
/// which the compiler is kept from moving the inverse (`InverseIn`).
enum class Method : std::uint8_t {
  inverse4x4_double,
  inverse3x3_double,
  inverse3x3_float,
  paper,
  inverse4x4_double_per_voxel,
  inverse3x3_double_per_voxel,
  inverse3x3_float_per_voxel,
  paper_per_voxel,
  gascon,
  tetwarp
};
/// Where a method takes its field from: a formula that every thread evaluates, or displacements in memory.
enum class FieldSource : std::uint8_t { kernel, memory };

/// When the inverse is computed. The sources say for every voxel, as the paper does; but it depends on the tetrahedron
/// alone, so a compiler that inlines it moves it out of the loop over voxels (nvcc 13 does).
enum class InverseIn : std::uint8_t {
  loop_as_compiled,  ///< whatever the compiler makes of it: once a tetrahedron where it moves it
  every_voxel        ///< for every candidate voxel: the compiler is kept from moving it
};

std::string name_of(Method method);
std::string name_of(FieldSource source);
/// All of them, in the order of the enumeration.
const std::vector<std::string>& method_names();
/// @throws InputError for a name that is none
Method parse_method(const std::string& name);

InverseIn inverse_of(Method method);
/// The same method with the inverse for every candidate voxel. @throws InputError for one that has no such twin
Method per_voxel(Method method);

}  // namespace tetwarp::bench
