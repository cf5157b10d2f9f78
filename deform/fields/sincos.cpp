// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/sincos.h"

#include <cmath>
#include <initializer_list>

namespace tetwarp {

namespace {

// Pi / 2 in three parts (Cody and Waite 1980). The first two have 33 bits each, so their products with whole numbers up
// to 2^20 are exact.
constexpr double kHalfPi1 = 0x1.921fb544p+0, kHalfPi2 = 0x1.0b4611a6p-34, kHalfPi3 = 0x1.3198a2e037073p-69;
constexpr double kTwoOverPi = 0x1.45f306dc9c883p-1;

/// Sine by its Taylor series, for |r| <= pi / 4: the first term left out is below 1e-19.
double sine_near_zero(double r) {
  const double x = r * r;
  double sum = 1.0 / 355687428096000.0;
  for (const double term : {-1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0, 1.0 / 362880.0,
                            -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0}) {
    sum = sum * x + term;
  }
  return r + r * (x * sum);
}

double cosine_near_zero(double r) {
  const double x = r * r;
  double sum = -1.0 / 6402373705728000.0;
  for (const double term : {1.0 / 20922789888000.0, -1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0,
                            1.0 / 40320.0, -1.0 / 720.0, 1.0 / 24.0}) {
    sum = sum * x + term;
  }
  return (1.0 - 0.5 * x) + x * (x * sum);
}

}  // namespace

SinCos sin_cos(double angle) {
  const double quarter = std::nearbyint(angle * kTwoOverPi);
  const double high = (angle - quarter * kHalfPi1) - quarter * kHalfPi2;
  // What the second subtraction rounded away, and the third part of pi / 2, are kept beside r.
  const double lost = ((angle - quarter * kHalfPi1) - high) - quarter * kHalfPi2 - quarter * kHalfPi3;
  const double r = high + lost, low = (high - r) + lost;
  const double near_sine = sine_near_zero(r), near_cosine = cosine_near_zero(r);
  const double s = near_sine + low * near_cosine, c = near_cosine - low * near_sine;
  switch (static_cast<int>(quarter - 4 * std::floor(quarter / 4))) {  // exact for a number of any size
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

}  // namespace tetwarp
