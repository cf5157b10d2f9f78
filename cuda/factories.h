// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "deform/adjoint.h"
#include "deform/render/renderer.h"
#include "deform/resampler.h"
#include "deform/simulate/simulation.h"

// What backend/factories.h makes on a CUDA device. A build without CUDA defines it in backend/not_compiled.cpp. All
// throw DeviceError without the device.
namespace tetwarp {

/// A resampler of forward fields.
std::unique_ptr<ForwardResampler> make_cuda_resampler(const Geometry& output, int device, const Limits& limits);
/// A resampler of pull fields.
std::unique_ptr<PullResampler> make_cuda_pull_resampler(const Geometry& output, int device, const Limits& limits);
/// The transpose and the gradients of forward fields.
std::unique_ptr<ResampleAdjoint> make_cuda_adjoint(const Geometry& output, int device, const Limits& limits);
/// A renderer.
std::unique_ptr<Renderer> make_cuda_renderer(int device, const Limits& limits);

namespace simulate {

/// ChainMail.
std::unique_ptr<Simulation> make_cuda_chainmail(const Model& model, int device);
/// Mass-spring.
std::unique_ptr<Simulation> make_cuda_mass_spring(const Model& model, int device);
/// A copy of displacements.
std::unique_ptr<DisplacementCopy> make_cuda_displacement_copy(int device);

}  // namespace simulate

}  // namespace tetwarp
