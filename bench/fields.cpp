#include "bench/fields.h"

#include <charconv>

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;
constexpr double kTwistRadians = 0.5, kTwistDegrees = 28.64788975654116;
constexpr double kBubbleStrength = 0.3;

double amplitude(const glm::i64vec3& size) { return static_cast<double>(size.x) / 32; }
double wavelength(const glm::i64vec3& size) { return static_cast<double>(size.x) / 4; }
double radius(const glm::i64vec3& size) { return static_cast<double>(size.x) / 4; }

std::string text(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

}  // namespace

Formula make_formula(const std::string& name, const glm::i64vec3& size) {
  const glm::dvec3 centre = glm::dvec3(size - std::int64_t{1}) * 0.5;
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
    require(name == "identity", "no field \"" + name + "\"; choose from identity, wave, twist, bubble");
  }
  return formula;
}

std::string formula_text(const std::string& name, const glm::i64vec3& size) {
  if (name == "wave") return "wave:amplitude=" + text(amplitude(size)) + ",wavelength=" + text(wavelength(size));
  if (name == "twist") return "twist:angle=" + text(kTwistDegrees);
  if (name == "bubble") return "bubble:radius=" + text(radius(size)) + ",strength=" + text(kBubbleStrength);
  return name;
}

}  // namespace tetwarp::bench
