// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Geometry through a DICOM series, for every way in which a stack of slices can lie along the patient's axes.
#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

std::string numbers(const glm::dvec3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "%.10g\\%.10g\\%.10g", v.x, v.y, v.z);
  return text;
}

void write_on_grid(const std::filesystem::path& folder, const Geometry& grid) {
  const AffineMap point = point_from_index(grid);
  write_stack(folder, static_cast<int>(grid.size.z), [&](int k, MadeSlice& slice) {
    slice.columns = static_cast<int>(grid.size.x);
    slice.rows = static_cast<int>(grid.size.y);
    slice.position = numbers(point({0, 0, k}));
    slice.orientation = numbers(grid.direction[0]) + "\\" + numbers(grid.direction[1]);
    char spacing[64];
    std::snprintf(spacing, sizeof spacing, "%.10g\\%.10g", grid.spacing.y, grid.spacing.x);
    slice.spacing = spacing;
    for (int n = 0; n < slice.rows * slice.columns; ++n)
      slice.words.push_back(static_cast<std::uint16_t>(n * 31 + k * 7));
  });
}

TEST(DicomOrientation, GeometrySurvivesTheSeriesInAll24OrientationsOfAStack) {
  int stacks = 0;
  for (const Geometry& grid : all_orientations()) {
    if (glm::determinant(grid.direction) < 0) continue;  // k of a series is row x column: no mirrored stack exists
    ++stacks;
    SCOPED_TRACE(orientation_code(grid));
    const Scratch scratch;
    write_on_grid(scratch / "source", grid);
    const DicomScan scan = scan_dicom(scratch / "source");
    ASSERT_EQ(scan.series.size(), 1u);
    ASSERT_FALSE(scan.series[0].refusal) << *scan.series[0].refusal;
    const DicomVolume source = load_dicom(scan.series[0]);
    EXPECT_TRUE(same_grid(source.volume.geometry, grid, 1e-4));
    EXPECT_EQ(orientation_code(source.volume.geometry), orientation_code(grid));

    std::filesystem::create_directory(scratch / "derived");
    DicomDerivation derivation;
    derivation.field_sha256 = std::string(64, '0');
    derivation.parameters = "interpolation=linear";
    derivation.description = "Deformed";
    const std::vector<SliceRange> sampled(static_cast<std::size_t>(grid.size.z), {0, grid.size.z - 1});
    write_derived_series(scratch / "derived", view(source.volume), *source.headers, derivation, sampled);
    const DicomVolume derived = load_dicom(scan_dicom(scratch / "derived").series.at(0));
    EXPECT_TRUE(same_grid(derived.volume.geometry, grid, 1e-4));
    EXPECT_TRUE(derived.volume.voxels == source.volume.voxels);
  }
  EXPECT_EQ(stacks, 24);
}

}  // namespace
