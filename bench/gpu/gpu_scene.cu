// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_scene.h"
#include "bench/paper/baseline_kernels.cuh"
#include "bench/simulate/simulate.h"

namespace tetwarp::bench {

namespace {

/// Also counts the vertices that move.
__global__ void field_kernel(Grid grid, TestField field, glm::vec3* displacement, unsigned long long* moving) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const std::int64_t slice = std::int64_t{grid.vertices_x} * grid.vertices_y;
  bool moves = false;
  if (n < slice * grid.vertices_z) {
    const int i = static_cast<int>(n % grid.vertices_x), j = static_cast<int>(n / grid.vertices_x % grid.vertices_y),
              k = static_cast<int>(n / slice);
    const glm::vec3 by = displacement_at(field, grid.rest(i, j, k));
    moves = by.x != 0 || by.y != 0 || by.z != 0;
    displacement[n] = by;
  }
  const int count = __syncthreads_count(moves);
  if (threadIdx.x == 0 && count != 0) atomicAdd(moving, static_cast<unsigned long long>(count));
}

__global__ void places_kernel(Grid grid, TestField inverse, glm::vec3* places) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const std::int64_t slice = std::int64_t{grid.nx} * grid.ny;
  if (n >= slice * grid.nz) return;
  const glm::vec3 voxel(static_cast<float>(n % grid.nx), static_cast<float>(n / grid.nx % grid.ny),
                        static_cast<float>(n / slice));
  places[n] = deformed_place(voxel, displacement_at(inverse, voxel));
}

}  // namespace

FrameVolumes make_device_volumes(const Volume<std::int16_t>& volume, double background) {
  struct Memory {
    DeviceBuffer<std::int16_t> source, output;
  };
  const auto memory = std::make_shared<Memory>();
  const Stream stream;
  memory->source.upload(volume.voxels.data(), volume.voxels.size(), stream.get());
  memory->output.reserve(volume.voxels.size());
  TETWARP_CUDA_TRY(cudaDeviceSynchronize());
  return {{.source = device_view(volume.geometry, memory->source.data()),
           .output = device_view(volume.geometry, memory->output.data()),
           .background = background},
          memory};
}

void FieldOnDevice::generate(const TestField& field, const Geometry& volume, std::int64_t cell_size,
                             const Stream& stream) {
  lattice_ = lattice_over(volume, cell_size);
  grid_ = make_grid(volume, lattice_, cell_size);
  const auto count = static_cast<std::int64_t>(vertices());
  displacement_.reserve(vertices());
  moving_.fill(0, 1, stream.get());
  field_kernel<<<blocks_for(count), kThreads, 0, stream.get()>>>(grid_, field, displacement_.data(), moving_.data());
  TETWARP_CUDA_TRY(cudaGetLastError());
  unsigned long long moving = 0;
  moving_.download(&moving, 1, stream.get());
  at_rest_ = 1 - static_cast<double>(moving) / static_cast<double>(count);
}

VertexField FieldOnDevice::on_host() const {
  VertexField field{lattice_, std::vector<glm::vec3>(vertices())};
  TETWARP_CUDA_TRY(cudaMemcpy(field.displacement.data(), displacement_.data(), size_bytes(), cudaMemcpyDeviceToHost));
  return field;
}

void generate_places(const TestField& inverse, const Geometry& volume, DeviceBuffer<glm::vec3>& places,
                     const Stream& stream) {
  const std::int64_t voxels = voxel_count(volume);
  places_kernel<<<blocks_for(voxels), kThreads, 0, stream.get()>>>(
      make_grid(volume, lattice_over(volume, 1), 1), inverse, places.reserve(static_cast<std::size_t>(voxels)));
  TETWARP_CUDA_TRY(cudaGetLastError());
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream.get()));
}

}  // namespace tetwarp::bench
