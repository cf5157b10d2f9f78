// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "deform/geometry.h"
#include "deform/phantom/random.h"

namespace tetwarp::phantom {

/// Noise of a slice with variance 1: white, then smoothed over three by three voxels, as a reconstruction does. It
/// depends on the seed, the slice and the size of the grid alone.
class GrainRows {
 public:
  /// @param size  of the grid, whose rows have `size.x` voxels
  GrainRows(const glm::i64vec3& size, std::int64_t slice, std::uint64_t seed) : width_(size.x), seed_(seed) {
    first_key_ = static_cast<std::uint64_t>(slice) * static_cast<std::uint64_t>((size.x + 2) * (size.y + 2));
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(size.x));
    fill(0);
    fill(1);
  }
  /// Makes the next row of the slice.
  void next(std::span<float> grain) {
    fill(row_ + 2);
    const auto &above = rows_[row_ % 3], &here = rows_[(row_ + 1) % 3], &below = rows_[(row_ + 2) % 3];
    for (std::size_t i = 0; i < grain.size(); ++i) grain[i] = (above[i] + 2 * here[i] + below[i]) * (1.0f / 6);
    ++row_;
  }

 private:
  /// Makes row j of the slice, smoothed along x only; rows are counted from one before the first.
  void fill(std::uint64_t j) {
    const std::uint64_t key = hash(seed_) + first_key_ + j * static_cast<std::uint64_t>(width_ + 2);
    float left = normal(key), here = normal(key + 1);
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(width_); ++i) {
      const float right = normal(key + i + 2);
      rows_[j % 3][i] = left + 2 * here + right;
      left = here;
      here = right;
    }
  }

  std::int64_t width_;
  std::uint64_t seed_, first_key_, row_ = 0;
  std::array<std::vector<float>, 3> rows_;
};

}  // namespace tetwarp::phantom
