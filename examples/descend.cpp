// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Finds a field by gradient descent: which displacements of a lattice take one volume onto another one. The answer is
// known, for the other volume was made by a field of the same kind.
#include <cmath>
#include <cstdio>

#include "deform/adjoint.h"
#include "deform/fields/formula.h"
#include "deform/phantom.h"

namespace {

using namespace tetwarp;

/// Adam (Kingma and Ba 2015, algorithm 1), for one vector a vertex.
class Adam {
 public:
  explicit Adam(std::size_t vertices) : mean_(vertices), square_(vertices) {}

  void step(float rate, const std::vector<glm::vec3>& gradient, std::vector<glm::vec3>& values) {
    constexpr float kMean = 0.9f, kSquare = 0.999f, kTiny = 1e-8f;
    ++steps_;
    const float of_mean = 1 - std::pow(kMean, steps_), of_square = 1 - std::pow(kSquare, steps_);
    for (std::size_t n = 0; n < values.size(); ++n) {
      for (int axis = 0; axis < 3; ++axis) {
        const float g = gradient[n][axis];
        float &mean = mean_[n][axis], &square = square_[n][axis];
        mean = kMean * mean + (1 - kMean) * g;
        square = kSquare * square + (1 - kSquare) * g * g;
        values[n][axis] -= rate * (mean / of_mean) / (std::sqrt(square / of_square) + kTiny);
      }
    }
  }

 private:
  std::vector<glm::vec3> mean_, square_;
  float steps_ = 0;
};

}  // namespace

int main() {
  const Volume<std::int16_t> ct = make_phantom({64, 64, 48}, {6, 6, 6}, /*seed=*/1);
  const Volume<float> moving{ct.geometry, {ct.voxels.begin(), ct.voxels.end()}};
  const auto resampler = make_cpu_resampler(ct.geometry);
  const auto adjoint = make_cpu_adjoint(ct.geometry);

  const Volume<float> fixed = resample(*resampler, moving, twist(ct.geometry, /*angle=*/0.15, /*cell_size=*/8));

  VertexField field = twist(ct.geometry, /*angle=*/0, /*cell_size=*/8);  // the identity
  Adam adam(field.displacement.size());
  Volume<float> deformed = moving, error = moving;
  const auto voxels = static_cast<double>(error.voxels.size());
  std::vector<glm::vec3> slope(field.displacement.size());
  constexpr int kIterations = 120;
  for (int iteration = 0; iteration <= kIterations; ++iteration) {
    resampler->set_field(view(field, Outside::background));
    const Target target{.source = view(moving), .output = view(deformed), .background = -1000};
    resampler->resample(whole(ct.geometry), {&target, 1});
    double sum = 0;
    for (std::size_t n = 0; n < error.voxels.size(); ++n) {
      error.voxels[n] = deformed.voxels[n] - fixed.voxels[n];  // half of d(error^2)/d(deformed)
      sum += static_cast<double>(error.voxels[n]) * static_cast<double>(error.voxels[n]);
    }
    if (iteration % 20 == 0) std::printf("iteration %3d: mean squared difference %.0f\n", iteration, sum / voxels);
    adjoint->set_field(view(field, Outside::background));
    const AdjointTarget differentiated{.source = view(moving), .output_gradient = view(error)};
    adjoint->apply({&differentiated, 1}, {slope});
    const float rate = 1.5f * static_cast<float>(kIterations - iteration) / kIterations;  // mm, falling to 0
    adam.step(rate, slope, field.displacement);
  }
  return 0;
}
