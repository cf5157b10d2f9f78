#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "deform/core/host_device.h"

namespace tetwarp::bench {

/// A test deformation in float, as a thread of the paper's kernels evaluates it (Eqs. 14-16; amplitudes and origin as
/// the program's own formulas have them). Everything in voxels and radians, about the middle of the volume.
struct Formula {
  enum class Kind : std::uint8_t { identity, wave, twist, bubble };

  Kind kind = Kind::identity;
  glm::vec3 centre{0};
  float amplitude = 0, radians_per_voxel = 0;  ///< wave: along z; twist: the second alone
  float radius = 0, strength = 0;              ///< bubble
};

/// The formula `name` (identity, wave, twist, bubble) for a volume: amplitude 1/32, wavelength and radius 1/4 of the
/// columns, 0.5 rad from the centre to either end, strength 0.3. @throws InputError for another name
Formula make_formula(const std::string& name, const glm::i64vec3& size);

/// The same in the words of the command line, for a volume with a spacing of 1 mm.
std::string formula_text(const std::string& name, const glm::i64vec3& size);

namespace detail {

/// a * b and a + b, each rounded. Spelled out so that no compiler fuses one of them with what comes next: the field
/// that a kernel evaluates and the one that it reads from memory are then the same to the bit.
TETWARP_HD inline float times(float a, float b) {
#ifdef __CUDA_ARCH__
  return __fmul_rn(a, b);
#else
  return a * b;
#endif
}
TETWARP_HD inline float plus(float a, float b) {
#ifdef __CUDA_ARCH__
  return __fadd_rn(a, b);
#else
  return a + b;
#endif
}

}  // namespace detail

/// Deformed place of a vertex that rests at `rest`: never fused with what made the displacement.
TETWARP_HD inline glm::vec3 deformed_place(const glm::vec3& rest, const glm::vec3& displacement) {
  return {detail::plus(rest.x, displacement.x), detail::plus(rest.y, displacement.y),
          detail::plus(rest.z, displacement.z)};
}

/// Displacement (voxels, deformed minus rest) of a vertex that rests at `rest` (continuous index of the volume).
TETWARP_HD inline glm::vec3 displacement_at(const Formula& formula, const glm::vec3& rest) {
  using detail::plus, detail::times;
  const float x = plus(rest.x, -formula.centre.x), y = plus(rest.y, -formula.centre.y),
              z = plus(rest.z, -formula.centre.z);
  switch (formula.kind) {
    case Formula::Kind::identity: break;
    case Formula::Kind::wave: return {times(formula.amplitude, std::sin(times(formula.radians_per_voxel, z))), 0, 0};
    case Formula::Kind::twist: {
      const float angle = times(formula.radians_per_voxel, z);
      float sine, cosine;
      ::sincosf(angle, &sine, &cosine);
      return {plus(plus(times(x, cosine), -times(y, sine)), -x), plus(plus(times(x, sine), times(y, cosine)), -y), 0};
    }
    case Formula::Kind::bubble: {
      const float r = std::sqrt(plus(plus(times(x, x), times(y, y)), times(z, z)));
      if (r >= formula.radius) break;
      const float inwards = plus(1.0f, -(r / formula.radius));
      const float scale = times(formula.strength, times(inwards, inwards));
      return {times(scale, x), times(scale, y), times(scale, z)};
    }
  }
  return {0, 0, 0};
}

}  // namespace tetwarp::bench
