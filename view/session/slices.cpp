// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/slices.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "io/slice_view.h"

namespace tetwarp::viewer {

namespace {

/// Calls `use(pixel, voxel)` for the pixels of a row with the number of their voxel in the slice's region, i fastest.
template <class Use>
void for_each_pixel(const Geometry& grid, const Slice& slice, Use&& use) {
  const std::int64_t width = grid.size[slice.right.grid_axis], height = grid.size[slice.down.grid_axis];
  const bool right_first = slice.right.grid_axis < slice.down.grid_axis;
  const std::int64_t right = right_first ? 1 : height, down = right_first ? width : 1;
  tbb::parallel_for(std::int64_t{0}, height, [&](std::int64_t y) {
    const std::int64_t row = (slice.down.reversed ? height - 1 - y : y) * down;
    for (std::int64_t x = 0; x < width; ++x)
      use(y * width + x, row + (slice.right.reversed ? width - 1 - x : x) * right);
  });
}

PaneImage blank(const Geometry& grid, const Slice& slice, bool is_grey) {
  PaneImage image{static_cast<int>(grid.size[slice.right.grid_axis]),
                  static_cast<int>(grid.size[slice.down.grid_axis]),
                  is_grey,
                  {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                      (is_grey ? 1 : 3));
  return image;
}

void put(PaneImage& image, std::int64_t pixel, const Colour& colour) {
  std::copy(colour.begin(), colour.end(), image.pixels.begin() + 3 * pixel);
}

PaneImage coloured(const PaneImage& grey) {
  PaneImage image{grey.width, grey.height, false, {}};
  image.pixels.reserve(3 * grey.pixels.size());
  for (const std::uint8_t value : grey.pixels) image.pixels.insert(image.pixels.end(), 3, value);
  return image;
}

}  // namespace

VolumeView SliceMaker::Part::view(const Geometry& grid, VoxelType type, int components) {
  bytes.resize(static_cast<std::size_t>(voxel_count(region)) * size_bytes(type) * static_cast<std::size_t>(components));
  return {&grid, region, type, components, bytes.data(), Memory::host};
}

SliceMaker::SliceMaker(const Geometry& grid, const Target& target, const FieldView& still,
                       std::unique_ptr<ForwardResampler> after, std::unique_ptr<ForwardResampler> before)
    : grid_(grid), target_(target), field_(still), after_(std::move(after)), before_(std::move(before)) {
  before_->set_field(still, {.jacobian_range = false});
}

void SliceMaker::set_field(const FieldView& field) {
  field_ = field;
  knows_ = false;
}

/// The resampler for what is asked, with its field.
ForwardResampler& SliceMaker::resampler(Which which) {
  if (which == Which::before) return *before_;
  if (!knows_) after_->set_field(field_, {.jacobian_range = false});
  knows_ = true;
  return *after_;
}

SliceMaker::Part SliceMaker::part(Which which, const Region& region) {
  Part made{region, {}};
  Target target = target_;
  target.output = made.view(grid_, target.source.type);
  resampler(which).resample(region, {&target, 1});
  return made;
}

PaneImage SliceMaker::picture(const Slice& slice, const SliceLook& look) {
  const Region region = region_of(grid_, slice);
  std::optional<Part> after, before;
  if (look.compared != Compared::before) after = part(Which::after, region);
  if (look.compared != Compared::after) before = part(Which::before, region);
  const bool is_difference = look.compared == Compared::difference;
  PaneImage image = blank(grid_, slice, !is_difference);
  const DifferenceScale scale{look.window.width / 2};
  const auto first_after =
      static_cast<std::int64_t>(look.compared == Compared::swipe ? std::lround(look.swipe * image.width) : 0);
  dispatch(target_.source.type, [&](auto zero) {
    using V = decltype(zero);
    const auto* const a = after ? reinterpret_cast<const V*>(after->bytes.data()) : nullptr;
    const auto* const b = before ? reinterpret_cast<const V*>(before->bytes.data()) : nullptr;
    for_each_pixel(grid_, slice, [&](std::int64_t pixel, std::int64_t voxel) {
      if (is_difference) {
        put(image, pixel, scale(static_cast<double>(a[voxel]) - static_cast<double>(b[voxel])));
      } else {
        const V value = a && pixel % image.width >= first_after ? a[voxel] : b[voxel];
        image.pixels[static_cast<std::size_t>(pixel)] = look.window(static_cast<double>(value))[0];
      }
    });
  });
  if (!look.overlay || look.compared == Compared::before) return image;
  if (image.is_grey) image = coloured(image);
  if (*look.overlay == OverlayKind::lattice) {
    if (field_.lattice) lay_lattice_over(image, slice);
  } else {
    lay_over(image, slice, *look.overlay);
  }
  return image;
}

void SliceMaker::lay_lattice_over(PaneImage& image, const Slice& slice) {
  Part map{region_of(grid_, slice), {}};
  Maps maps;
  maps.inverse_mm = map.view(grid_, VoxelType::f32, 3);
  resampler(Which::after).resample(map.region, {}, maps);
  tetwarp::Picture lines(image.width, image.height);
  std::copy(image.pixels.begin(), image.pixels.end(), lines.bytes().begin());
  draw_lattice(lines, grid_, slice, {OverlayKind::lattice, maps.inverse_mm, *field_.lattice});
  std::copy(lines.bytes().begin(), lines.bytes().end(), image.pixels.begin());
}

/// The map that an overlay shows, of a slice.
SliceMaker::Part SliceMaker::map_of(const Slice& slice, OverlayKind kind) {
  Part map{region_of(grid_, slice), {}}, values = map;
  Maps maps;
  Target target = target_;
  std::span<const Target> targets;
  if (kind == OverlayKind::coverage) {
    maps.coverage = map.view(grid_, VoxelType::u8);
    target.output = values.view(grid_, target.source.type);
    targets = {&target, 1};
  } else if (kind == OverlayKind::folds) {
    maps.owners = map.view(grid_, VoxelType::u16);
  } else {
    maps.jacobian = map.view(grid_, VoxelType::f32);
  }
  resampler(Which::after).resample(map.region, targets, maps);
  return map;
}

void SliceMaker::lay_over(PaneImage& image, const Slice& slice, OverlayKind kind) {
  const Part map = map_of(slice, kind);
  const auto value = [&](std::int64_t voxel) -> double {
    if (kind == OverlayKind::coverage) return std::to_integer<int>(map.bytes[static_cast<std::size_t>(voxel)]);
    if (kind == OverlayKind::folds) return reinterpret_cast<const std::uint16_t*>(map.bytes.data())[voxel];
    return static_cast<double>(reinterpret_cast<const float*>(map.bytes.data())[voxel]);
  };
  for_each_pixel(grid_, slice, [&](std::int64_t pixel, std::int64_t voxel) {
    const Tint tint = tint_of(kind, value(voxel));
    if (tint.share <= 0) return;
    const std::uint8_t* const at = image.pixels.data() + 3 * pixel;
    put(image, pixel, mixed({at[0], at[1], at[2]}, tint));
  });
}

double SliceMaker::value(const glm::i64vec3& voxel, Which which) {
  const Part one = part(which, {voxel, voxel + std::int64_t{1}});
  return dispatch(target_.source.type, [&](auto value) {
    std::memcpy(&value, one.bytes.data(), sizeof(value));
    return static_cast<double>(value);
  });
}

glm::vec3 SliceMaker::inverse_mm(const glm::i64vec3& voxel) {
  Part map{{voxel, voxel + std::int64_t{1}}, {}};
  Maps maps;
  maps.inverse_mm = map.view(grid_, VoxelType::f32, 3);
  resampler(Which::after).resample(map.region, {}, maps);
  glm::vec3 by;
  std::memcpy(&by, map.bytes.data(), sizeof(by));
  return by;
}

}  // namespace tetwarp::viewer
