// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/ray_frame.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace tetwarp {

namespace {

constexpr std::size_t kTintColours = 256;
constexpr std::int64_t kMostVoxels = (1 << 15) - 1;  ///< on an axis, for places are floats and strides ints

/// How far, in mm, rays begin before a plane: there no ray has entered the volume's box yet.
double back_from(const Geometry& volume, const ViewPlane& plane) {
  const AffineMap point = point_from_index(volume);
  double half = 0;
  for (int axis = 0; axis < 3; ++axis)
    half += 0.5 * std::abs(glm::dot(point.linear[axis], plane.forward)) * static_cast<double>(volume.size[axis]);
  return half + glm::dot(plane.middle - centre(volume), plane.forward);
}

double mixed(double a, double b, double share) { return a + (b - a) * share; }

}  // namespace

double step_mm(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane) {
  const double voxel = std::min({volume.spacing.x, volume.spacing.y, volume.spacing.z});
  // Shorter steps change a sum by one grey level at most.
  const bool is_sum = style.transfer.projection == Projection::sum;
  return voxel * style.step_voxels.value_or(is_sum ? 1.0 : std::clamp(0.5 * plane.pixel_mm / voxel, 0.5, 1.0));
}

void require_renderable(const ConstVolumeView& volume) {
  require(volume.geometry != nullptr && volume.voxels != nullptr, "no volume to be rendered");
  require_valid(*volume.geometry, "volume");
  require(volume.geometry->slices.empty(),
          "a volume with slices at uneven distances is not rendered; resample it onto straightened() first");
  require(volume.components == 1,
          "a volume with " + std::to_string(volume.components) + " values a voxel is not rendered, expected one");
  require(volume.buffered == whole(*volume.geometry), "a part of a volume is not rendered");
  const glm::i64vec3 size = volume.geometry->size;
  require(std::max({size.x, size.y, size.z}) <= kMostVoxels, "a volume of " + to_string(size) +
                                                                 " voxels is not rendered, at most " +
                                                                 std::to_string(kMostVoxels) + " on an axis");
}

void require_valid(const RenderStyle& style) {
  require_valid(style.transfer);
  const double step = style.step_voxels.value_or(1);
  require(step >= 0.01 && step <= 1, "the step of rays has to be 0.01 to 1 voxel");
  for (int channel = 0; channel < 3; ++channel)
    require(style.background[channel] >= 0 && style.background[channel] <= 1,
            "the background colour has to be from 0 to 1");
}

void require_valid(const Tints& tints, const ConstVolumeView& volume) {
  if (!tints.numbers.voxels) return;
  require(volume.voxels != nullptr, "tints need a volume first");
  require(tints.numbers.type == VoxelType::u8 && tints.numbers.components == 1, "tints are numbers of a byte a voxel");
  require(tints.numbers.geometry != nullptr && tints.numbers.geometry->size == volume.geometry->size &&
              tints.numbers.buffered == whole(*volume.geometry),
          "tints have to be on the grid of the volume, " + to_string(volume.geometry->size) + " voxels");
  require(tints.numbers.memory == volume.memory, "tints have to be in the same memory as the volume");
  require(tints.colours.size() <= kTintColours, "at most " + std::to_string(kTintColours) + " tints");
}

void require_ready(const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane, std::size_t bytes) {
  require(volume.voxels != nullptr && !style.transfer.points.empty(), "a renderer needs a volume and a style first");
  require(plane.width > 0 && plane.height > 0 &&
              bytes == 3 * static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height),
          "a picture of " + std::to_string(plane.width) + " x " + std::to_string(plane.height) + " pixels has " +
              std::to_string(bytes) + " bytes, expected three a pixel");
}

void require_pixel(const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane, int column,
                   int row) {
  require_ready(volume, style, plane,
                3 * static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height));
  require(column >= 0 && column < plane.width && row >= 0 && row < plane.height,
          "pixel (" + std::to_string(column) + ", " + std::to_string(row) + ") lies outside the picture");
}

std::vector<TransferEntry> tint_table(const Tints& tints) {
  std::vector<TransferEntry> table;
  for (const glm::vec4& colour : tints.colours) table.push_back({colour.r, colour.g, colour.b, colour.a});
  table.resize(kTintColours);
  return table;
}

RayFrame ray_frame(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane) {
  const AffineMap index = index_from_point(volume);
  const double step = step_mm(volume, style, plane);
  const TransferFunction& transfer = style.transfer;
  const double low = transfer.points.front().value, high = transfer.points.back().value;
  const glm::dvec3 start = plane.at(0.5, 0.5) - plane.forward * back_from(volume, plane);
  RayFrame frame;
  frame.projection = transfer.projection;
  frame.lowest = static_cast<float>(low);
  frame.per_value = static_cast<float>((kTransferEntries - 1) / (high - low));
  frame.first = index(start);
  frame.per_column = index.linear * (plane.right * plane.pixel_mm);
  frame.per_row = index.linear * (plane.down * plane.pixel_mm);
  frame.step = index.linear * (plane.forward * step);
  for (int axis = 0; axis < 3; ++axis) {
    const bool goes = std::abs(frame.step[axis]) > 1e-7f;
    if (!goes) frame.step[axis] = 0;
    frame.per_step[axis] = goes ? 1 / frame.step[axis] : 0;
  }
  frame.to_gradient = index.linear * 0.5;
  const glm::dvec3 light = glm::normalize(-plane.forward - 0.35 * plane.right - 0.5 * plane.down);
  frame.light = light;
  frame.halfway = glm::normalize(light - plane.forward);
  frame.ambient = static_cast<float>(transfer.ambient);
  frame.diffuse = static_cast<float>(transfer.diffuse);
  frame.specular = static_cast<float>(transfer.specular);
  frame.per_gradient = transfer.gradient > 0 ? static_cast<float>(1 / transfer.gradient) : 0;
  frame.background = style.background;
  return frame;
}

ClearValues clear_values(const std::vector<TransferEntry>& table, const RayFrame& frame) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  const auto value = [&](int entry) { return frame.lowest + static_cast<float>(entry) / frame.per_value; };
  const auto run_from = [&](int first) {  // the end of the run of clear entries that begins there
    int end = first;
    while (end < kTransferEntries && table[static_cast<std::size_t>(end)].opacity == 0) ++end;
    return end;
  };
  const int below = run_from(0);
  ClearValues clear{below > 0 ? value(below - 1) : -kNever, kNever, kNever};
  int most = 0;
  for (int first = below; first < kTransferEntries;) {
    const int end = run_from(first);
    if (end - first > most) {
      most = end - first;
      clear.from = value(first);
      clear.to = end == kTransferEntries ? kNever : value(end - 1);
    }
    first = std::max(end, first + 1);
  }
  return clear;
}

std::vector<ValueRange> seen_values(const RenderStyle& style) {
  require_valid(style);
  constexpr float kEnd = std::numeric_limits<float>::infinity();
  const TransferFunction& transfer = style.transfer;
  const double low = transfer.points.front().value, high = transfer.points.back().value;
  if (transfer.projection == Projection::maximum) return {{static_cast<float>(low), kEnd}};
  // An entry is that of values up to half an entry away; a whole one leaves room for rounding errors.
  const auto value = [&](int entry) {
    return static_cast<float>(mixed(low, high, static_cast<double>(entry) / (kTransferEntries - 1)));
  };
  const std::vector<TransferEntry> table = transfer_table(transfer, 1);
  const auto is_seen = [&](int entry) { return table[static_cast<std::size_t>(entry)].opacity > 0; };
  std::vector<ValueRange> seen;
  for (int entry = 0; entry < kTransferEntries; ++entry) {
    if (!is_seen(entry)) continue;
    const int first = entry;
    while (entry + 1 < kTransferEntries && is_seen(entry + 1)) ++entry;
    seen.push_back({first == 0 ? -kEnd : value(first - 1), entry + 1 == kTransferEntries ? kEnd : value(entry + 1)});
  }
  return seen;
}

std::vector<TransferEntry> transfer_table(const TransferFunction& transfer, double step_mm) {
  const double low = transfer.points.front().value, high = transfer.points.back().value;
  std::vector<TransferEntry> table;
  std::size_t n = 0;
  for (int entry = 0; entry < kTransferEntries; ++entry) {
    const double value = mixed(low, high, static_cast<double>(entry) / (kTransferEntries - 1));
    while (n + 2 < transfer.points.size() && transfer.points[n + 1].value <= value) ++n;
    const TransferPoint &a = transfer.points[n], &b = transfer.points[n + 1];
    const double share = std::clamp((value - a.value) / (b.value - a.value), 0.0, 1.0);
    const double opacity = mixed(a.opacity, b.opacity, share);
    table.push_back(
        {static_cast<float>(mixed(a.colour.x, b.colour.x, share)),
         static_cast<float>(mixed(a.colour.y, b.colour.y, share)),
         static_cast<float>(mixed(a.colour.z, b.colour.z, share)),
         static_cast<float>(transfer.projection == Projection::sum ? opacity * step_mm / transfer.white : opacity)});
  }
  return table;
}

TransferIntegrals transfer_integrals(const std::vector<TransferEntry>& table, double step_mm) {
  constexpr double kMostOpacity = 0.9999;  // opacity of a mm; at 1 the depth would be infinite
  TransferIntegrals integrals{{{}}, {}, {}};
  glm::dvec4 sum(0);
  const auto rounded = [](const glm::dvec4& v) {
    return TransferIntegral{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z),
                            static_cast<float>(v.w)};
  };
  for (const TransferEntry& entry : table) {
    const double depth = -std::log1p(-std::min<double>(entry.opacity, kMostOpacity)) * step_mm;
    const glm::dvec4 of_entry = glm::dvec4(entry.red, entry.green, entry.blue, 1) * depth;
    if (integrals.before.size() == 1) integrals.lowest = rounded(of_entry);
    integrals.highest = rounded(of_entry);
    sum += of_entry;
    integrals.before.push_back(rounded(sum));
  }
  return integrals;
}

}  // namespace tetwarp
