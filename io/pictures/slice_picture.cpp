// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/slice_picture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tetwarp {

namespace {

constexpr std::array<std::array<char, 2>, 3> kLetters = {{{'R', 'L'}, {'A', 'P'}, {'I', 'S'}}};

/// The patient axes that point to the right and to the bottom of the picture, and the one across it. The feet are at
/// the bottom where that axis is S.
struct PlaneAxes {
  int right, down, normal;
};
constexpr PlaneAxes kPlanes[] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}};

PictureAxis picture_axis(const Geometry& geometry, int grid_axis, int patient_axis, bool towards_less) {
  PictureAxis axis;
  axis.grid_axis = grid_axis;
  axis.reversed = (geometry.direction[grid_axis][patient_axis] < 0) != towards_less;
  axis.length_mm = static_cast<double>(geometry.size[grid_axis]) * geometry.spacing[grid_axis];
  const auto& letters = kLetters[static_cast<std::size_t>(patient_axis)];
  axis.begin = letters[towards_less ? 1 : 0];
  axis.end = letters[towards_less ? 0 : 1];
  return axis;
}

double index_along(const Geometry& geometry, const PictureAxis& axis, double part) {
  const double index = part * static_cast<double>(geometry.size[axis.grid_axis]) - 0.5;
  return axis.reversed ? static_cast<double>(geometry.size[axis.grid_axis] - 1) - index : index;
}

/// The two samples around each pixel along one side, as byte offsets, and the weight of the second.
struct Tap {
  std::size_t first, second;
  double weight;
};

std::vector<Tap> taps(const Geometry& geometry, const PictureAxis& axis, int pixels, std::size_t stride) {
  std::vector<Tap> result;
  const std::int64_t last = geometry.size[axis.grid_axis] - 1;
  for (int pixel = 0; pixel < pixels; ++pixel) {
    const double index =
        std::clamp(index_along(geometry, axis, (pixel + 0.5) / pixels), 0.0, static_cast<double>(last));
    const auto first = static_cast<std::int64_t>(index);
    const std::int64_t second = std::min(first + 1, last);
    result.push_back({static_cast<std::size_t>(first) * stride, static_cast<std::size_t>(second) * stride,
                      index - static_cast<double>(first)});
  }
  return result;
}

/// The weighted mean of two samples. A sample without weight has no influence, not even if it is NaN.
double mix(double a, double b, double weight) { return weight == 0 ? a : a + weight * (b - a); }

}  // namespace

std::array<int, 3> patient_to_grid_axes(const Geometry& geometry) {
  std::array<int, 3> axes = {0, 1, 2}, best = axes;
  double most = -1;
  do {
    double along = 0;
    for (int patient = 0; patient < 3; ++patient)
      along += std::abs(geometry.direction[axes[static_cast<std::size_t>(patient)]][patient]);
    if (along > most) most = along, best = axes;
  } while (std::next_permutation(axes.begin(), axes.end()));
  return best;
}

Slice middle_slice(const Geometry& geometry, AnatomicalPlane plane) {
  const PlaneAxes& patient = kPlanes[static_cast<int>(plane)];
  const std::array<int, 3> grid = patient_to_grid_axes(geometry);
  const auto grid_axis = [&](int patient_axis) { return grid[static_cast<std::size_t>(patient_axis)]; };
  Slice slice;
  slice.plane = plane;
  slice.right = picture_axis(geometry, grid_axis(patient.right), patient.right, false);
  slice.down = picture_axis(geometry, grid_axis(patient.down), patient.down, patient.down == 2);
  slice.normal_axis = grid_axis(patient.normal);
  slice.voxel = (geometry.size[slice.normal_axis] - 1) / 2;
  return slice;
}

glm::dvec3 Slice::index_at(const Geometry& geometry, double across, double below) const {
  glm::dvec3 index;
  index[normal_axis] = static_cast<double>(voxel);
  index[right.grid_axis] = index_along(geometry, right, across);
  index[down.grid_axis] = index_along(geometry, down, below);
  return index;
}

std::vector<double> sample_slice(const ConstVolumeView& volume, const Slice& slice, int width, int height) {
  const Geometry& geometry = *volume.geometry;
  require(volume.components == 1, "a picture needs one value a voxel, found " + std::to_string(volume.components));
  require(volume.buffered == whole(geometry),
          "a picture needs the whole volume of " + to_string(geometry.size) + " voxels");
  const std::size_t bytes = size_bytes(volume.type);
  const glm::u64vec3 stride(1, geometry.size.x, geometry.size.x * geometry.size.y);
  const std::vector<Tap> columns = taps(geometry, slice.right, width, stride[slice.right.grid_axis] * bytes);
  const std::vector<Tap> rows = taps(geometry, slice.down, height, stride[slice.down.grid_axis] * bytes);
  const std::byte* base = volume.voxels + static_cast<std::size_t>(slice.voxel) * stride[slice.normal_axis] * bytes;
  std::vector<double> pixels;
  pixels.reserve(columns.size() * rows.size());
  dispatch(volume.type, [&](auto zero) {
    const auto value = [base](std::size_t offset) {
      auto held = decltype(zero){};
      std::memcpy(&held, base + offset, sizeof(held));
      return static_cast<double>(held);
    };
    for (const Tap& row : rows) {
      for (const Tap& column : columns) {
        const double upper = mix(value(row.first + column.first), value(row.first + column.second), column.weight);
        const double lower = mix(value(row.second + column.first), value(row.second + column.second), column.weight);
        pixels.push_back(mix(upper, lower, row.weight));
      }
    }
  });
  return pixels;
}

}  // namespace tetwarp
