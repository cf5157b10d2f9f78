// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_bench.h"
#include "bench/paper/backend.h"
#include "bench/simulate/simulate_bench.h"

namespace tetwarp::bench {

namespace {

[[noreturn]] void not_compiled() { throw NotCompiled("CUDA is not in this build; use --backend cpu"); }

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(int) { not_compiled(); }

CudaFacts describe_cuda(int) { not_compiled(); }

GpuResults measure_gpu(const GpuOptions&, const std::function<void(const std::string&)>&) { not_compiled(); }

std::unique_ptr<FrameVolumes> make_device_volumes(const Volume<std::int16_t>&, double) { not_compiled(); }

}  // namespace tetwarp::bench
