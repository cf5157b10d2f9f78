// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "deform/resampler.h"

namespace tetwarp::cpu {

/// A resampler of forward fields that are meshes, on the CPU.
/// @throws InputError as `make_cpu_resampler`
std::unique_ptr<ForwardResampler> make_mesh_resampler(const Geometry& output, const Limits& limits);

}  // namespace tetwarp::cpu
