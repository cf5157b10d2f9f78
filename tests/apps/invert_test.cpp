// `tetwarp invert`: the inverse of a forward field, as other programs want it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

TEST(Invert, WritesTheKnownInverseOfATwist) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Outcome run =
      run_tetwarp(scratch.path(), "invert twist:angle=30 --like in.mha -o inverse.mha --report report.json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("forward after inverse"), std::string::npos) << run.err;
  EXPECT_TRUE(read_field_header(scratch / "inverse.mha").direction == FieldDirection::pull);
  const AnyVolume inverse = read_image(scratch / "inverse.mha");
  const Geometry& grid = inverse.geometry();
  const PointMap known = parse_formula("twist:angle=-30", grid);
  std::uint64_t empty = 0;
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
    const float* by = inverse.as<float>().data() + 3 * n;
    empty += std::isnan(by[0]);
    if (std::isnan(by[0])) continue;
    const glm::dvec3 index(n % 40, n / 40 % 36, n / (40 * 36));
    const glm::dvec3 expected = known(point_from_index(grid)(index));
    for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(by[axis], expected[axis], 2e-3) << n;
  }
  const nlohmann::json report = nlohmann::json::parse(read_text(scratch / "report.json"));
  EXPECT_EQ(report["uncovered"], empty);
  EXPECT_GT(empty, 0U);
  EXPECT_LT(report["forward_after_inverse"]["largest_mm"], 1e-4);
  EXPECT_LT(report["inverse_after_forward"]["largest_mm"], 5e-3);
  EXPECT_GT(report["inverse_after_forward"]["points"], 10000);
}

TEST(Invert, SaysWhereTheFieldFolds) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 20,18,12 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Outcome run =
      run_tetwarp(scratch.path(), "invert wave:amplitude=40,wavelength=60,along=x --like in.mha -o inverse.nii.gz");
  EXPECT_EQ(run.status, 0);
  EXPECT_NE(run.err.find("folds"), std::string::npos) << run.err;
  EXPECT_EQ(run_tetwarp(scratch.path(), "invert identity --like in.mha -o inverse.txt").status, 2);
  EXPECT_EQ(run_tetwarp(scratch.path(), "invert identity --like in.mha -o in.mha --overwrite").status, 2);
}

}  // namespace
