// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

namespace tetwarp {

struct SinCos {
  double sin, cos;
};

/// Sine and cosine of an angle in radians: additions and multiplications only, so the same bits on every machine, which
/// the C library's are not. Error below 2 units in the last place for |angle| < 1e5.
SinCos sin_cos(double angle);

}  // namespace tetwarp
