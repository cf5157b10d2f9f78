// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What stands in the place of cuda/ in a build without it.
#include "cuda/devices.h"
#include "cuda/factories.h"

namespace tetwarp {

namespace {

[[noreturn]] void not_compiled() {
  throw NotCompiled("CUDA is not in this build; use --backend cpu, the bits are the same");
}

}  // namespace

bool is_cuda_compiled() { return false; }

int cuda_device_count() { return 0; }

void wake_cuda_device(int) {}

std::string describe_cuda_device(int) { not_compiled(); }

void* create_cuda_stream(int, bool) { not_compiled(); }

void wait_for_cuda_stream(void*) { not_compiled(); }

void destroy_cuda_stream(void*) {}

void* allocate_pinned(std::size_t) { not_compiled(); }

void free_pinned(void*) {}

void* allocate_on_device(int, std::size_t) { not_compiled(); }

void free_on_device(void*) {}

void copy_to_device(void*, const void*, std::size_t) { not_compiled(); }

std::unique_ptr<ForwardResampler> make_cuda_resampler(const Geometry&, int, const Limits&) { not_compiled(); }

std::unique_ptr<PullResampler> make_cuda_pull_resampler(const Geometry&, int, const Limits&) { not_compiled(); }

std::unique_ptr<ResampleAdjoint> make_cuda_adjoint(const Geometry&, int, const Limits&) { not_compiled(); }

std::unique_ptr<Renderer> make_cuda_renderer(int, const Limits&) { not_compiled(); }

namespace simulate {

std::unique_ptr<Simulation> make_cuda_mass_spring(const Model&, int) { not_compiled(); }

std::unique_ptr<Simulation> make_cuda_chainmail(const Model&, int) { not_compiled(); }

std::unique_ptr<DisplacementCopy> make_cuda_displacement_copy(int) { not_compiled(); }

}  // namespace simulate

}  // namespace tetwarp
