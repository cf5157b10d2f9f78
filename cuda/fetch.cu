#include "cuda/fetch.h"

#include "cuda/check.h"

namespace tetwarp {

void fetch_from_cuda(std::span<glm::vec3> to, const glm::vec3* from) {
  TETWARP_CUDA_TRY(cudaMemcpy(to.data(), from, to.size_bytes(), cudaMemcpyDeviceToHost));
}

}  // namespace tetwarp
