// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// B-splines of plastimatch: by closed form, and a real registration beside its own dense field.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "io/field_file.h"
#include "io/transform_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

constexpr int kSize[3] = {6, 6, 5};  // coefficients: 30, 24 and 10 voxels in regions of 10, 10 and 8

/// Turned by a quarter about z, region of interest from voxel (2, 1, 0); one coefficient is moved by (3, 5, 7) mm.
std::string spline_text(const std::string& dim = "30 24 10") {
  std::string text =
      "MGH_GPUIT_BSP <experimental>\nimg_origin = -20.0 10.0 5.0\nimg_spacing = 2.0 1.5 2.5\nimg_dim = 40 30 20\n"
      "roi_offset = 2 1 0\nroi_dim = " +
      dim + "\nvox_per_rgn = 10 10 8\ndirection_cosines = 0 -1 0 1 0 0 0 0 1\n";
  for (int axis = 0; axis < 3; ++axis) {
    for (int n = 0; n < kSize[0] * kSize[1] * kSize[2]; ++n)
      text += n == 2 + kSize[0] * (3 + kSize[1] * 2) ? std::to_string(3 + 2 * axis) + ".0\n" : "0.0\n";
  }
  return text;
}

TEST(PlastimatchSpline, TheMovedCoefficientIsWhereItsRegionBegins) {
  const Scratch scratch;
  write_file(scratch / "bspline.txt", spline_text());
  const TransformFile file = read_transform_file(scratch / "bspline.txt");
  EXPECT_EQ(file.tool, "plastimatch");
  EXPECT_EQ(file.direction, Direction::pull);
  EXPECT_EQ(file.parameters, 3U * 6 * 6 * 5);
  // Coefficient (2, 3, 2) is at voxel roi_offset + (index - 1) regions = (12, 21, 8).
  const glm::dvec3 centre =
      glm::dvec3(-20, 10, 5) + glm::dvec3(0, 1, 0) * 24.0 + glm::dvec3(-1, 0, 0) * 31.5 + glm::dvec3(0, 0, 1) * 20.0;
  EXPECT_LT(glm::distance(file.displacement(centre), glm::dvec3(3, 5, 7) * (8.0 / 27)), 1e-5);
  EXPECT_LT(glm::distance(file.displacement(centre + glm::dvec3(0, 20, 0)), glm::dvec3(3, 5, 7) * (2.0 / 27)), 1e-5);
  EXPECT_EQ(*file.outside, 0U);
}

TEST(PlastimatchSpline, BadFilesAreRefused) {
  const Scratch scratch;
  const std::string whole = spline_text();
  const std::vector<std::pair<std::string, std::string>> cases = {
      {whole.substr(0, whole.size() - 4), "its grid needs"},
      {whole + "1.0\n", "its grid needs"},
      {whole + "nan\n", "parameter 540 is nan"},
      {whole + "what\n", "\"what\" where a number is expected"},
      {whole.substr(0, whole.find("img_spacing")), "no img_spacing"},
      {spline_text("3000000000 3000000000 3000000000"), "its grid needs"},
      {spline_text("30 24"), "2 values of roi_dim"}};
  for (const auto& [text, why] : cases) {
    write_file(scratch / "bad.txt", text);
    EXPECT_TRUE(says(refusal([&] { read_transform_file(scratch / "bad.txt"); }), {"InputError", "bad.txt", why}));
  }
}

TEST(PlastimatchSpline, RealSplineIsTheDenseFieldThatPlastimatchMadeOfIt) {
  TETWARP_REAL_DATA(folder, "lung-4dct-t0-t5");
  const TransformFile spline = read_transform_file(folder / "bspline_t5_to_t0.txt");
  const PullField dense = read_pull_field(folder / "dvf_t5_to_t0_4mm.mha");
  const AffineMap place = point_from_index(dense.grid);
  double furthest = 0, off = 0;
  std::size_t n = 0;
  for (std::int64_t k = 0; k < dense.grid.size.z; ++k) {
    for (std::int64_t j = 0; j < dense.grid.size.y; ++j) {
      for (std::int64_t i = 0; i < dense.grid.size.x; ++i) {
        const glm::dvec3 expected(dense.displacement[n++]), by = spline.displacement(place(glm::dvec3(i, j, k)));
        furthest = std::max(furthest, glm::length(by));
        off = std::max({off, std::abs(by.x - expected.x), std::abs(by.y - expected.y), std::abs(by.z - expected.z)});
      }
    }
  }
  RecordProperty("largest_difference_mm", std::to_string(off));
  EXPECT_LT(off, 1.0 / 512);  // the dense field is rounded to this
  EXPECT_NEAR(furthest, 22.83, 0.01);
  EXPECT_EQ(*spline.outside, 0U);
}

}  // namespace
}  // namespace tetwarp
