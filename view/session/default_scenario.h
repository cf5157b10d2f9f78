// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/scenario.h"

namespace tetwarp::viewer {

/// What a hand works on where no scenario says it: four tissues of a CT by their HU, ChainMail, the border of the
/// volume held, and few steps a frame, so that tissue follows the hand at once. Cells have at least 8 voxels along an
/// axis, and so many that a frame is simulated in time.
/// @param volume      what it works on
/// @param has_device  whether a device simulates, for which there may be more cells
simulate::Scenario default_scenario(const Geometry& volume, bool has_device);

}  // namespace tetwarp::viewer
