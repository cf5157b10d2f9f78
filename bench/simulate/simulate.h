// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "deform/resampler.h"

namespace tetwarp::bench {

/// Source and output of a frame loop, where its backend works.
struct FrameVolumes {
  Target target;
  std::shared_ptr<const void> memory;  ///< of the target
};
/// On a CUDA device. @throws NotCompiled, DeviceError
FrameVolumes make_device_volumes(const Volume<std::int16_t>& volume, double background);

}  // namespace tetwarp::bench
