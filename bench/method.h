#pragma once

#include <cstdint>
#include <string>

namespace tetwarp::bench {

/// The methods that are compared; bench/baselines.h says what each is.
enum class Method : std::uint8_t { inverse4x4_double, inverse3x3_double, inverse3x3_float, paper, gascon, tetwarp };
/// Where a method takes its field from: a formula that every thread evaluates, or displacements in memory.
enum class FieldSource : std::uint8_t { kernel, memory };

/// When the inverse is computed. The sources say for every voxel, as the paper does; but it depends on the tetrahedron
/// alone, so a compiler that inlines it moves it out of the loop over voxels (nvcc 13 does).
enum class InverseIn : std::uint8_t {
  loop_as_compiled,  ///< whatever the compiler makes of it: fewer inverses than voxels
  every_voxel        ///< the compiler is kept from moving it
};

std::string name_of(Method method);
std::string name_of(FieldSource source);
/// @throws InputError for a name that is none
Method parse_method(const std::string& name);

}  // namespace tetwarp::bench
