// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/preview.h"

#include <algorithm>
#include <string>

#include "io/pictures/preview_layout.h"
#include "io/pictures/text_raster.h"
#include "io/png.h"
#include "io/preview_scale.h"

namespace tetwarp {

namespace {

constexpr Colour kPaper = {28, 28, 32}, kFrame = {90, 90, 96}, kText = {235, 235, 235}, kFaint = {160, 160, 168},
                 kLetter = {255, 214, 64};
constexpr int kLine = kLineHeight * kTextScale;
constexpr const char* kRowNames[] = {"Before", "After", "Difference"};
constexpr const char* kPlaneNames[] = {"axial", "coronal", "sagittal"};

using Pixels = std::vector<double>;

void write_text(Picture& picture, int x, int y, std::string_view text, Colour colour = kText) {
  draw_text(picture, x, y, text, colour, kTextScale);
}

void frame(Picture& picture, const Rectangle& r) { picture.fill(r.x - 1, r.y - 1, r.width + 2, r.height + 2, kFrame); }

/// Draws the title and a line that says what the slices are.
void draw_header(Picture& picture, const PreviewLayout& layout, const Geometry& geometry, const std::string& title) {
  const int x = kLine / 2, y = kLine / 2;
  const auto fits = static_cast<std::size_t>((layout.width - 2 * x) / (kLetterWidth * kTextScale));
  write_text(picture, x, y, title.size() <= fits ? title : title.substr(0, fits - 3) + "...");
  std::string voxels = to_string(geometry.size) + " voxels, " + short_number(geometry.spacing.x) + " x " +
                       short_number(geometry.spacing.y) + " x " + short_number(geometry.spacing.z) +
                       " mm; middle slices";
  for (const Slice& slice : layout.slices) {
    voxels += std::string(" ") + "ijk"[slice.normal_axis] + "=" + std::to_string(slice.voxel);
  }
  write_text(picture, x, y + kLine, voxels.substr(0, fits), kFaint);
}

/// Draws one slice in its colours, its caption above, and the patient directions around it.
template <class ColourOf>
void draw_panel(Picture& picture, const Rectangle& panel, const Slice& slice, const std::string& caption,
                const Pixels& values, const ColourOf& colour_of) {
  frame(picture, panel);
  auto value = values.begin();
  for (int y = 0; y < panel.height; ++y) {
    for (int x = 0; x < panel.width; ++x) picture.set(panel.x + x, panel.y + y, colour_of(*value++));
  }
  constexpr int kLetterSize = kLetterWidth * kTextScale;
  const int middle_x = panel.x + (panel.width - kLetterSize) / 2, middle_y = panel.y + panel.height / 2 - kLine / 2;
  const auto letter = [&](int x, int y, char direction) { write_text(picture, x, y, {&direction, 1}, kLetter); };
  letter(panel.x - kLetterSize - 3, middle_y, slice.right.begin);
  letter(panel.x + panel.width + 5, middle_y, slice.right.end);
  letter(middle_x, panel.y - kLine, slice.down.begin);
  letter(middle_x, panel.y + panel.height + 4, slice.down.end);
  const int caption_x = panel.x + (panel.width - text_width(caption, kTextScale)) / 2;
  write_text(picture, caption_x, panel.y - 2 * kLine, caption);
}

/// Draws a legend: a bar from `high` at the top to `low` at the bottom with numbers beside it, and lines of text below.
template <class ColourOf>
void draw_legend(Picture& picture, const Rectangle& place, const std::vector<double>& numbers,
                 const std::vector<std::string>& lines, const ColourOf& colour_of) {
  constexpr int kBarWidth = 18, kMostBar = 200;
  const int text_height = kLine * static_cast<int>(lines.size());
  const Rectangle bar{place.x, place.y + kLine / 2, kBarWidth,
                      std::clamp(place.height - text_height - kLine, 40, kMostBar)};
  const double high = numbers.front(), low = numbers.back();
  frame(picture, bar);
  for (int y = 0; y < bar.height; ++y) {
    const double value = high + (low - high) * y / (bar.height - 1);
    picture.fill(bar.x, bar.y + y, bar.width, 1, colour_of(value));
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const int y = bar.y + static_cast<int>(i) * (bar.height - 1) / static_cast<int>(numbers.size() - 1);
    picture.fill(bar.x + bar.width, y, 4, 1, kText);
    write_text(picture, bar.x + bar.width + 8, y - kLine / 2 + 3, short_number(numbers[i]));
  }
  int y = bar.y + bar.height + kLine / 2;
  for (const std::string& line : lines) {
    write_text(picture, place.x, y, line);
    y += kLine;
  }
}

void draw_scale_bar(Picture& picture, const PreviewLayout& layout) {
  constexpr double kMostPixels = 240;
  const double length_mm = round_down_125(kMostPixels / layout.pixels_per_mm);
  const int length = static_cast<int>(length_mm * layout.pixels_per_mm + 0.5), x = kLine,
            y = layout.footer_y + kLine / 2;
  picture.fill(x, y - 1, length, 3, kText);
  for (const int end : {x, x + length - 1}) picture.fill(end, y - 6, 1, 13, kText);
  write_text(picture, x + length + 10, y - kLine / 2 + 2, short_number(length_mm) + " mm");
}

/// What the three rows of panels show: before, after, and after minus before.
struct Samples {
  std::array<std::array<Pixels, PreviewLayout::kColumns>, PreviewLayout::kRows> rows;
  Pixels all(std::size_t row) const {
    Pixels joined;
    for (const Pixels& pixels : rows[row]) joined.insert(joined.end(), pixels.begin(), pixels.end());
    return joined;
  }
};

Samples sample(const PreviewLayout& layout, const ConstVolumeView& before, const ConstVolumeView& after) {
  Samples samples;
  for (std::size_t column = 0; column < layout.slices.size(); ++column) {
    const Rectangle& panel = layout.panels[0][column];
    samples.rows[0][column] = sample_slice(before, layout.slices[column], panel.width, panel.height);
    samples.rows[1][column] = sample_slice(after, layout.slices[column], panel.width, panel.height);
    Pixels& difference = samples.rows[2][column];
    for (std::size_t i = 0; i < samples.rows[0][column].size(); ++i) {
      difference.push_back(samples.rows[1][column][i] - samples.rows[0][column][i]);
    }
  }
  return samples;
}

void draw_rows(Picture& picture, const PreviewLayout& layout, const Samples& samples, const Window& window,
               const DifferenceScale& scale) {
  for (std::size_t row = 0; row < layout.panels.size(); ++row) {
    for (std::size_t column = 0; column < layout.slices.size(); ++column) {
      const std::string caption = std::string(kRowNames[row]) + ", " + kPlaneNames[column];
      const auto draw = [&](const auto& colours) {
        draw_panel(picture, layout.panels[row][column], layout.slices[column], caption, samples.rows[row][column],
                   colours);
      };
      row == 2 ? draw(scale) : draw(window);
    }
  }
  const double half = 0.5 * window.width;
  std::vector<std::string> grey = {"W " + short_number(window.width), "L " + short_number(window.level)};
  std::vector<std::string> colour = {"after minus", "before", scale.none ? "no change" : ""};
  if (window.hounsfield) grey.push_back("HU"), colour[1] += ", HU";
  for (const std::size_t row : {0u, 1u}) {
    draw_legend(picture, layout.legends[row], {window.level + half, window.level - half}, grey, window);
  }
  draw_legend(picture, layout.legends[2], {scale.range, 0, -scale.range}, colour, scale);
}

}  // namespace

void write_preview(const std::filesystem::path& path, const ConstVolumeView& before, const ConstVolumeView& after,
                   const std::string& title) {
  const Geometry &grid = *before.geometry, &other = *after.geometry;
  require_valid(grid, "preview");
  const double tolerance_mm = 0.01 * std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z});
  require(same_grid(grid, other, tolerance_mm), "a preview needs two volumes on one grid, found " +
                                                    to_string(grid.size) + " and " + to_string(other.size) +
                                                    " voxels or another place; compare them on one grid");
  const PreviewLayout layout = layout_preview(grid);
  const Samples samples = sample(layout, before, after);
  const Window window = choose_window(samples.all(0), before.type);
  const DifferenceScale scale = choose_difference_scale(samples.all(2), window.hounsfield);
  Picture picture(layout.width, layout.height, kPaper);
  draw_header(picture, layout, grid, title);
  draw_rows(picture, layout, samples, window, scale);
  draw_scale_bar(picture, layout);
  write_png(path, picture);
}

}  // namespace tetwarp
