#include "cuda/devices.h"
#include "deform/resampler.h"

namespace tetwarp {

namespace {

[[noreturn]] void not_compiled() {
  throw NotCompiled("CUDA is not in this build; use --backend cpu, the bits are the same");
}

}  // namespace

bool has_cuda() { return false; }

int cuda_device_count() { return 0; }

void wake_cuda_device(int) {}

std::string describe_cuda_device(int) { not_compiled(); }

std::unique_ptr<Resampler> make_cuda_resampler(Geometry, int, Limits) { not_compiled(); }

std::unique_ptr<Resampler> make_cuda_pull_resampler(Geometry, int, Limits) { not_compiled(); }

}  // namespace tetwarp
