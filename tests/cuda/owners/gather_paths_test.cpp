// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Every way that the CUDA backend may take, against the CPU, bit for bit.
#include <gtest/gtest.h>

#include <functional>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/fields/formula.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

class GatherPaths : public testing::Test {
 protected:
  void SetUp() override {
    if (device_count() == 0) GTEST_SKIP() << "no CUDA device";
  }
};

/// The volume alone is found and sampled in one go; with coverage and inverse it is found, then sampled; for all maps
/// every tetrahedron is rasterised.
enum class Wanted { volume, places, everything };

template <class V>
Outcome<V> run_on(ForwardResampler& resampler, const FieldCase& test, const Volume<V>& source, const Region& region,
                  Wanted what) {
  resampler.set_field(view(test.field, Outside::background), {.jacobian_range = what != Wanted::volume});
  Outcome<V> outcome = poisoned_outcome<V>(test.output);
  Maps wanted = maps_of(outcome);
  if (what == Wanted::places) wanted.jacobian = wanted.owners = wanted.tetrahedra = {};
  if (what == Wanted::volume) wanted = {};
  const Target target{.source = view(source), .output = view(outcome.output), .background = 7};
  outcome.report = resampler.resample(region, {&target, 1}, wanted);
  return outcome;
}

/// Three volumes of different types at once, one of them labels, through the field that both have.
template <class V>
void expect_same_volumes(Resampler& cpu, Resampler& cuda, const Volume<V>& source, const Region& region,
                         Random& random) {
  const Geometry& grid = source.geometry;
  const auto labels = random_values<std::uint8_t>(grid, random, 3, 5);
  const auto other = random_values<std::uint16_t>(grid, random, 0, 65535);
  Outcome<V> outputs[2] = {poisoned_outcome<V>(grid), poisoned_outcome<V>(grid)};
  Outcome<std::uint8_t> voted[2] = {poisoned_outcome<std::uint8_t>(grid), poisoned_outcome<std::uint8_t>(grid)};
  Outcome<std::uint16_t> others[2] = {poisoned_outcome<std::uint16_t>(grid), poisoned_outcome<std::uint16_t>(grid)};
  Report reports[2];
  for (const int n : {0, 1}) {
    const Target targets[] = {{.source = view(source), .output = view(outputs[n].output), .background = 7},
                              {.source = view(labels),
                               .output = view(voted[n].output),
                               .interpolation = Interpolation::vote,
                               .background = 1},
                              {.source = view(other), .output = view(others[n].output), .background = 9}};
    reports[n] = (n == 0 ? cpu : cuda).resample(region, targets);
  }
  ASSERT_TRUE(same_bits(outputs[0].output.voxels, outputs[1].output.voxels));
  ASSERT_TRUE(same_bits(voted[0].output.voxels, voted[1].output.voxels)) << "labels";
  ASSERT_TRUE(same_bits(others[0].output.voxels, others[1].output.voxels)) << "the third volume";
  ASSERT_EQ(reports[0].covered, reports[1].covered);
  ASSERT_EQ(reports[0].uncovered, reports[1].uncovered);
}

template <class V>
void expect_same(const FieldCase& test, Random& random) {
  const Volume<V> source =
      random_values<V>(test.output, random, std::numeric_limits<V>::lowest(), std::numeric_limits<V>::max());
  const auto cpu = make_cpu_resampler(test.output);
  const auto cuda = make_forward_resampler(BackendKind::cuda, test.output);
  const glm::i64vec3 size = test.output.size;
  const Region part{{random.integer(0, size.x / 3), random.integer(0, size.y / 3), random.integer(0, size.z / 3)},
                    {size.x - random.integer(0, size.x / 3), size.y - random.integer(0, size.y / 3), size.z}};
  for (const Wanted what : {Wanted::volume, Wanted::places, Wanted::everything}) {
    for (const Region& region : {whole(test.output), part}) {
      const auto expected = run_on<V>(*cpu, test, source, region, what);
      const auto found = run_on<V>(*cuda, test, source, region, what);
      ASSERT_TRUE(same_bits(expected.output.voxels, found.output.voxels)) << "maps " << static_cast<int>(what);
      ASSERT_TRUE(same_bits(expected.coverage.voxels, found.coverage.voxels));
      ASSERT_TRUE(same_bits(expected.inverse_mm.voxels, found.inverse_mm.voxels));
      ASSERT_TRUE(same_bits(expected.jacobian.voxels, found.jacobian.voxels));
      ASSERT_TRUE(same_bits(expected.owners.voxels, found.owners.voxels));
      ASSERT_EQ(expected.report.covered, found.report.covered);
      ASSERT_EQ(expected.report.uncovered, found.report.uncovered);
      ASSERT_EQ(expected.report.inverted, found.report.inverted);
      ASSERT_EQ(expected.report.degenerate, found.report.degenerate);
      if (what == Wanted::volume) continue;  // signs are known without the range
      ASSERT_EQ(expected.report.jacobian_min, found.report.jacobian_min);
      ASSERT_EQ(expected.report.jacobian_max, found.report.jacobian_max);
    }
  }
  ASSERT_NO_FATAL_FAILURE(expect_same_volumes(*cpu, *cuda, source, part, random));
}

TEST_F(GatherPaths, RandomFieldsWithAndWithoutFolds) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < test_cases(200); ++n) {
    Random random(test_seed(), 5000 + n);
    const FieldCase test = n % 2 == 0 ? random_injective_case(random) : random_folding_case(random);
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    if (n % 4 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_same<std::uint8_t>(test, random));
    }
    if (n % 4 == 2) {
      ASSERT_NO_FATAL_FAILURE(expect_same<std::uint16_t>(test, random));
    }
  }
}

TEST_F(GatherPaths, FormulasOnCellsOfAnySize) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({130, 70, 75});
  for (const char* formula : {"identity", "wave:amplitude=5,wavelength=40", "twist:angle=40",
                              "bubble:radius=30,strength=0.9", "translate:by=3/0/0.5", "bubble-paper:shift=6",
                              "bubble-paper:shift=-6", "wave:amplitude=9,wavelength=30,along=x"}) {
    for (const std::int64_t cell_size : {1, 2, 4, 7, 16, 40}) {
      SCOPED_TRACE(std::string(formula) + ", cells of " + std::to_string(cell_size));
      Random random(test_seed(), static_cast<std::uint64_t>(cell_size));
      FieldCase test{grid, sample_on(lattice_over(grid, cell_size), parse_formula(formula, grid)), formula, {}};
      ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    }
  }
}

/// A finger is pulled out of a side of a small lattice, slantwise and without a fold, past neighbours at rest: voxels
/// there lie beside resting cells, but do not come from them.
TEST_F(GatherPaths, FingersBesideALatticeAtRest) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({100, 60, 70});
  Geometry lattice = unit_grid({31, 38, 51});
  lattice.origin = {35, 13, 10};
  for (const double side : {-1.0, 1.0}) {
    SCOPED_TRACE("side " + std::to_string(side));
    Random random(test_seed(), 970);
    const auto pull = [&](const glm::dvec3& x) {
      const double depth = (side < 0 ? x.x - 35 : 65 - x.x) / 8, width = std::abs(x.y - 20) / 9;
      if (depth >= 1 || width >= 1) return glm::dvec3(0);
      return (1 - depth) * (1 - width) * (1 - width) * glm::dvec3(side * 28, 13, 0);
    };
    const FieldCase test{grid, field_in_voxels(grid, lattice, pull), "finger", {}};
    const auto cpu = make_cpu_resampler(grid);
    const Outcome<std::int16_t> there = run_on<std::int16_t>(
        *cpu, test, random_values<std::int16_t>(grid, random, -1000, 1000), whole(grid), Wanted::everything);
    ASSERT_EQ(there.report.inverted, 0u);
    const std::int64_t beside = (30 * 60 + 31) * 100 + (side < 0 ? 13 : 87);
    ASSERT_EQ(there.owners.voxels[static_cast<std::size_t>(beside)], 1) << "the finger does not reach there";
    ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
  }
}

/// Undeformed places a little before a voxel, whose fraction is rounded to 1, between voxels of very different values.
template <class V>
void expect_same_before_voxels() {
  const Geometry grid = unit_grid({40, 40, 40});
  Random random(test_seed(), 1100);
  const auto steps = [&](const glm::dvec3&) {
    return glm::dvec3(2047 + random.integer(-8, 8), random.integer(0, 1), random.integer(0, 1)) * (1.0 / 4096);
  };
  const FieldCase test{grid, field_in_voxels(grid, lattice_over(grid, 1), steps), "steps", {}};
  Volume<V> source{grid, {}};
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
    const std::int64_t high = std::numeric_limits<V>::max(), low = std::numeric_limits<V>::lowest();
    source.voxels.push_back(
        static_cast<V>(n / 40 % 2 == 0 ? random.integer(low, low + 1) : random.integer(high - high / 12, high)));
  }
  const auto cpu = make_cpu_resampler(grid), cuda = make_forward_resampler(BackendKind::cuda, grid);
  const auto expected = run_on<V>(*cpu, test, source, whole(grid), Wanted::volume);
  const auto found = run_on<V>(*cuda, test, source, whole(grid), Wanted::volume);
  EXPECT_GT(found.report.paths.gathered, 60000u);
  EXPECT_TRUE(same_bits(expected.output.voxels, found.output.voxels));
}

TEST_F(GatherPaths, PlacesJustBeforeAVoxel) {
  SCOPED_TRACE(seed_text(test_seed()));
  expect_same_before_voxels<std::uint8_t>();
  expect_same_before_voxels<std::int16_t>();
  expect_same_before_voxels<std::uint16_t>();
}

/// Vertices are packed into 8 bytes: in halves of what they hold at first, in other parts, and not at all.
TEST_F(GatherPaths, FieldsThatMoveFar) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({600, 560, 3});
  const glm::dvec3 middle(299.5, 279.5, 1);
  const double third = 0.3 / 4096;  // of a step, so that vertices do not end at whole steps
  const std::function<glm::dvec3(glm::dvec3)> fields[] = {
      [](const glm::dvec3&) { return glm::dvec3(-255.5, 250, 0.25); },
      [&](const glm::dvec3&) { return glm::dvec3(-256 - third, 250, 0.25); },
      [&](const glm::dvec3&) { return glm::dvec3(256, -300.125 + third, third); },
      [&](const glm::dvec3& x) {  // half a turn, and a push
        return glm::dvec3(2.0 * (middle.x - x.x) - third, 2.0 * (middle.y - x.y), x.x < 50 ? 30.5 : 0.0);
      },
      [&](const glm::dvec3& x) { return glm::dvec3(300 + third, 16 * std::sin(x.x / 50) - third, third); },
      [&](const glm::dvec3& x) { return (x - middle) * glm::dvec3(2.9, 3.1, 70); },
  };
  for (const auto& field : fields) {
    SCOPED_TRACE("field " + std::to_string(&field - fields));
    for (const std::int64_t cell_size : {1, 4}) {
      Random random(test_seed(), 1000);
      const FieldCase test{grid, field_in_voxels(grid, lattice_over(grid, cell_size), field), "far", {}};
      ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    }
  }
}

/// Large cells: pressed together so that more tetrahedra reach a tile than are prepared at once, or than there is room
/// for; thrown about, so that many own a voxel; and on either side of the sizes that are rasterised.
TEST_F(GatherPaths, LargeCellsPressedTogether) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({133, 75, 91});
  const glm::dvec3 middle(60.3, 40.7, 45.1);
  constexpr double kThrown[] = {0.0, 0.1, 2.0};
  for (const double left : {0.6, 0.3, 0.0}) {
    for (const std::int64_t cell_size : {5, 8, 40, 41}) {
      SCOPED_TRACE("left " + std::to_string(left) + ", cells of " + std::to_string(cell_size));
      Random random(test_seed(), 1200 + static_cast<std::uint64_t>(cell_size));
      const double thrown = kThrown[random.integer(0, 2)] * static_cast<double>(cell_size);
      const auto press = [&](const glm::dvec3& x) {
        return (middle - x) * (1 - left) +
               thrown * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
      };
      const FieldCase test{grid, field_in_voxels(grid, lattice_over(grid, cell_size), press), "pressed", {}};
      ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    }
  }
  Random random(test_seed(), 1300);
  const auto press = [&](const glm::dvec3& x) { return (middle - x) * 0.8; };
  const FieldCase test{grid, field_in_voxels(grid, lattice_over(grid, 8), press), "pressed", {}};
  const auto cuda = make_forward_resampler(BackendKind::cuda, grid);
  const auto source = random_values<std::int16_t>(grid, random, -1000, 1000);
  const Paths paths = run_on<std::int16_t>(*cuda, test, source, whole(grid), Wanted::volume).report.paths;
  EXPECT_GT(paths.claimed, 0u) << "there was room for all";
  EXPECT_EQ(paths.gathered + paths.walked + paths.claimed, static_cast<std::uint64_t>(voxel_count(grid)));
}

TEST_F(GatherPaths, NoiseAndSharpTurns) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({100, 66, 70});
  for (const double amplitude : {0.01, 0.2, 0.6, 3.0}) {
    for (const std::int64_t cell_size : {1, 3, 8}) {
      Random random(test_seed(), 900 + static_cast<std::uint64_t>(cell_size));
      SCOPED_TRACE("noise of " + std::to_string(amplitude) + ", cells of " + std::to_string(cell_size));
      const auto noise = [&](const glm::dvec3&) {
        return amplitude * static_cast<double>(cell_size) *
               glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
      };
      const FieldCase test{grid, field_in_voxels(grid, lattice_over(grid, cell_size), noise), "noise", {}};
      ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    }
  }
  const Geometry cube = unit_grid({64, 64, 64});
  for (const int axis : {0, 1, 2}) {
    for (const double turn : {90.0, 180.0, 37.0}) {
      SCOPED_TRACE("rotation of " + std::to_string(turn) + " about " + std::to_string(axis));
      Random random(test_seed(), 950);
      glm::dvec3 about(0);
      about[axis] = 1;
      const glm::dmat3 r = rotation(about, turn * 3.14159265358979323846 / 180);
      const auto rotate = [&](const glm::dvec3& x) { return r * (x - 31.5) + 31.5 - x; };
      const FieldCase test{cube, field_in_voxels(cube, lattice_over(cube, 1), rotate), "rotation", {}};
      ASSERT_NO_FATAL_FAILURE(expect_same<std::int16_t>(test, random));
    }
  }
}

}  // namespace
}  // namespace tetwarp
