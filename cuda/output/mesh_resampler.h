// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "deform/resampler.h"

namespace tetwarp::cuda_detail {

/// A resampler of forward fields that are meshes, on a CUDA device.
/// @throws InputError for an output that no resampler takes
/// @throws DeviceError without the device
std::unique_ptr<ForwardResampler> make_mesh_resampler(const Geometry& output, int device, const Limits& limits);

}  // namespace tetwarp::cuda_detail
