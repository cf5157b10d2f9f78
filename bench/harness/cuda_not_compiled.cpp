// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_parts.h"
#include "bench/paper/backend.h"
#include "bench/simulate/simulate.h"

namespace tetwarp::bench {

namespace {

[[noreturn]] void not_compiled() { throw NotCompiled("CUDA is not in this build; use --backend cpu"); }

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(int) { not_compiled(); }
CudaFacts describe_cuda(int) { not_compiled(); }
Samples measure_copies(const Geometry&, const Options&) { not_compiled(); }
std::unique_ptr<GpuMethods> make_gpu_methods(const Volume<std::int16_t>&, const Options&) { not_compiled(); }
FrameLoop measure_frame_loop(const Volume<std::int16_t>&, std::int64_t, const Options&) { not_compiled(); }
MemoryUse measure_memory(const Volume<std::int16_t>&, const std::string&, const Options&) { not_compiled(); }
FrameVolumes make_device_volumes(const Volume<std::int16_t>&, double) { not_compiled(); }

}  // namespace tetwarp::bench
