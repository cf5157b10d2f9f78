// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Volumes and fields larger than the device may hold: the same bits and the same report, whatever the limit.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <cmath>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/fields/formula.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

class MemoryLimit : public testing::Test {
 protected:
  void SetUp() override {
    if (device_count() == 0) GTEST_SKIP() << "no CUDA device";
  }
};

constexpr std::uint64_t kWorkingSpace = 128'000'000;  // memory that comes on top of a limit

std::uint64_t free_bytes() {
  std::size_t free = 0, total = 0;
  EXPECT_EQ(cudaMemGetInfo(&free, &total), cudaSuccess);
  return free;
}

std::uint64_t field_bytes(const VertexField& field) { return field.displacement.size() * sizeof(glm::vec3); }

/// The outputs that a call fills.
struct Wanted {
  Outside outside = Outside::background;
  Interpolation interpolation = Interpolation::linear;
  bool maps = false, all_maps = false, slices = false;
};

template <class V>
struct Result {
  Outcome<V> outcome;
  std::vector<SliceRange> slices;
};

template <class V>
Result<V> run_limited(Resampler& resampler, const Volume<V>& source, const Region& region, const Wanted& wanted) {
  const Geometry& grid = resampler.output();
  Result<V> result{poisoned_outcome<V>(grid), std::vector<SliceRange>(wanted.slices ? grid.size.z : 0)};
  Maps maps = maps_of(result.outcome);
  if (!wanted.all_maps) maps.jacobian = maps.owners = maps.tetrahedra = {};
  if (!wanted.maps) maps = {};
  const Target target{.source = view(source),
                      .output = view(result.outcome.output),
                      .interpolation = wanted.interpolation,
                      .background = 7,
                      .sampled_slices = result.slices};
  result.outcome.report = resampler.resample(region, {&target, 1}, maps);
  return result;
}

template <class V>
void expect_same(const Result<V>& expected, const Result<V>& found) {
  expect_same_outcome(expected.outcome, found.outcome);
  expect_same_report(expected.outcome.report, found.outcome.report);
  ASSERT_EQ(expected.slices.size(), found.slices.size());
  for (std::size_t k = 0; k < found.slices.size(); ++k) {
    EXPECT_EQ(expected.slices[k].first, found.slices[k].first) << "slice " << k;
    EXPECT_EQ(expected.slices[k].last, found.slices[k].last) << "slice " << k;
  }
}

/// Runs a field under ever smaller limits until not even a slice fits. @return how many limits smaller than the field
/// worked
template <class V>
int expect_same_under_limits(const Geometry& grid, const VertexField& field, const Volume<V>& source,
                             const Region& region, const Wanted& wanted) {
  const auto cpu = make_cpu_resampler(grid);
  cpu->set_field(view(field, wanted.outside));
  const auto expected = run_limited(*cpu, source, region, wanted);
  const std::uint64_t all = field_bytes(field) + 2 * source.voxels.size() * sizeof(V);
  int streamed = 0;
  for (double share = 4; share > 0.001; share *= 0.6) {
    const auto limit = static_cast<std::uint64_t>(share * static_cast<double>(all));
    SCOPED_TRACE("limit " + std::to_string(limit) + " of " + std::to_string(all));
    const auto cuda = make_forward_resampler(BackendKind::cuda, grid, 0, {.memory = limit});
    try {
      cuda->set_field(view(field, wanted.outside));
      expect_same(expected, run_limited(*cuda, source, region, wanted));
      expect_same(expected, run_limited(*cuda, source, region, wanted));  // and again, with what is held now
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find("are allowed"), std::string::npos) << error.what();
      break;
    }
    streamed += limit < field_bytes(field);
    if (testing::Test::HasFailure()) break;
  }
  return streamed;
}

const Wanted kWanted[] = {{},
                          {.interpolation = Interpolation::cubic, .slices = true},
                          {.maps = true},
                          {.maps = true, .all_maps = true},
                          {.outside = Outside::rest, .maps = true, .all_maps = true},
                          {.outside = Outside::rest, .interpolation = Interpolation::nearest}};

TEST_F(MemoryLimit, ChangesNoBitOfStructuredFields) {
  const Geometry grid = unit_grid({70, 60, 130});
  Random random(test_seed(), 1);
  SCOPED_TRACE(seed_text(test_seed()));
  const auto source = random_values<std::int16_t>(grid, random, -1000, 3000);
  std::uint64_t number = 0;
  for (const char* formula :
       {"wave:amplitude=5,wavelength=40", "wave:amplitude=9,wavelength=30,along=x,axis=z", "twist:angle=30",
        "bubble:radius=30,strength=0.9", "bubble-paper:shift=-6", "translate:by=3/0/20.5"}) {
    for (const std::int64_t cell_size : {1, 3, 4, 16}) {
      const Wanted& wanted = kWanted[number++ % std::size(kWanted)];
      SCOPED_TRACE(std::string(formula) + ", cells of " + std::to_string(cell_size) + ", way " +
                   std::to_string((number - 1) % std::size(kWanted)));
      const VertexField field = sample_on(lattice_over(grid, cell_size), parse_formula(formula, grid));
      const int streamed = expect_same_under_limits(grid, field, source, whole(grid), wanted);
      if (cell_size == 1) {
        EXPECT_GT(streamed, 0) << "no limit made it stream the field";
      }
      if (HasFailure()) return;
    }
  }
}

/// Thrown about, folded, out of the volume, on lattices of every kind.
FieldCase odd_case(std::uint64_t n) {
  Random random(test_seed(), 100 + n);
  const Geometry grid = n % 4 == 3 ? oblique_grid({30, 41, 90}) : unit_grid({41, 30, 95});
  Geometry lattice = lattice_over(grid, random.one_of<std::int64_t>({1, 2, 3, 4}));
  std::string kind = "thrown about";
  if (n % 4 == 1) {  // cells that are no cubes, vertices beside whole steps, and a part of the volume not covered
    lattice.spacing = {1.3, 0.9, 0.73};
    lattice.origin = {2.1, -3, 7.7};
    lattice.size = {28, 34, 100};
    kind = "on cells of any shape";
  }
  if (n % 4 == 2) {
    lattice.spacing = {2, 1, 3};
    lattice.size = {21, 30, 33};
    kind = "on oblong cells";
  }
  const double amplitude = random.one_of<double>({0.3, 1, 3}), away = random.one_of<double>({0, 0, 15});
  return {grid,
          field_in_voxels(grid, lattice,
                          [&](const glm::dvec3& at) {
                            return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)) +
                                   glm::dvec3(0, 0, at.z > 40 ? away : 0);
                          }),
          kind,
          {}};
}

TEST_F(MemoryLimit, ChangesNoBitOfFoldsAndOddLattices) {
  SCOPED_TRACE(seed_text(test_seed()));
  int streamed = 0;
  for (std::uint64_t n = 0; n < test_cases(24); ++n) {
    const FieldCase test = odd_case(n);
    Random random(test_seed(), 200 + n);
    const Wanted& wanted = kWanted[n % std::size(kWanted)];
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    Region region = whole(test.output);
    if (n % 2 == 1) region = {{1, 2, 3}, region.end - std::int64_t{4}};
    if (n % 3 == 0) {
      const auto source = random_values<double>(test.output, random, -1, 1);
      streamed += expect_same_under_limits(test.output, test.field, source, region, wanted);
    } else {
      const auto source = random_values<std::uint16_t>(test.output, random, 0, 65535);
      streamed += expect_same_under_limits(test.output, test.field, source, region, wanted);
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(streamed, 0) << "no limit made it stream a field";
}

TEST_F(MemoryLimit, ChangesNoBitOfPullFieldsAndOtherSources) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 3);
  const Geometry grid = unit_grid({50, 40, 60});
  Geometry other = grid;  // finer along k, and a little beside
  other.size = {44, 51, 120};
  other.spacing = {1.1, 0.9, 0.5};
  other.origin = {-3, 2, -4};
  const auto source = random_values<float>(other, random, -1, 1);
  const PullField field = [&] {
    const VertexField as = field_in_voxels(grid, lattice_over(grid, 5), [&](const glm::dvec3&) {
      return 4.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    return PullField{as.lattice, as.displacement};
  }();
  const auto cpu = make_cpu_pull_resampler(grid);
  cpu->set_field(view(field));
  const Wanted wanted{.maps = true};
  const auto expected = run_limited(*cpu, source, whole(grid), wanted);
  const std::uint64_t all = field.displacement.size() * sizeof(glm::vec3) + 2 * source.voxels.size() * sizeof(float);
  int in_slabs = 0;
  for (const double share : {2.0, 0.8, 0.6, 0.4, 0.3, 0.2}) {
    const auto cuda =
        make_pull_resampler(BackendKind::cuda, grid, 0, {.memory = static_cast<std::uint64_t>(share * double(all))});
    cuda->set_field(view(field));
    try {
      expect_same(expected, run_limited(*cuda, source, whole(grid), wanted));
      in_slabs += share < 0.5;
    } catch (const DeviceError&) {
      break;
    }
  }
  EXPECT_GT(in_slabs, 0);
  const auto too_small = make_pull_resampler(BackendKind::cuda, grid, 0, {.memory = 1000});
  EXPECT_THROW(too_small->set_field(view(field)), DeviceError);
}

TEST_F(MemoryLimit, TooSmallALimitIsRefusedAndTheResamplerLivesOn) {
  const Geometry grid = unit_grid({40, 40, 40});
  Geometry lattice = lattice_over(grid, 1);
  lattice.spacing = {0.25, 0.25, 1};
  lattice.size = {157, 157, 40};
  Random random(1);
  const auto source = random_values<std::int16_t>(grid, random, -100, 100);
  const VertexField fine = uniform_field(lattice, {0, 0, 2}), coarse = uniform_field(lattice_over(grid, 16), {0, 0, 2});
  const auto cuda = make_forward_resampler(BackendKind::cuda, grid, 0, {.memory = 400'000});
  const auto cpu = make_cpu_resampler(grid);
  cpu->set_field(view(coarse));
  const auto expected = run_limited(*cpu, source, whole(grid), {});
  for (int n = 0; n < 2; ++n) {
    EXPECT_THROW(cuda->set_field(view(fine)), DeviceError);  // three slices of vertices need 961 000 bytes
    EXPECT_THROW(run_limited(*cuda, source, whole(grid), {}), InputError);
    cuda->set_field(view(coarse));
    expect_same(expected, run_limited(*cuda, source, whole(grid), {}));
  }
}

TEST_F(MemoryLimit, ABadVertexIsNamedAsInTheWholeField) {
  const Geometry grid = unit_grid({20, 20, 60});
  VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  field.displacement[offset_of(grid, {3, 4, 47})].y = NAN;
  const auto cuda = make_forward_resampler(BackendKind::cuda, grid, 0, {.memory = field_bytes(field) / 3});
  try {
    cuda->set_field(view(field));
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("(3, 4, 47)"), std::string::npos) << error.what();
  }
}

/// A frame loop: two fields in turn, everything on the host.
struct Frames {
  Geometry grid = unit_grid({256, 200, 160});
  Volume<std::int16_t> source{grid, std::vector<std::int16_t>(static_cast<std::size_t>(voxel_count(grid)))};
  VertexField fields[2];
  Volume<std::int16_t> output = poisoned<std::int16_t>(grid);

  explicit Frames(std::int64_t cell_size) {
    for (std::size_t n = 0; n < source.voxels.size(); ++n)
      source.voxels[n] = static_cast<std::int16_t>(n * 7919 % 4001);
    const Geometry lattice = lattice_over(grid, cell_size);
    fields[0] = sample_on(lattice, parse_formula("wave:amplitude=8,wavelength=64", grid));
    fields[1] = sample_on(lattice, parse_formula("bubble-paper:shift=-6", grid));  // folds
  }
  std::uint64_t bytes() const { return field_bytes(fields[0]) + 2 * source.voxels.size() * sizeof(std::int16_t); }
  void run(ForwardResampler& resampler, int frame, bool maps) {
    resampler.set_field(view(fields[frame % 2]));
    Outcome<std::int16_t> outcome;
    if (maps) outcome = poisoned_outcome<std::int16_t>(grid);
    const Target target{.source = view(source), .output = view(output)};
    resampler.resample(whole(grid), {&target, 1}, maps ? maps_of(outcome) : Maps{});
  }
};

TEST_F(MemoryLimit, RepeatedFramesAllocateNothing) {
  for (const std::int64_t cell_size : {1, 4}) {
    Frames frames(cell_size);
    for (const double share : {0.0, 2.0, 0.4}) {  // 0: no limit
      for (const bool maps : {false, true}) {
        SCOPED_TRACE("cells of " + std::to_string(cell_size) + ", " + std::to_string(share) +
                     " of what is needed, maps " + std::to_string(maps));
        const auto limit = static_cast<std::uint64_t>(share * double(frames.bytes()));
        const auto cuda = make_forward_resampler(BackendKind::cuda, frames.grid, 0, {.memory = limit});
        for (int frame = 0; frame < 4; ++frame) frames.run(*cuda, frame, maps);
        const std::uint64_t before = free_bytes();
        for (int frame = 0; frame < 4; ++frame) frames.run(*cuda, frame, maps);
        EXPECT_EQ(free_bytes(), before);
      }
    }
  }
}

TEST_F(MemoryLimit, IsKeptButForWorkingSpace) {
  Frames frames(1);
  {
    const auto first = make_forward_resampler(BackendKind::cuda,
                                              frames.grid);  // what the context and kernels need comes with first use
    frames.run(*first, 0, true);
    frames.run(*first, 1, false);
  }
  for (const double share : {2.0, 0.6, 0.3, 0.15}) {
    const auto limit = static_cast<std::uint64_t>(share * double(frames.bytes()));
    SCOPED_TRACE("limit " + std::to_string(limit));
    const std::uint64_t before = free_bytes();
    const auto cuda = make_forward_resampler(BackendKind::cuda, frames.grid, 0, {.memory = limit});
    for (int frame = 0; frame < 2; ++frame) {
      frames.run(*cuda, frame, false);  // buffers are kept: what is held afterwards is the most
      EXPECT_LE(before - free_bytes(), std::min(limit, frames.bytes()) + kWorkingSpace);
    }
  }
}

TEST_F(MemoryLimit, PathsAddUpToTheRegion) {
  Frames frames(1);
  const auto cuda = make_forward_resampler(BackendKind::cuda, frames.grid);
  const Region region{{0, 0, 3}, frames.grid.size};
  for (int n = 0; n < 2; ++n) {
    cuda->set_field(view(frames.fields[n]));
    const Target target{.source = view(frames.source), .output = view(frames.output)};
    const Paths paths = cuda->resample(region, {&target, 1}).paths;
    EXPECT_EQ(paths.gathered + paths.walked + paths.claimed, static_cast<std::uint64_t>(voxel_count(region)));
    EXPECT_GT(paths.gathered, 0u);
    if (n == 1) {
      EXPECT_GT(paths.claimed, 0u);
    }
  }
}

/// Memory that the host has given to the device's reach, and memory that it has not.
TEST_F(MemoryLimit, PinnedHostMemoryIsUsedAsItIs) {
  Frames frames(1);
  const auto cuda = make_forward_resampler(BackendKind::cuda, frames.grid);
  frames.run(*cuda, 0, false);
  const auto expected = frames.output;
  for (auto* voxels : {&frames.source.voxels, &frames.output.voxels})
    ASSERT_EQ(cudaHostRegister(voxels->data(), voxels->size() * 2, cudaHostRegisterDefault), cudaSuccess);
  std::fill(frames.output.voxels.begin(), frames.output.voxels.end(), std::int16_t{-1});
  frames.run(*cuda, 0, false);
  for (auto* voxels : {&frames.source.voxels, &frames.output.voxels})
    ASSERT_EQ(cudaHostUnregister(voxels->data()), cudaSuccess);
  EXPECT_TRUE(same_bits(expected.voxels, frames.output.voxels));
}

}  // namespace
}  // namespace tetwarp
