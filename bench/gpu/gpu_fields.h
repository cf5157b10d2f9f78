// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "bench/paper/fields.h"

namespace tetwarp::bench {

/// amplitude * sin(wave . rest + phase): voxels and radians, of a rest place in voxels.
struct Sine {
  glm::vec3 wave{0};
  float amplitude = 0, phase = 0;
};

constexpr int kSines = 3;

/// A deformation that `gpu` and `cpu` measure, in float and voxels: a function of the place where a vertex rests.
struct TestField {
  enum class Kind : std::uint8_t { formula, elastic, noise, rotation, folds };

  Kind kind = Kind::formula;
  Formula formula;                             ///< Kind::formula; the centre is that of every kind
  Sine sines[3][kSines];                       ///< elastic: of each component
  float amplitude = 0, radians_per_voxel = 0;  ///< folds: both; noise: largest of a component; rotation: 1 or -1
};

/// The field of a name, for a volume of a size:
///
/// | name | what it is |
/// | --- | --- |
/// | identity, wave, twist, bubble | as `make_formula` |
/// | elastic | three sines in each component, in general directions, wavelengths 40 to 120, in sum 6 voxels at most |
/// | noise | white, uniform within 0.2 voxel of 0 in each component |
/// | rotation | a quarter turn about the third axis through the centre |
/// | folds | a displacement along x by a sine of x, amplitude 16, wavelength 64: its slope passes -1 |
/// | local | a bubble in at most 8 % of the volume |
///
/// @throws InputError for another name
TestField make_test_field(const std::string& name, const glm::i64vec3& size);

/// The elastic field, no component of which is larger than `amplitude`, voxels. It is injective up to 6 voxels: there
/// it changes by less than 0.9 voxel a voxel.
TestField make_elastic(float amplitude);

/// The deformation that leads back, where it has this form: of identity, wave, twist and rotation.
std::optional<TestField> inverse_of(TestField field);

namespace detail {

/// The last step of SplitMix64: 64 bits, of which each depends on every bit of the counter.
TETWARP_HD inline std::uint64_t mixed(std::uint64_t counter) {
  std::uint64_t z = (counter + 1) * 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

/// From -1 to below 1, a multiple of 2^-23: exact in float.
TETWARP_HD inline float uniform(std::uint64_t counter) {
  constexpr int kHalf = 1 << 23;
  return static_cast<float>(static_cast<int>(mixed(counter) >> 40) - kHalf) * (1.0f / kHalf);
}

/// A number of the vertex that rests at a voxel of the grid (below 2^20 on each axis).
TETWARP_HD inline std::uint64_t number_of(const glm::vec3& rest) {
  return (static_cast<std::uint64_t>(rest.z) << 40) | (static_cast<std::uint64_t>(rest.y) << 20) |
         static_cast<std::uint64_t>(rest.x);
}

TETWARP_HD inline float sum_of(const Sine (&sines)[kSines], const glm::vec3& rest) {
  float sum = 0;
  for (const Sine& sine : sines) {
    sum += sine.amplitude * std::sin(sine.wave.x * rest.x + sine.wave.y * rest.y + sine.wave.z * rest.z + sine.phase);
  }
  return sum;
}

}  // namespace detail

/// Displacement (voxels, deformed minus rest) of a vertex that rests at `rest` (continuous index of the volume; for
/// noise a voxel of it).
TETWARP_HD inline glm::vec3 displacement_at(const TestField& field, const glm::vec3& rest) {
  const float x = rest.x - field.formula.centre.x, y = rest.y - field.formula.centre.y;
  switch (field.kind) {
    case TestField::Kind::formula: break;
    case TestField::Kind::elastic:
      return {detail::sum_of(field.sines[0], rest), detail::sum_of(field.sines[1], rest),
              detail::sum_of(field.sines[2], rest)};
    case TestField::Kind::noise: {
      const std::uint64_t first = 3 * detail::number_of(rest);
      return {field.amplitude * detail::uniform(first), field.amplitude * detail::uniform(first + 1),
              field.amplitude * detail::uniform(first + 2)};
    }
    case TestField::Kind::rotation: return {-field.amplitude * y - x, field.amplitude * x - y, 0};
    case TestField::Kind::folds: return {field.amplitude * std::sin(field.radians_per_voxel * x), 0, 0};
  }
  return displacement_at(field.formula, rest);
}

}  // namespace tetwarp::bench
