// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The arithmetic of deform/core, run on the device and on the host: the same bits.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "deform/core/coarse_map.h"
#include "deform/core/sample.h"
#include "deform/core/visit_cell.h"

namespace {

using namespace tetwarp;

constexpr int kSide = 8;  // voxels of the box that each random cell is looked up in
constexpr int kVoxels = kSide * kSide * kSide;

/// What is found for each voxel in the box of one cell: the lowest of the cell's tetrahedra that owns it (5: none
/// does), u there, and a sample at that place.
struct Answer {
  std::uint8_t owner[kVoxels];
  std::uint8_t owners[kVoxels];
  glm::vec3 u[kVoxels];
  std::int16_t value[kVoxels];
  glm::i64vec3 fixed[kVoxels];  ///< u as coarse fields have it
  float fused[kVoxels];         ///< and a linear sample there
};

TETWARP_HD inline std::int16_t source_voxel(int i) { return static_cast<std::int16_t>((i * 7919) % 4001 - 2000); }

TETWARP_HD inline void answer_cell(const Cell& cell, bool odd, const std::int16_t* source, Answer& answer) {
  for (int i = 0; i < kVoxels; ++i) {
    answer.owner[i] = kTetrahedraPerCell;
    answer.owners[i] = 0;
    answer.u[i] = glm::vec3(0);
    answer.value[i] = 0;
    answer.fixed[i] = glm::i64vec3(0);
    answer.fused[i] = 0;
  }
  const Nudge nudge{glm::i64vec3(6 * kStepsPerVoxel + 100, 8 * kStepsPerVoxel, 7 * kStepsPerVoxel)};
  const SourceVoxels<std::int16_t> voxels{source, glm::i64vec3(kSide), glm::i64vec3(0),
                                          glm::i64vec3(1, kSide, kSide * kSide)};
  visit_cell(cell, odd, {glm::i64vec3(0), glm::i64vec3(kSide)}, nudge,
             [&](const glm::i64vec3& voxel, const glm::i32vec3& signs, int t, const Tetrahedron& tetrahedron) {
               const auto i = static_cast<int>((voxel.z * kSide + voxel.y) * kSide + voxel.x);
               ++answer.owners[i];
               if (t >= answer.owner[i]) return;
               answer.owner[i] = static_cast<std::uint8_t>(t);
               answer.u[i] = interpolate_u(tetrahedron, detail::to_steps(voxel), signs);
               answer.fixed[i] = coarse_u(tetrahedron, glm::ivec3(voxel), signs);
               Place coarse = place_at(voxel, fixed_offset(answer.fixed[i]));
               if (clamp_to_grid(coarse, voxels.size))
                 answer.fused[i] = sample_linear(voxels, coarse, Padding<std::int16_t>{}, Lerp::fused).value;
               Place place = place_at(voxel, answer.u[i]);
               bool saturated = false;
               if (!clamp_to_grid(place, voxels.size)) return;
               const Padding<std::int16_t> padding{true, -2000, -1900};
               answer.value[i] = to_voxel<std::int16_t>(sample_cubic(voxels, place, padding).value, &saturated);
             });
}

__global__ void answer_cells(const Cell* cells, int count, const std::int16_t* source, Answer* answers) {
  const int n = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (n < count) answer_cell(cells[n], n % 2 != 0, source, answers[n]);
}

/// Corners near a cube of `size` voxels, moved by up to `noise` of it and often on whole or half voxels.
Cell random_cell(std::mt19937_64& random, double size, double noise) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double snap_to = unit(random) < 0.5 ? 0.5 : 1.0 / kStepsPerVoxel;
  Cell cell;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 rest = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * size + 1.0;
    glm::dvec3 deformed;
    for (int axis = 0; axis < 3; ++axis) {
      deformed[axis] = std::rint((rest[axis] + noise * size * (unit(random) - 0.5)) / snap_to) * snap_to;
    }
    cell.corner[corner].deformed = snap(deformed);
    cell.corner[corner].u = snap(rest) - cell.corner[corner].deformed;
  }
  return cell;
}

#define EXPECT_CUDA(call) ASSERT_EQ(call, cudaSuccess) << cudaGetErrorString(cudaGetLastError())

TEST(CoreOnDevice, GivesTheSameBitsAsOnTheHost) {
  int devices = 0;
  if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) GTEST_SKIP() << "no CUDA device on this machine";
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  std::vector<Cell> cells;
  for (int n = 0; n < 4096; ++n) cells.push_back(random_cell(random, n % 3 == 0 ? 1 : 3, n % 5 == 0 ? 2.5 : 0.6));
  for (Vertex& vertex : cells[0].corner) vertex.deformed *= 600;  // needs the wide integers
  std::vector<std::int16_t> source(kVoxels);
  for (int i = 0; i < kVoxels; ++i) source[static_cast<std::size_t>(i)] = source_voxel(i);

  Cell* device_cells = nullptr;
  std::int16_t* device_source = nullptr;
  Answer* device_answers = nullptr;
  EXPECT_CUDA(cudaMalloc(&device_cells, cells.size() * sizeof(Cell)));
  EXPECT_CUDA(cudaMalloc(&device_source, source.size() * sizeof(std::int16_t)));
  EXPECT_CUDA(cudaMalloc(&device_answers, cells.size() * sizeof(Answer)));
  EXPECT_CUDA(cudaMemset(device_answers, 0xAB, cells.size() * sizeof(Answer)));
  EXPECT_CUDA(cudaMemcpy(device_cells, cells.data(), cells.size() * sizeof(Cell), cudaMemcpyHostToDevice));
  EXPECT_CUDA(cudaMemcpy(device_source, source.data(), source.size() * sizeof(std::int16_t), cudaMemcpyHostToDevice));
  answer_cells<<<static_cast<unsigned>((cells.size() + 63) / 64), 64>>>(device_cells, static_cast<int>(cells.size()),
                                                                        device_source, device_answers);
  EXPECT_CUDA(cudaGetLastError());
  std::vector<Answer> answers(cells.size());
  EXPECT_CUDA(cudaMemcpy(answers.data(), device_answers, cells.size() * sizeof(Answer), cudaMemcpyDeviceToHost));

  std::size_t owned = 0;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    Answer expected;
    answer_cell(cells[n], n % 2 != 0, source.data(), expected);
    for (int i = 0; i < kVoxels; ++i) owned += expected.owner[i] < kTetrahedraPerCell;
    EXPECT_EQ(std::memcmp(expected.owner, answers[n].owner, sizeof expected.owner), 0) << "owner, cell " << n;
    EXPECT_EQ(std::memcmp(expected.owners, answers[n].owners, sizeof expected.owners), 0) << "owners, cell " << n;
    EXPECT_EQ(std::memcmp(expected.u, answers[n].u, sizeof expected.u), 0) << "u, cell " << n;
    EXPECT_EQ(std::memcmp(expected.fixed, answers[n].fixed, sizeof expected.fixed), 0) << "fixed point, cell " << n;
    EXPECT_EQ(std::memcmp(expected.fused, answers[n].fused, sizeof expected.fused), 0) << "fused, cell " << n;
    EXPECT_EQ(std::memcmp(expected.value, answers[n].value, sizeof expected.value), 0) << "value, cell " << n;
  }
  EXPECT_GT(owned, cells.size());
  cudaFree(device_cells);
  cudaFree(device_source);
  cudaFree(device_answers);
}

}  // namespace
