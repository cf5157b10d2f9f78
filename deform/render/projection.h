// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

namespace tetwarp {

/// How the samples of a ray become a pixel.
enum class Projection : std::uint8_t {
  composite,  ///< emission and absorption, front to back (Levoy 1988; Max 1995)
  maximum,    ///< the largest sample
  sum         ///< the integral of a density, as in an X-ray picture
};

}  // namespace tetwarp
