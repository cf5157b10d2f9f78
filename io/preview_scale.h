// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>

#include "deform/volume.h"
#include "io/png.h"

namespace tetwarp {

/// Values from level - width / 2 to level + width / 2 go from black to white (DICOM PS3.3 C.11.2.1.2, linear exact).
struct Window {
  double width = 1, level = 0;
  bool hounsfield = false;  ///< the values look like HU

  Colour operator()(double value) const;
};

/// Width 1500, level -200 where values look like HU (signed, air among them); otherwise from the 1st to the 99th
/// percentile.
Window choose_window(std::span<const double> values, VoxelType type);

/// Colours of a difference: black where there is none, over blue to light blue where it fell, over red to yellow where
/// it rose; saturated at +-range.
struct DifferenceScale {
  double range = 1;
  bool none = false;  ///< nothing differs

  Colour operator()(double difference) const;
};

/// The 98th percentile of what differs, rounded up to 1, 2 or 5 times a power of ten; for HU at most 1000, the step
/// from air to tissue, so that padding does not decide.
DifferenceScale choose_difference_scale(std::span<const double> differences, bool hounsfield);

/// The largest 1, 2 or 5 times a power of ten that is not above `value` > 0; or the smallest not below it.
double round_down_125(double value);
double round_up_125(double value);

/// Of pixels that are no number.
constexpr Colour kNotANumber = {96, 0, 128};

/// The number as short as it can be read: "1500", "0.25", "-1e-05".
std::string short_number(double value);

}  // namespace tetwarp
