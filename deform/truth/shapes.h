// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>

namespace tetwarp::truth {

// Functions of which fields are made. They use + - * / alone, so they have the same bits on every machine.

/// Rises smoothly from 0 at t = 0 to 1 at t = 1: 3 t^2 - 2 t^3, whose slope is at most 1.5.
inline double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A hill of height 1 at t = 0 that is 0 from |t| = 1 on: (1 - t^2)^2, whose slope is at most 1.54.
inline double hill(double t) {
  const double s = std::max(1 - t * t, 0.0);
  return s * s;
}

/// The cube root of a number above 0: steps of Newton from a power of two.
inline double cube_root(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  double root = std::ldexp(1.0, exponent / 3 + 1);
  for (int n = 0; n < 60; ++n) {
    const double next = (2 * root + x / (root * root)) / 3;
    if (next == root) break;
    root = next;
  }
  return root;
}

}  // namespace tetwarp::truth
