// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_fields.h"

#include <algorithm>
#include <iterator>

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kElasticAmplitude = 6, kNoiseAmplitude = 0.2f;
constexpr float kFoldsAmplitude = 16, kFoldsWavelength = 64;
constexpr double kLocalFraction = 0.08;

struct SineShape {
  double direction[3], wavelength, share;  // of the amplitude
  float phase;
};

// Shares fall with the wavelength. The slopes of a component add up to at most 2 pi * 6 * (1/200 + 1/210 + 1/252) =
// 0.52 voxel a voxel, the three together to less than 0.9.
constexpr SineShape kElastic[3][kSines] = {
    {{{2, -3, 5}, 120, 3.0 / 6, 0.3f}, {{-4, 1, 3}, 75, 2.0 / 6, 1.9f}, {{3, 7, -2}, 40, 1.0 / 6, 4.1f}},
    {{{5, 2, -3}, 110, 3.0 / 6, 2.2f}, {{1, -6, 4}, 80, 2.0 / 6, 5.0f}, {{-7, 3, 4}, 45, 1.0 / 6, 0.8f}},
    {{{-3, 4, 2}, 100, 3.0 / 6, 3.7f}, {{6, 5, 1}, 70, 2.0 / 6, 1.1f}, {{2, -5, 7}, 42, 1.0 / 6, 5.6f}},
};

Sine make_sine(const SineShape& shape, float amplitude) {
  const double* d = shape.direction;
  const double scale = 2 * kPi / (shape.wavelength * std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
  return {glm::vec3(glm::dvec3(d[0], d[1], d[2]) * scale), static_cast<float>(shape.share * amplitude), shape.phase};
}

/// Radius of a ball with a fraction of the volume's voxels.
double radius_of(double fraction, const glm::i64vec3& size) {
  const double voxels = static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z);
  return std::cbrt(fraction * voxels * 3 / (4 * kPi));
}

}  // namespace

TestField make_elastic(float amplitude) {
  TestField field;
  field.kind = TestField::Kind::elastic;
  for (int component = 0; component < 3; ++component) {
    for (int n = 0; n < kSines; ++n) field.sines[component][n] = make_sine(kElastic[component][n], amplitude);
  }
  return field;
}

TestField make_test_field(const std::string& name, const glm::i64vec3& size) {
  if (name == "elastic") return make_elastic(kElasticAmplitude);
  TestField field;
  field.formula = make_formula("identity", size);
  if (name == "noise") {
    field.kind = TestField::Kind::noise;
    field.amplitude = kNoiseAmplitude;
  } else if (name == "rotation") {
    field.kind = TestField::Kind::rotation;
    field.amplitude = 1;
  } else if (name == "folds") {
    field.kind = TestField::Kind::folds;
    field.amplitude = kFoldsAmplitude;
    field.radians_per_voxel = static_cast<float>(2 * kPi / kFoldsWavelength);
  } else if (name == "local") {
    field.formula = make_formula("bubble", size);
    field.formula.radius = static_cast<float>(radius_of(kLocalFraction, size));
  } else {
    field.formula = make_formula(name, size);
  }
  return field;
}

std::optional<TestField> inverse_of(TestField field) {
  if (field.kind == TestField::Kind::rotation) {
    field.amplitude = -field.amplitude;
    return field;
  }
  if (field.kind != TestField::Kind::formula || field.formula.kind == Formula::Kind::bubble) return {};
  if (field.formula.kind == Formula::Kind::wave) field.formula.amplitude = -field.formula.amplitude;
  if (field.formula.kind == Formula::Kind::twist) field.formula.radians_per_voxel = -field.formula.radians_per_voxel;
  return field;
}

}  // namespace tetwarp::bench
