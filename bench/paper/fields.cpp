// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/fields.h"

#include <charconv>
#include <cmath>

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;
constexpr double kTwistRadians = 0.5, kTwistDegrees = 28.64788975654116;
constexpr double kBubbleStrength = 0.3;

double amplitude(const glm::i64vec3& size) { return static_cast<double>(size.x) / 32; }
double wavelength(const glm::i64vec3& size) { return static_cast<double>(size.x) / 4; }
double radius(const glm::i64vec3& size) { return static_cast<double>(size.x) / 4; }

/// sin(z + kTime) is that of a wave about z = -kTime; sin(kTime) is 1.
constexpr double kTime = kTwoPi / 4;

/// Radians from the centre to either end that move a vertex in the middle of a side by so many voxels, along the arc.
double turn_to_end(double amplitude, const glm::dvec3& centre) { return amplitude / centre.x; }

std::string text(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

glm::dvec3 centre_of(const glm::i64vec3& size) { return glm::dvec3(size - std::int64_t{1}) * 0.5; }

Formula make_as_written(const FieldAsWritten& field, const glm::dvec3& centre) {
  const std::string transform = field.transform;
  Formula formula{.centre = glm::vec3(centre)};
  if (transform == "wave") {
    formula.kind = Formula::Kind::wave;
    formula.amplitude = static_cast<float>(field.amplitude);
    formula.radians_per_voxel = 1;
    formula.centre.z = static_cast<float>(-kTime);
  } else if (transform == "twist") {
    formula.kind = Formula::Kind::twist;
    formula.radians_per_voxel = static_cast<float>(turn_to_end(field.amplitude, centre) / centre.z);
  } else {
    formula.kind = Formula::Kind::shift;
    formula.amplitude = static_cast<float>(field.amplitude);
  }
  return formula;
}

std::string text_as_written(const FieldAsWritten& field, const glm::dvec3& centre) {
  const std::string transform = field.transform;
  if (transform == "wave") {  // the program's wave counts z from the centre
    const double phase = std::fmod(centre.z + kTime, kTwoPi) * (360 / kTwoPi);
    return "wave:amplitude=" + text(field.amplitude) + ",wavelength=" + text(kTwoPi) + ",phase=" + text(phase);
  }
  if (transform == "twist") return "twist:angle=" + text(turn_to_end(field.amplitude, centre) * (360 / kTwoPi));
  return "bubble-paper:shift=" + text(field.amplitude);
}

}  // namespace

const std::vector<FieldAsWritten>& fields_as_written() {
  static const std::vector<FieldAsWritten> kFields{{"wave-paper-1", "wave", 1},     {"wave-paper-16", "wave", 16},
                                                   {"twist-paper-1", "twist", 1},   {"twist-paper-16", "twist", 16},
                                                   {"bubble-paper-1", "bubble", 1}, {"bubble-paper-16", "bubble", 16}};
  return kFields;
}

std::optional<FieldAsWritten> as_written(const std::string& name) {
  for (const FieldAsWritten& field : fields_as_written()) {
    if (name == field.name) return field;
  }
  return {};
}

Formula make_formula(const std::string& name, const glm::i64vec3& size) {
  const glm::dvec3 centre = centre_of(size);
  if (const auto field = as_written(name)) return make_as_written(*field, centre);
  Formula formula{.kind = Formula::Kind::identity, .centre = glm::vec3(centre)};
  if (name == "wave") {
    formula.kind = Formula::Kind::wave;
    formula.amplitude = static_cast<float>(amplitude(size));
    formula.radians_per_voxel = static_cast<float>(kTwoPi / wavelength(size));
  } else if (name == "twist") {
    formula.kind = Formula::Kind::twist;
    formula.radians_per_voxel = static_cast<float>(kTwistRadians / centre.z);
  } else if (name == "bubble") {
    formula.kind = Formula::Kind::bubble;
    formula.radius = static_cast<float>(radius(size));
    formula.strength = static_cast<float>(kBubbleStrength);
  } else {
    require(name == "identity",
            "no field \"" + name + "\"; choose from identity, wave, twist, bubble, {wave,twist,bubble}-paper-{1,16}");
  }
  return formula;
}

std::string formula_text(const std::string& name, const glm::i64vec3& size) {
  if (const auto field = as_written(name)) return text_as_written(*field, centre_of(size));
  if (name == "wave") return "wave:amplitude=" + text(amplitude(size)) + ",wavelength=" + text(wavelength(size));
  if (name == "twist") return "twist:angle=" + text(kTwistDegrees);
  if (name == "bubble") return "bubble:radius=" + text(radius(size)) + ",strength=" + text(kBubbleStrength);
  return name;
}

}  // namespace tetwarp::bench
