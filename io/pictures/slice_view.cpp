// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/slice_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "io/pictures/lettering.h"
#include "io/pictures/preview_layout.h"

namespace tetwarp {

namespace {

constexpr Colour kPaper = {16, 16, 18};
constexpr const char* kNames[] = {"axial", "coronal", "sagittal"};
constexpr int kLeastPixels = 16;   ///< the least pixels of a slice along a side
constexpr double kLineEvery = 12;  ///< the least distance of two lattice lines in pixels
constexpr Tint kLine = {{90, 220, 255}, 0.75};

/// The values of a voxel of a map; NaN where the map has none.
glm::dvec3 voxel_of(const ConstVolumeView& map, const glm::i64vec3& voxel) {
  const Region& held = map.buffered;
  const glm::i64vec3 at = voxel - held.begin, size = held.end - held.begin;
  glm::dvec3 values(NAN);
  if (glm::any(glm::lessThan(at, glm::i64vec3(0))) || glm::any(glm::greaterThanEqual(at, size))) return values;
  const std::size_t number = static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x);
  dispatch(map.type, [&](auto zero) {
    for (int n = 0; n < std::min(map.components, 3); ++n) {
      auto value = decltype(zero){};
      std::memcpy(&value,
                  map.voxels +
                      (number * static_cast<std::size_t>(map.components) + static_cast<std::size_t>(n)) * sizeof(value),
                  sizeof(value));
      values[n] = static_cast<double>(value);
    }
  });
  return values;
}

/// The values of a map between the voxels of a slice, linearly interpolated; where a voxel has no number, the values of
/// the nearest voxel.
glm::dvec3 between_voxels(const ConstVolumeView& map, const Slice& slice, const glm::dvec3& index) {
  const glm::dvec3 last(map.geometry->size - std::int64_t{1}), inside = glm::clamp(index, glm::dvec3(0), last);
  const int a = slice.right.grid_axis, b = slice.down.grid_axis;
  const glm::i64vec3 low(glm::floor(inside));
  glm::dvec3 sum(0);
  for (int n = 0; n < 4; ++n) {
    glm::i64vec3 voxel = low;
    voxel[a] = std::min(low[a] + (n & 1), map.geometry->size[a] - 1);
    voxel[b] = std::min(low[b] + (n >> 1), map.geometry->size[b] - 1);
    const double fa = inside[a] - static_cast<double>(low[a]), fb = inside[b] - static_cast<double>(low[b]);
    sum += voxel_of(map, voxel) * ((n & 1 ? fa : 1 - fa) * (n >> 1 ? fb : 1 - fb));
  }
  return std::isnan(sum.x) ? voxel_of(map, glm::i64vec3(glm::round(inside))) : sum;
}

/// The picture of one slice, in a part of a larger picture.
class SlicePanel {
 public:
  SlicePanel(Picture& picture, const Rectangle& panel, const Geometry& grid, const Slice& slice)
      : picture_(picture), panel_(panel), grid_(grid), slice_(slice) {}

  void show(const ConstVolumeView& volume, const Window& window) {
    const std::vector<double> values = sample_slice(volume, slice_, panel_.width, panel_.height);
    auto value = values.begin();
    for (int y = 0; y < panel_.height; ++y) {
      for (int x = 0; x < panel_.width; ++x) picture_.set(panel_.x + x, panel_.y + y, window(*value++));
    }
  }

  void lay_over(const Overlay& overlay) {
    if (overlay.kind == OverlayKind::lattice) return draw_lattice(overlay);
    for (int y = 0; y < panel_.height; ++y) {
      for (int x = 0; x < panel_.width; ++x) tint(x, y, tint_of(overlay.kind, voxel_of(overlay.map, voxel_at(x, y)).x));
    }
  }

 private:
  void tint(int x, int y, const Tint& tint) {
    if (tint.share > 0) picture_.set(panel_.x + x, panel_.y + y, mixed(picture_.at(panel_.x + x, panel_.y + y), tint));
  }
  glm::dvec3 index_at(double x, double y) const {
    return slice_.index_at(grid_, (x + 0.5) / panel_.width, (y + 0.5) / panel_.height);
  }
  glm::i64vec3 voxel_at(int x, int y) const {
    return glm::clamp(glm::i64vec3(glm::round(index_at(x, y))), glm::i64vec3(0), grid_.size - std::int64_t{1});
  }
  void draw_lattice(const Overlay& overlay);

  Picture& picture_;
  Rectangle panel_;
  const Geometry& grid_;
  const Slice& slice_;
};

/// Draws lines where the undeformed place of a pixel changes from one cell of the lattice to the next. Axes along which
/// the slice stays within one layer of cells give no lines.
void SlicePanel::draw_lattice(const Overlay& overlay) {
  const AffineMap point = point_from_index(grid_), lattice = index_from_point(overlay.lattice);
  const glm::dvec3 cells = glm::abs(lattice.linear * point.linear * (index_at(1, 1) - index_at(0, 0)));
  glm::dvec3 step(1);  // cells between two lines, a power of two
  for (int axis = 0; axis < 3; ++axis)
    step[axis] = std::pow(2, std::ceil(std::log2(std::max(1.0, cells[axis] * kLineEvery))));
  const auto width = static_cast<std::size_t>(panel_.width);
  std::vector<glm::dvec3> above(width, glm::dvec3(NAN));
  for (int y = 0; y < panel_.height; ++y) {
    glm::dvec3 left(NAN);
    for (int x = 0; x < panel_.width; ++x) {
      const glm::dvec3 at = index_at(x, y), moved = between_voxels(overlay.map, slice_, at);
      const glm::dvec3 cell = glm::floor(lattice(point(at) + moved) / step + 1e-3);
      bool line = false;
      for (const glm::dvec3& other : {left, above[static_cast<std::size_t>(x)]}) {
        for (int axis = 0; axis < 3; ++axis)
          line = line || (cells[axis] > 1e-9 && std::abs(cell[axis] - other[axis]) > 0.5);
      }
      if (line) tint(x, y, kLine);
      left = above[static_cast<std::size_t>(x)] = cell;
    }
  }
}

int pixels(double mm, double pixels_per_mm) { return static_cast<int>(std::lround(mm * pixels_per_mm)); }

/// The panels of a view beside each other, and the space around them.
struct Layout {
  std::vector<Rectangle> panels;
  double pixels_per_mm = 1;
  int width = 0, height = 0, header = 0, gutter = 0;
};

Layout lay_out(std::span<const SlicePart> parts, const SliceViewOptions& options) {
  double across = 0, below = 0;
  for (const auto& [slice, overlays] : parts) {
    across += slice.right.length_mm;
    below = std::max(below, slice.down.length_mm);
  }
  Layout layout;
  const auto count = static_cast<int>(parts.size());
  int footer = 0;
  if (!options.plain) {
    const int line = lettering_line(options.width, options.height);
    layout.gutter = 3 * line;
    layout.header = 4 * line;
    footer = (3 + static_cast<int>(parts.front().overlays.size())) * line;
  }
  layout.pixels_per_mm = std::min((options.width - layout.gutter * (count + 1)) / across,
                                  (options.height - layout.header - footer) / below);
  layout.width = layout.gutter;
  int tallest = 0;
  for (const auto& [slice, overlays] : parts) {
    const Rectangle panel{layout.width, layout.header, pixels(slice.right.length_mm, layout.pixels_per_mm),
                          pixels(slice.down.length_mm, layout.pixels_per_mm)};
    require(std::min(panel.width, panel.height) >= kLeastPixels,
            "a picture of " + std::to_string(options.width) + " x " + std::to_string(options.height) +
                " pixels is too small for " + std::to_string(count) + " slices; give it more with --size");
    layout.panels.push_back(panel);
    layout.width += panel.width + layout.gutter;
    tallest = std::max(tallest, panel.height);
  }
  layout.height = layout.header + tallest + footer;
  return layout;
}

void draw_letters(const Lettering& lettering, const Rectangle& panel, const Slice& slice) {
  const int line = lettering.line(), middle_x = panel.x + panel.width / 2,
            middle_y = panel.y + (panel.height - line) / 2;
  const auto letter = [&](int x, int y, char direction) { lettering.write(x, y, {&direction, 1}, kLetterColour); };
  letter(panel.x - line, middle_y, slice.right.begin);
  letter(panel.x + panel.width + line / 3, middle_y, slice.right.end);
  letter(middle_x, panel.y - line, slice.down.begin);
  letter(middle_x, panel.y + panel.height + line / 5, slice.down.end);
}

}  // namespace

Window choose_window(const ConstVolumeView& volume) {
  constexpr int kSamples = 256;
  std::vector<double> values;
  for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal}) {
    const std::vector<double> of_plane =
        sample_slice(volume, middle_slice(*volume.geometry, plane), kSamples, kSamples);
    values.insert(values.end(), of_plane.begin(), of_plane.end());
  }
  return choose_window(values, volume.type);
}

void draw_lattice(Picture& picture, const Geometry& grid, const Slice& slice, const Overlay& overlay) {
  SlicePanel(picture, {0, 0, picture.width(), picture.height()}, grid, slice).lay_over(overlay);
}

Slice slice_through(const Geometry& geometry, AnatomicalPlane plane, const glm::dvec3& point) {
  Slice slice = middle_slice(geometry, plane);
  const double index = index_from_point(geometry)(point)[slice.normal_axis];
  const std::int64_t voxel = std::llround(index), size = geometry.size[slice.normal_axis];
  require(voxel >= 0 && voxel < size, std::string("the ") + kNames[static_cast<int>(plane)] + " slice through " +
                                          short_number(point.x) + "/" + short_number(point.y) + "/" +
                                          short_number(point.z) + " mm lies outside the volume");
  slice.voxel = voxel;
  return slice;
}

Region region_of(const Geometry& geometry, const Slice& slice) {
  Region region = whole(geometry);
  region.begin[slice.normal_axis] = slice.voxel;
  region.end[slice.normal_axis] = slice.voxel + 1;
  return region;
}

Picture draw_slices(const ConstVolumeView& volume, std::span<const SlicePart> parts, const SliceViewOptions& options) {
  require(!parts.empty(), "no slice to be shown");
  const Layout layout = lay_out(parts, options);
  Picture picture(layout.width, layout.height, kPaper);
  const Lettering lettering(picture);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const Slice& slice = parts[n].slice;
    const Rectangle& place = layout.panels[n];
    SlicePanel panel(picture, place, *volume.geometry, slice);
    panel.show(volume, options.window);
    for (const Overlay& overlay : parts[n].overlays) panel.lay_over(overlay);
    if (options.plain) continue;
    draw_letters(lettering, place, slice);
    const std::string name = std::string(kNames[static_cast<int>(slice.plane)]) + ", " + "ijk"[slice.normal_axis] +
                             "=" + std::to_string(slice.voxel);
    if (place.width >= lettering.width(name))
      lettering.write(place.x, place.y - 2 * lettering.line(), name, kFaintColour);
  }
  if (options.plain) return picture;
  const std::vector<Overlay>& overlays = parts.front().overlays;
  const int line = lettering.line();
  lettering.write(line / 2, line / 2, lettering.cut(options.caption.title), kTextColour);
  int y = layout.height - line - line / 2;
  for (std::size_t n = overlays.size(); n-- > 0; y -= line)
    lettering.write(line / 2, y, lettering.cut(legend_of(overlays[n].kind)), kFaintColour);
  lettering.draw_bar(line / 2, y + line / 2, 1 / layout.pixels_per_mm);
  const std::string window = "W " + short_number(options.window.width) + " L " + short_number(options.window.level);
  lettering.write(layout.width - lettering.width(window) - line / 2, y, window, kFaintColour);
  return picture;
}

}  // namespace tetwarp
