// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Deforms a phantom on the device and on the CPU; where there is no device, expects the error that says so.
#include <cstdio>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/fields/formula.h"
#include "deform/phantom.h"
#include "deform/resampler.h"

int main() {
  using namespace tetwarp;
  if (has_cuda() != (WITH_CUDA == 1)) {
    std::printf("the package says CUDA: %d, the library: %d\n", WITH_CUDA, has_cuda());
    return 1;
  }
  const Volume<std::int16_t> ct = make_phantom({32, 32, 24}, {8, 8, 8}, /*seed=*/1);
  const VertexField field = twist(ct.geometry, /*angle=*/0.5, /*cell_size=*/4);
  try {
    const auto on_device = make_forward_resampler(BackendKind::cuda, ct.geometry);
    const auto on_cpu = make_cpu_resampler(ct.geometry);
    const bool equal = resample(*on_device, ct, field).voxels == resample(*on_cpu, ct, field).voxels;
    std::printf("device and CPU give %s voxels\n", equal ? "the same" : "other");
    return equal ? 0 : 1;
  } catch (const NotCompiled& error) {
    std::printf("%s\n", error.what());
    return WITH_CUDA ? 1 : 0;
  } catch (const DeviceError& error) {
    std::printf("%s\n", error.what());
    return WITH_CUDA && device_count() == 0 ? 0 : 1;
  }
}
