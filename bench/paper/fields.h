// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "deform/core/host_device.h"

namespace tetwarp::bench {

/// A test deformation in float, as a thread of the paper's kernels evaluates it. Everything in voxels and radians,
/// about the middle of the volume.
struct Formula {
  enum class Kind : std::uint8_t { identity, wave, twist, bubble, shift };

  Kind kind = Kind::identity;
  glm::vec3 centre{0};
  float amplitude = 0, radians_per_voxel = 0;  ///< wave, along z: both; twist: the second alone; shift: the first alone
  float radius = 0, strength = 0;              ///< bubble
};

/// One of the paper's Eqs. 14 to 16 as it is printed, at t = pi / 2, p in voxels, times an amplitude that is ours: the
/// paper gives none.
struct FieldAsWritten {
  const char* name;       ///< of the field here
  const char* transform;  ///< wave, twist or bubble: the paper's word for it
  double amplitude;       ///< the longest way that a vertex goes (Twist: in the middle of a side), voxels
};
/// wave-paper-1 and -16, twist-paper-1 and -16, bubble-paper-1 and -16.
const std::vector<FieldAsWritten>& fields_as_written();
/// None for a field of another kind.
std::optional<FieldAsWritten> as_written(const std::string& name);

/// The formula `name` for a volume:
///
/// | name | what it is |
/// | --- | --- |
/// | identity | |
/// | wave | amplitude 1/32, wavelength 1/4 of the columns |
/// | twist | 0.5 rad from the centre to either end |
/// | bubble | radius 1/4 of the columns, strength 0.3 |
/// | wave-paper-A | Eq. 14: p' = p + A sin(p.z + t) x, so one radian a voxel |
/// | twist-paper-A | Eq. 15: p - c turned about z by theta = s A sin t (p - c).z |
/// | bubble-paper-A | Eq. 16: p' = (1 + A sin t / abs(p - c)) (p - c) + c, and c stays |
///
/// The paper's Eq. 15 has no s. In voxels that is one radian a slice, which puts the corners of a cell hundreds of
/// voxels apart, so it cannot be what was timed. Here s is such that a vertex in the middle of a side of the first and
/// the last slice goes A voxels along its arc.
///
/// @throws InputError for another name
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
    case Formula::Kind::shift: {
      const float r = std::sqrt(plus(plus(times(x, x), times(y, y)), times(z, z)));
      if (r == 0) break;
      const float scale = formula.amplitude / r;
      return {times(scale, x), times(scale, y), times(scale, z)};
    }
  }
  return {0, 0, 0};
}

}  // namespace tetwarp::bench
