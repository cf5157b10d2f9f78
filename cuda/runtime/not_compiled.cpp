// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/devices.h"
#include "deform/render/renderer.h"
#include "deform/resampler.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"

namespace tetwarp {

namespace {

[[noreturn]] void not_compiled() {
  throw NotCompiled("CUDA is not in this build; use --backend cpu, the bits are the same");
}

}  // namespace

bool has_cuda() { return false; }

int cuda_device_count() { return 0; }

void wake_cuda_device(int) {}

DeviceStream::DeviceStream(int) { not_compiled(); }

DeviceStream::~DeviceStream() = default;

std::string describe_cuda_device(int) { not_compiled(); }

std::unique_ptr<Resampler> make_cuda_resampler(Geometry, int, Limits) { not_compiled(); }

std::unique_ptr<Resampler> make_cuda_pull_resampler(Geometry, int, Limits) { not_compiled(); }

std::unique_ptr<Renderer> make_cuda_renderer(int, Limits) { not_compiled(); }

namespace simulate {

std::unique_ptr<Simulation> make_cuda_mass_spring(const Model&, const MassSpringOptions&, int) {
  throw NotCompiled("CUDA is not in this build; use --backend cpu, the methods agree to rounding");
}

std::unique_ptr<Simulation> make_cuda_chainmail(const Model&, int) { not_compiled(); }

}  // namespace simulate

}  // namespace tetwarp
