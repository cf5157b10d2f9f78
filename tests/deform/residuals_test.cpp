// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/residuals.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deform/field_quality.h"
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

void expect_same(const Residuals& expected, const Residuals& found) {
  EXPECT_EQ(expected.points, found.points);
  EXPECT_EQ(expected.mean, found.mean);
  EXPECT_EQ(expected.percentile_99, found.percentile_99);
  EXPECT_EQ(expected.largest, found.largest);
}

/// Slices of an inverse, in memory that ends with them.
void add_slices(InverseCheck& check, const PullField& inverse, std::int64_t begin, std::int64_t end) {
  const std::int64_t area = inverse.grid.size.x * inverse.grid.size.y;
  const std::vector<glm::vec3> held(inverse.displacement.begin() + begin * area,
                                    inverse.displacement.begin() + end * area);
  Region region = whole(inverse.grid);
  region.begin.z = begin;
  region.end.z = end;
  check.add({&inverse.grid, region, VoxelType::f32, 3, std::as_bytes(std::span(held)).data()});
}

TEST(InverseCheck, SlabsGiveTheNumbersOfTheWholeInverse) {
  Geometry grid = unit_grid({30, 28, 33});
  grid.spacing = {0.8, 0.9, 1.5};
  // A lattice of its own: finer along k, beyond the grid, and turned, so that each of its slices reaches many slabs.
  VertexField turned = uniform_field(unit_grid({30, 28, 40}), {0, 0, 0.25F});
  turned.lattice.direction = glm::dmat3(1, 0, 0, 0, 0, 1, 0, -1, 0);
  turned.lattice.origin = {-2, 34, 3};
  for (const VertexField& field :
       {twist(grid, 0.3, 1), uniform_field(grid, {0.5F, 0, 7.25F}), uniform_field(grid, {0, 0, 0}), turned}) {
    const PullField inverse = inverse_of(field, grid);
    const Residuals there = forward_after_inverse(field, inverse), back = inverse_after_forward(field, inverse);
    EXPECT_GT(there.points, 5000U);
    EXPECT_GT(back.points, 5000U);
    for (const std::int64_t step : {1, 2, 7, 32, 33}) {
      InverseCheck check(field, grid);
      for (std::int64_t k = 0; k < 33; k += step) add_slices(check, inverse, k, std::min<std::int64_t>(k + step, 33));
      expect_same(there, check.forward_after_inverse());
      const Residuals found = check.inverse_after_forward();
      EXPECT_EQ(back.points, found.points) << step;
      EXPECT_EQ(back.percentile_99, found.percentile_99) << step;
      EXPECT_EQ(back.largest, found.largest) << step;
      EXPECT_NEAR(back.mean, found.mean, 1e-12 * back.mean) << step;
    }
  }
}

TEST(InverseCheck, FindsWhatIsWrongInAnySlice) {
  const Geometry grid = unit_grid({12, 10, 9});
  const VertexField field = uniform_field(grid, {0, 0, 0.5F});
  for (std::int64_t wrong = 1; wrong < 9; ++wrong) {
    PullField inverse = inverse_of(field, grid);
    for (std::int64_t n = 0; n < 120; ++n) inverse.displacement[static_cast<std::size_t>(wrong * 120 + n)].y += 1;
    InverseCheck check(field, grid);
    for (std::int64_t k = 0; k < 9; k += 3) add_slices(check, inverse, k, k + 3);
    EXPECT_EQ(check.forward_after_inverse().largest, 1) << wrong;
    EXPECT_EQ(check.inverse_after_forward().largest, 0.5) << wrong;
  }
}

TEST(InverseCheck, TakesEachSliceOnceAndInOrder) {
  const Geometry grid = unit_grid({8, 7, 6});
  const VertexField field = uniform_field(grid, {0, 0, 0});
  const PullField inverse = inverse_of(field, grid);
  InverseCheck check(field, grid);
  add_slices(check, inverse, 0, 2);
  EXPECT_THROW(add_slices(check, inverse, 0, 2), InputError);
  EXPECT_THROW(add_slices(check, inverse, 3, 4), InputError);
  EXPECT_EQ(check.forward_after_inverse().points, 8U * 7 * 2);
  EXPECT_EQ(check.inverse_after_forward().points, 8U * 7);  // those on slice 1 belong to the cells between 1 and 2
  add_slices(check, inverse, 2, 6);
  EXPECT_EQ(check.inverse_after_forward().points, 8U * 7 * 6);
}

TEST(RoundTrip, OfFewSlicesIsThatOfTheWholeInverse) {
  Geometry grid = unit_grid({30, 28, 16});
  grid.spacing = {0.8, 0.9, 1.5};
  const VertexField field = twist(grid, 0.3, 1);
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field));
  const RoundTrip trip = measure_round_trip(*resampler, field);
  EXPECT_EQ(trip.slices, 16U);
  EXPECT_EQ(trip.voxels, 30U * 28 * 16);
  EXPECT_EQ(trip.step_mm, 1.5 / 4096);
  const PullField inverse = inverse_of(field, grid);
  expect_same(forward_after_inverse(field, inverse), trip.forward_after_inverse);
  expect_same(inverse_after_forward(field, inverse), trip.inverse_after_forward);
  const RoundTrip one = measure_round_trip(*resampler, field, {.threads = 1});
  expect_same(one.forward_after_inverse, trip.forward_after_inverse);
  expect_same(one.inverse_after_forward, trip.inverse_after_forward);
}

TEST(RoundTrip, OfManySlicesIsOfEightPairsAllAlong) {
  const Geometry grid = unit_grid({6, 5, 81});
  const VertexField field = uniform_field(grid, {0, 0, 0});
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field));
  const RoundTrip trip = measure_round_trip(*resampler, field);
  EXPECT_EQ(trip.slices, 16U);
  EXPECT_EQ(trip.voxels, 6U * 5 * 16);
  EXPECT_EQ(trip.forward_after_inverse.points, trip.voxels);
  EXPECT_EQ(trip.inverse_after_forward.points, trip.voxels);  // a vertex on each voxel
  EXPECT_EQ(trip.inverse_after_forward.largest, 0);
  // Vertices halfway between slices: those of the eight pairs alone have both.
  const VertexField half = uniform_field(grid, {0, 0, 0.5F});
  resampler->set_field(view(half));
  EXPECT_EQ(measure_round_trip(*resampler, half).inverse_after_forward.points, 6U * 5 * 8);
}

/// Hands on what another makes, its inverse half a millimetre off along x in one slice.
class Astray final : public ForwardResampler {
 public:
  Astray(std::unique_ptr<ForwardResampler> right, std::int64_t slice)
      : ForwardResampler(right->output()), right_(std::move(right)), slice_(slice) {}
  void set_field(const FieldView& field, const FieldOptions& options, const Control& control) override {
    right_->set_field(field, options, control);
  }
  Region source_region(const Geometry& source, Region region) const override {
    return right_->source_region(source, region);
  }
  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override {
    const Report report = right_->resample(region, targets, maps, control, finished);
    if (slice_ < region.begin.z || slice_ >= region.end.z) return report;
    const std::int64_t area = output().size.x * output().size.y;
    auto* by =
        reinterpret_cast<glm::vec3*>(maps.inverse_mm.voxels) + (slice_ - maps.inverse_mm.buffered.begin.z) * area;
    for (std::int64_t n = 0; n < area; ++n) by[n].x += 0.5F;
    return report;
  }

 private:
  std::unique_ptr<ForwardResampler> right_;
  std::int64_t slice_;
};

TEST(RoundTrip, FindsAnInverseThatIsWrong) {
  const Geometry grid = unit_grid({12, 10, 81});
  const VertexField field = uniform_field(grid, {0, 0, 0});
  // Slices 5 and 6 are the first pair.
  for (const std::int64_t slice : {5, 6}) {
    auto right = make_cpu_resampler(grid);
    right->set_field(view(field));
    Astray wrong(std::move(right), slice);
    const RoundTrip trip = measure_round_trip(wrong, field);
    EXPECT_EQ(trip.forward_after_inverse.largest, 0.5);
    EXPECT_EQ(trip.inverse_after_forward.largest, 0.5);
    // One of 16 slices; what leads beyond the lattice is not told.
    EXPECT_NEAR(trip.inverse_after_forward.mean, 0.5 / 16, 1e-12);
    EXPECT_EQ(trip.forward_after_inverse.points, trip.voxels - 10);
    Report report;
    report.covered = trip.voxels;
    EXPECT_NE(verdict(report, measure_quality(field), trip).find("the inverse leads up to 0.5 mm beside a voxel"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace tetwarp
