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

/// How much of a label's colour is mixed to what lies below.
constexpr double kLabelShare = 0.4;

/// Colours that differ from one label to the next.
Colour label_colour(std::int64_t label) {
  static constexpr Colour kColours[] = {{230, 80, 70},   {80, 170, 230},  {110, 200, 90},  {240, 190, 60},
                                        {180, 110, 220}, {70, 200, 190},  {240, 140, 60},  {230, 120, 180},
                                        {160, 190, 60},  {110, 130, 230}, {200, 160, 120}, {150, 220, 160}};
  constexpr std::int64_t count = std::size(kColours);
  return kColours[((label - 1) % count + count) % count];
}

}  // namespace

VolumeView SliceMaker::Part::view(const Geometry& grid, VoxelType type, int components) {
  bytes.resize(static_cast<std::size_t>(voxel_count(region)) * size_bytes(type) * static_cast<std::size_t>(components));
  return {&grid, region, type, components, bytes.data(), Memory::host};
}

SliceMaker::SliceMaker(Setup setup) : setup_(std::move(setup)), field_(setup_.still) {
  setup_.before->set_field(setup_.still, {.jacobian_range = false});
}

void SliceMaker::set_field(const AnyFieldView& field) {
  field_ = field;
  knows_ = false;
}

/// The resampler for what is asked, with its field.
Resampler& SliceMaker::resampler(Which which) {
  if (which == Which::before) return *setup_.before;
  if (!knows_) setup_.deformer->set_field(field_, {.jacobian_range = false});
  knows_ = true;
  return **setup_.deformer;
}

SliceMaker::Part SliceMaker::part(const Target& of, Which which, const Region& region) {
  Part made{region, {}};
  Target target = of;
  target.output = made.view(setup_.grid, target.source.type);
  resampler(which).resample(region, {&target, 1});
  return made;
}

PaneImage SliceMaker::picture(const Slice& slice, const SliceLook& look) {
  const Region region = region_of(setup_.grid, slice);
  std::optional<Part> after, before;
  if (look.compared != Compared::before) after = part(setup_.target, Which::after, region);
  if (look.compared != Compared::after) before = part(setup_.target, Which::before, region);
  const bool is_difference = look.compared == Compared::difference;
  PaneImage image = blank(setup_.grid, slice, !is_difference);
  const DifferenceScale scale{look.window.width / 2};
  // Columns from here on show the deformed volume.
  const std::int64_t deformed_from = look.compared == Compared::before  ? image.width
                                     : look.compared == Compared::swipe ? std::lround(look.swipe * image.width)
                                                                        : 0;
  dispatch(setup_.target.source.type, [&](auto zero) {
    using V = decltype(zero);
    const auto* const a = after ? reinterpret_cast<const V*>(after->bytes.data()) : nullptr;
    const auto* const b = before ? reinterpret_cast<const V*>(before->bytes.data()) : nullptr;
    for_each_pixel(setup_.grid, slice, [&](std::int64_t pixel, std::int64_t voxel) {
      if (is_difference) {
        put(image, pixel, scale(static_cast<double>(a[voxel]) - static_cast<double>(b[voxel])));
      } else {
        const V value = pixel % image.width >= deformed_from ? a[voxel] : b[voxel];
        image.pixels[static_cast<std::size_t>(pixel)] = look.window(static_cast<double>(value))[0];
      }
    });
  });
  const bool is_label = look.layer == Layer::labels || look.layer == Layer::contours;
  if (!look.layer || (look.compared == Compared::before && !is_label)) return image;
  if (image.is_grey) image = coloured(image);
  switch (*look.layer) {
    case Layer::lattice: lay_lattice_over(image, slice); break;
    case Layer::jacobian: lay_over(image, slice, OverlayKind::jacobian); break;
    case Layer::folds: lay_over(image, slice, OverlayKind::folds); break;
    case Layer::coverage: lay_over(image, slice, OverlayKind::coverage); break;
    case Layer::labels:
    case Layer::contours:
      if (deformed_from > 0) lay_labels_over(image, slice, Which::before, look, {0, deformed_from});
      if (deformed_from < image.width) lay_labels_over(image, slice, Which::after, look, {deformed_from, image.width});
  }
  return image;
}

void SliceMaker::lay_lattice_over(PaneImage& image, const Slice& slice) {
  const auto* const field = std::get_if<FieldView>(&field_);
  if (!field || !field->lattice) return;
  Part map{region_of(setup_.grid, slice), {}};
  Maps maps;
  maps.inverse_mm = map.view(setup_.grid, VoxelType::f32, 3);
  resampler(Which::after).resample(map.region, {}, maps);
  tetwarp::Picture lines(image.width, image.height);
  std::copy(image.pixels.begin(), image.pixels.end(), lines.bytes().begin());
  draw_lattice(lines, setup_.grid, slice, {OverlayKind::lattice, maps.inverse_mm, *field->lattice});
  std::copy(lines.bytes().begin(), lines.bytes().end(), image.pixels.begin());
}

/// The map that an overlay shows, of a slice.
SliceMaker::Part SliceMaker::map_of(const Slice& slice, OverlayKind kind) {
  Part map{region_of(setup_.grid, slice), {}}, values = map;
  Maps maps;
  Target target = setup_.target;
  std::span<const Target> targets;
  if (kind == OverlayKind::coverage) {
    maps.coverage = map.view(setup_.grid, VoxelType::u8);
    target.output = values.view(setup_.grid, target.source.type);
    targets = {&target, 1};
  } else if (kind == OverlayKind::folds) {
    maps.owners = map.view(setup_.grid, VoxelType::u16);
  } else {
    maps.jacobian = map.view(setup_.grid, VoxelType::f32);
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
  for_each_pixel(setup_.grid, slice, [&](std::int64_t pixel, std::int64_t voxel) {
    const Tint tint = tint_of(kind, value(voxel));
    if (tint.share <= 0) return;
    const std::uint8_t* const at = image.pixels.data() + 3 * pixel;
    put(image, pixel, mixed({at[0], at[1], at[2]}, tint));
  });
}

/// Labels as colours, or as lines on the inner side of their borders. 0 is no label.
/// @param columns  first column, and the one behind the last
void SliceMaker::lay_labels_over(PaneImage& image, const Slice& slice, Which which, const SliceLook& look,
                                 const std::pair<std::int64_t, std::int64_t>& columns) {
  if (!setup_.labels) return;
  const bool as_lines = look.layer == Layer::contours;
  const Part map = part(*setup_.labels, which, region_of(setup_.grid, slice));
  std::vector<std::int64_t> labels(image.pixels.size() / 3);
  dispatch(setup_.labels->source.type, [&](auto zero) {
    const auto* const values = reinterpret_cast<const decltype(zero)*>(map.bytes.data());
    for_each_pixel(setup_.grid, slice, [&](std::int64_t pixel, std::int64_t voxel) {
      labels[static_cast<std::size_t>(pixel)] = std::llround(static_cast<double>(values[voxel]));
    });
  });
  const std::int64_t width = image.width, height = image.height;
  const auto label = [&](std::int64_t x, std::int64_t y) { return labels[static_cast<std::size_t>(y * width + x)]; };
  const auto is_border = [&](std::int64_t x, std::int64_t y) {
    const std::int64_t own = label(x, y);
    return (x > 0 && label(x - 1, y) != own) || (x + 1 < width && label(x + 1, y) != own) ||
           (y > 0 && label(x, y - 1) != own) || (y + 1 < height && label(x, y + 1) != own);
  };
  tbb::parallel_for(std::int64_t{0}, height, [&](std::int64_t y) {
    for (std::int64_t x = columns.first; x < columns.second; ++x) {
      if (label(x, y) == 0 || (as_lines && !is_border(x, y))) continue;
      const std::int64_t pixel = y * width + x;
      const std::uint8_t* const at = image.pixels.data() + 3 * pixel;
      put(image, pixel, mixed({at[0], at[1], at[2]}, {label_colour(label(x, y)), as_lines ? 1.0 : kLabelShare}));
    }
  });
}

double SliceMaker::value(const glm::i64vec3& voxel, Which which) {
  const Part one = part(setup_.target, which, {voxel, voxel + std::int64_t{1}});
  return dispatch(setup_.target.source.type, [&](auto value) {
    std::memcpy(&value, one.bytes.data(), sizeof(value));
    return static_cast<double>(value);
  });
}

glm::vec3 SliceMaker::inverse_mm(const glm::i64vec3& voxel) {
  Part map{{voxel, voxel + std::int64_t{1}}, {}};
  Maps maps;
  maps.inverse_mm = map.view(setup_.grid, VoxelType::f32, 3);
  resampler(Which::after).resample(map.region, {}, maps);
  glm::vec3 by;
  std::memcpy(&by, map.bytes.data(), sizeof(by));
  return by;
}

}  // namespace tetwarp::viewer
