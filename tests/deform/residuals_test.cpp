#include "deform/residuals.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deform/fields/formula.h"
#include "tests/support/fields.h"
#include "tests/support/run.h"

namespace tetwarp {
namespace {

using namespace test;

PullField inverse_of(const VertexField& field, const Geometry& grid) {
  PullField inverse{grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)))};
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field, Outside::background));
  resampler->resample(whole(grid), {}, {.inverse_mm = samples_of(inverse)});
  return inverse;
}

TEST(Residuals, OfAnExactInverseAreRoundingOneWayAndTheGridsTheOther) {
  Geometry grid = unit_grid({30, 28, 20});
  grid.spacing = {0.8, 0.9, 1.5};
  for (const std::int64_t cell : {1, 3}) {
    const VertexField field = twist(grid, 0.3, cell);
    const PullField inverse = inverse_of(field, grid);
    const Residuals there = forward_after_inverse(field, inverse), back = inverse_after_forward(field, inverse);
    std::uint64_t samples = 0;
    for (const glm::vec3& by : inverse.displacement) samples += !std::isnan(by.x);
    EXPECT_GT(samples, 10000U);
    EXPECT_LE(there.points, samples);
    EXPECT_GE(there.points, samples - 200);  // a place on the border may round to beyond it
    EXPECT_LT(there.largest, 1e-4);
    EXPECT_GT(back.points, 500U);
    EXPECT_LT(back.largest, cell == 1 ? 2e-3 : 0.2);
    EXPECT_GT(back.largest, there.largest);
    const Residuals one = forward_after_inverse(field, inverse, {.threads = 1});
    EXPECT_EQ(one.mean, there.mean);
    EXPECT_EQ(one.percentile_99, there.percentile_99);
  }
}

TEST(Residuals, TellWhatIsWrongAndHowOften) {
  const Geometry grid = unit_grid({20, 10, 10});
  const VertexField field = uniform_field(grid, {2, 0, 0});
  PullField inverse = inverse_of(field, grid);
  EXPECT_EQ(forward_after_inverse(field, inverse).largest, 0);
  EXPECT_EQ(inverse_after_forward(field, inverse).largest, 0);
  // Half a millimetre off everywhere, 3 mm in 30 of 1800 samples: those are more than one in a hundred.
  std::size_t seen = 0;
  for (glm::vec3& by : inverse.displacement) {
    if (std::isnan(by.x)) continue;
    by.y += seen++ < 30 ? 3.0F : 0.5F;
  }
  ASSERT_EQ(seen, 1800U);
  const Residuals there = forward_after_inverse(field, inverse);
  EXPECT_EQ(there.largest, 3);
  EXPECT_NEAR(there.percentile_99, 3, 0.03);
  const double inside = static_cast<double>(there.points);  // those that a shift takes beyond the lattice are not told
  EXPECT_NEAR(there.mean, 0.5 + 2.5 * 30 / inside, 0.01);
  EXPECT_GT(inverse_after_forward(field, inverse).points, 1000U);
}

TEST(Residuals, LeaveOutWhatHasNoInverse) {
  const Geometry grid = unit_grid({8, 8, 8});
  const VertexField field = uniform_field(grid, {0, 0, 0});
  const PullField none{grid, std::vector<glm::vec3>(512, glm::vec3(NAN))};
  EXPECT_EQ(forward_after_inverse(field, none).points, 0U);
  EXPECT_EQ(inverse_after_forward(field, none).points, 0U);
  EXPECT_EQ(inverse_after_forward(field, none).percentile_99, 0);
}

}  // namespace
}  // namespace tetwarp
