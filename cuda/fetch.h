#pragma once

#include <span>

#include "deform/core/host_device.h"

namespace tetwarp {

/// Copies vectors from a CUDA device, whichever holds them, to the host. @throws DeviceError, NotCompiled
void fetch_from_cuda(std::span<glm::vec3> to, const glm::vec3* from);

}  // namespace tetwarp
