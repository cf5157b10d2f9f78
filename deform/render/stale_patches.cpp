// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/stale_patches.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace tetwarp {

namespace {

/// How far from a ray, in voxels along an axis, a voxel may lie that it depends on: differences around a place take
/// those less than two away. The rest is room for rounding errors.
constexpr double kAround = 2.5;

/// The patches along an axis that have the middle of a pixel between two places, pixels from the edge.
struct PatchRange {
  /// @param pixels  of the picture  @param patch  pixels of a patch
  PatchRange(double low, double high, int pixels, int patch)
      : begin(static_cast<int>(std::ceil(std::clamp(low - 0.5, 0.0, static_cast<double>(pixels)))) / patch),
        end((static_cast<int>(std::floor(std::clamp(high - 0.5, -1.0, pixels - 1.0))) + patch) / patch) {}
  int begin, end;
};

}  // namespace

void StalePatches::forget() {
  kept_.reset();
  volume_changes_ = false;
}

void StalePatches::change(const Geometry& volume, std::span<const Region> regions) {
  volume_changes_ = true;
  if (!kept_) return;
  const AffineMap point = point_from_index(volume);
  glm::dvec3 across(0), below(0);  // pixels for a step along i, j, k
  for (int axis = 0; axis < 3; ++axis) {
    across[axis] = std::abs(glm::dot(point.linear[axis], kept_->right)) / kept_->pixel_mm;
    below[axis] = std::abs(glm::dot(point.linear[axis], kept_->down)) / kept_->pixel_mm;
  }
  for (const Region& region : regions) {
    if (is_empty(region)) continue;
    const glm::dvec3 first(region.begin), last(region.end - std::int64_t{1});
    const glm::dvec3 middle = kept_->project(point(0.5 * (first + last))), half = 0.5 * (last - first) + kAround;
    const double wide = glm::dot(across, half), high = glm::dot(below, half);
    const PatchRange x(middle.x - wide, middle.x + wide, kept_->width, width_),
        y(middle.y - high, middle.y + high, kept_->height, height_);
    if (x.begin >= x.end || y.begin >= y.end) continue;
    const auto add = [&](int column, int row, int count) {
      changes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) +
               static_cast<std::size_t>(column)] += count;
    };
    add(x.begin, y.begin, 1);
    add(x.end, y.begin, -1);
    add(x.begin, y.end, -1);
    add(x.end, y.end, 1);
  }
}

std::optional<std::vector<int>> StalePatches::take(const ViewPlane& plane) {
  const bool holds = kept_ == plane;
  kept_.reset();
  if (!holds) return std::nullopt;
  std::vector<int> patches, met(static_cast<std::size_t>(columns_));  // `met`: changes that patches of a row have met
  for (int row = 0; row < rows_; ++row) {
    const int* const changes = changes_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1);
    int sum = 0;
    for (int column = 0; column < columns_; ++column) {
      sum += changes[column];
      int& count = met[static_cast<std::size_t>(column)];
      count += sum;
      if (count > 0) patches.push_back(row * columns_ + column);
    }
  }
  return patches;
}

void StalePatches::keep(const ViewPlane& plane) {
  kept_ = plane;
  columns_ = (plane.width + width_ - 1) / width_;
  rows_ = (plane.height + height_ - 1) / height_;
  changes_.assign(static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1), 0);
}

}  // namespace tetwarp
