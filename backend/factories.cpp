// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/factories.h"

#include "cuda/factories.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"

namespace tetwarp {

std::unique_ptr<ForwardResampler> make_forward_resampler(BackendKind backend, const Geometry& output, int device,
                                                         const Limits& limits) {
  if (backend == BackendKind::cuda) return make_cuda_resampler(output, device, limits);
  return make_cpu_resampler(output, limits);
}

std::unique_ptr<PullResampler> make_pull_resampler(BackendKind backend, const Geometry& output, int device,
                                                   const Limits& limits) {
  if (backend == BackendKind::cuda) return make_cuda_pull_resampler(output, device, limits);
  return make_cpu_pull_resampler(output, limits);
}

std::unique_ptr<ResampleAdjoint> make_adjoint(BackendKind backend, const Geometry& output, int device,
                                              const Limits& limits) {
  if (backend == BackendKind::cuda) return make_cuda_adjoint(output, device, limits);
  return make_cpu_adjoint(output, limits);
}

AnyResampler::AnyResampler(BackendKind backend, Direction direction, const Geometry& output, int device,
                           const Limits& limits)
    : backend_(backend) {
  if (direction == Direction::pull) {
    held_ = make_pull_resampler(backend, output, device, limits);
  } else {
    held_ = make_forward_resampler(backend, output, device, limits);
  }
}

std::unique_ptr<Renderer> make_renderer(BackendKind backend, int device, const Limits& limits) {
  if (backend == BackendKind::cuda) return make_cuda_renderer(device, limits);
  return make_cpu_renderer(limits);
}

namespace simulate {

namespace {

class HostCopy final : public DisplacementCopy {
 public:
  void take(std::span<const glm::vec3> displacement, void*) override {
    values_.assign(displacement.begin(), displacement.end());
  }
  std::span<glm::vec3> values() override { return values_; }
  Memory memory() const override { return Memory::host; }
  std::vector<glm::vec3> on_host() const override { return values_; }

 private:
  std::vector<glm::vec3> values_;
};

}  // namespace

std::unique_ptr<Simulation> make_simulation(BackendKind backend, Method method, const Model& model, int device,
                                            const Limits& limits) {
  const bool chainmail = method == Method::chainmail;
  if (backend == BackendKind::cuda)
    return chainmail ? make_cuda_chainmail(model, device) : make_cuda_mass_spring(model, device);
  return chainmail ? make_cpu_chainmail(model, limits) : make_cpu_mass_spring(model, limits);
}

std::unique_ptr<DisplacementCopy> make_displacement_copy(BackendKind backend, int device) {
  if (backend == BackendKind::cuda) return make_cuda_displacement_copy(device);
  return std::make_unique<HostCopy>();
}

}  // namespace simulate

}  // namespace tetwarp
