// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The baselines as kernels: one thread a cell, or (gascon) one block a tetrahedron.
#include <cuda_runtime.h>

#include "bench/paper/backend.h"
#include "bench/paper/baselines.h"
#include "cuda/runtime/check.h"

namespace tetwarp::bench {

constexpr unsigned kThreads = 256;

/// The texture unit: linear, clamped, int16 read as -1 to 1; voxel centres lie at half texels.
struct HardwareTexture {
  cudaTextureObject_t object;

  TETWARP_HD float operator()(float x, float y, float z) const {
#ifdef __CUDA_ARCH__
    return tex3D<float>(object, x + 0.5f, y + 0.5f, z + 0.5f) * 32767.0f;
#else
    return 0 * (x + y + z);  // the host has no texture unit: the shared body must compile there, nobody runs it
#endif
  }
};

/// setValue of the paper. A voxel may be written by several threads; the last one wins. Counting is done by the same
/// kernel, not by a twin of it that the compiler might round in another order.
struct SetValue {
  std::int16_t* output;
  unsigned* writes;  ///< null where time is taken
  Grid grid;

  template <class Real>
  TETWARP_HD void operator()(int x, int y, int z, Real value) const {
    const std::int64_t n = grid.offset(x, y, z);
    output[n] = to_short(value);
#ifdef __CUDA_ARCH__
    if (writes) atomicAdd(&writes[n], 1u);
#endif
  }
};

/// One thread a cell.
template <class M, InverseIn kWhen, class Field>
__global__ void __launch_bounds__(kThreads)
    cell_kernel(Grid grid, Field field, HardwareTexture texture, SetValue write) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
            j = static_cast<int>(blockIdx.y * blockDim.y + threadIdx.y),
            k = static_cast<int>(blockIdx.z * blockDim.z + threadIdx.z);
  if (i + 1 >= grid.vertices_x || j + 1 >= grid.vertices_y || k + 1 >= grid.vertices_z) return;
  deform_cell<M, kWhen>(grid, i, j, k, field, texture, write);
}

constexpr unsigned kThreadsOfTetrahedron = 128;

/// One block a tetrahedron.
template <class Field>
__global__ void __launch_bounds__(kThreadsOfTetrahedron)
    gascon_kernel(Grid grid, Field field, HardwareTexture texture, SetValue write) {
  __shared__ CellVertex corners[4];
  const int cells_x = grid.vertices_x - 1, cells_y = grid.vertices_y - 1;
  const int t = static_cast<int>(blockIdx.x % kTetrahedraPerCell),
            cell = static_cast<int>(blockIdx.x / kTetrahedraPerCell);
  if (threadIdx.x < 4) {
    corners[threadIdx.x] = make_tetrahedron_vertex(grid, field, cell % cells_x, cell / cells_x % cells_y,
                                                   cell / (cells_x * cells_y), t, static_cast<int>(threadIdx.x));
  }
  __syncthreads();
  walk_tetrahedron<InverseIn::loop_as_compiled>(grid, corners, threadIdx.x, blockDim.x, texture, write);
}

inline __global__ void fill_kernel(std::int16_t* output, std::int64_t voxels, std::int16_t value) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n < voxels) output[n] = value;
}

/// The formula at every vertex: what FieldSource::memory reads.
inline __global__ void formula_kernel(Grid grid, FormulaField field, glm::vec3* displacement) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const std::int64_t slice = std::int64_t{grid.vertices_x} * grid.vertices_y;
  if (n >= slice * grid.vertices_z) return;
  const int i = static_cast<int>(n % grid.vertices_x), j = static_cast<int>(n / grid.vertices_x % grid.vertices_y),
            k = static_cast<int>(n / slice);
  displacement[n] = field(i, j, k, grid.rest(i, j, k));
}

inline unsigned blocks_for(std::int64_t count, unsigned threads = kThreads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}

/// Queues one run of a method of one thread a cell.
template <class M, InverseIn kWhen, class Field>
void launch_cells(const Grid& grid, const Field& field, const HardwareTexture& texture, const SetValue& write,
                  cudaStream_t stream) {
  const dim3 threads(32, 4, 2);
  const dim3 blocks(blocks_for(grid.vertices_x - 1, threads.x), blocks_for(grid.vertices_y - 1, threads.y),
                    blocks_for(grid.vertices_z - 1, threads.z));
  cell_kernel<M, kWhen><<<blocks, threads, 0, stream>>>(grid, field, texture, write);
}

/// Queues one run of a method, on the field and the texture.
template <class Field>
void launch(Method method, const Grid& grid, const Field& field, const HardwareTexture& texture, const SetValue& write,
            cudaStream_t stream) {
  if (method == Method::gascon) {
    const std::int64_t tetrahedra =
        std::int64_t{grid.vertices_x - 1} * (grid.vertices_y - 1) * (grid.vertices_z - 1) * kTetrahedraPerCell;
    require(tetrahedra <= INT32_MAX, "more tetrahedra than a grid of blocks holds; use larger cells");
    gascon_kernel<<<static_cast<unsigned>(tetrahedra), kThreadsOfTetrahedron, 0, stream>>>(grid, field, texture, write);
  } else {
    with_cell_method(method,
                     [&]<class M, InverseIn kWhen>() { launch_cells<M, kWhen>(grid, field, texture, write, stream); });
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::bench
