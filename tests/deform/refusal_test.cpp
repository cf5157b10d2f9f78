// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <limits>

#include "deform/fields/lattice_mesh.h"
#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Refusals);

/// Expects an InputError of one line that holds `part`.
template <class Call>
void expect_refused(const std::string& part, Call&& call) {
  try {
    call();
    FAIL() << "accepted; expected a refusal with \"" << part << "\"";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

TEST_P(Refusals, OutputsWithoutACellOrTooWide) {
  for (int axis = 0; axis < 3; ++axis) {
    glm::i64vec3 size(5);
    size[axis] = 1;
    expect_refused(to_string(size), [&] { make(unit_grid(size)); });
    size[axis] = 0;
    expect_refused("size", [&] { make(unit_grid(size)); });
    size[axis] = (1 << 18) + 1;
    expect_refused("262144", [&] { make(unit_grid(size)); });
  }
  Geometry flat = unit_grid({5, 5, 5});
  flat.direction[2] = flat.direction[1];
  expect_refused("direction", [&] { make(flat); });
  flat = unit_grid({5, 5, 5});
  flat.spacing.y = -1;
  expect_refused("spacing", [&] { make(flat); });
}

TEST_P(Refusals, FieldsThatAreNotFiniteOrTooFarAway) {
  const Geometry grid = unit_grid({7, 6, 5});
  const auto resampler = make(grid);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  for (const float bad : {kNaN, kInfinity, -kInfinity, 1e9f, -3e38f}) {
    for (int axis = 0; axis < 3; ++axis) {
      VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
      field.displacement[offset_of(field.lattice, {6, 0, 4})][axis] = bad;
      expect_refused("vertex (6, 0, 4)", [&] { resampler->set_field(view(field)); });
    }
  }
}

TEST_P(Refusals, LatticesWithoutCellsOrWithoutTheirVertices) {
  const Geometry grid = unit_grid({7, 6, 5});
  const auto resampler = make(grid);
  VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  field.displacement.pop_back();
  expect_refused("209", [&] { view(field); });
  for (int axis = 0; axis < 3; ++axis) {
    Geometry lattice = grid;
    lattice.size[axis] = 1;
    const VertexField thin = uniform_field(lattice, glm::vec3(0));
    expect_refused(to_string(lattice.size), [&] { resampler->set_field(view(thin, Outside::background)); });
  }
  expect_refused("empty", [&] { resampler->set_field(FieldView{}); });
  Geometry fine = grid;
  fine.spacing = glm::dvec3(1e-5);
  const VertexField tiny = uniform_field(fine, glm::vec3(0));
  expect_refused("cells", [&] { resampler->set_field(view(tiny, Outside::background)); });
  Geometry far = grid;
  far.origin = glm::dvec3(1e9, 0, 0);
  const VertexField away = uniform_field(far, glm::vec3(0));
  expect_refused("lattice", [&] { resampler->set_field(view(away, Outside::background)); });
}

TEST(MeshOfAField, ArraysThatDoNotFitAreRefusedBeforeTheyAreRead) {
  VertexField field = uniform_field(unit_grid({4, 4, 4}), glm::vec3(0));
  field.mesh = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, std::vector<glm::vec3>(4), {{0, 1, 2, 3}}};
  for (const bool takes_a_place : {false, true}) {
    if (takes_a_place) field.replaced = {3};
    VertexField few = field, beyond = field;
    few.mesh.displacement.pop_back();
    expect_refused("3 displacements", [&] { view(few); });
    beyond.mesh.tetrahedra.back().z = 4;
    expect_refused("vertex 4 of 4", [&] { mesh_of(beyond); });
    EXPECT_NO_THROW(mesh_of(field));
  }
}

TEST_P(Refusals, CallsWithoutAField) {
  const Geometry grid = unit_grid({7, 6, 5});
  const auto resampler = make(grid);
  expect_refused("set_field", [&] { resampler->resample(whole(grid), {}); });
  expect_refused("set_field", [&] { resampler->source_region(grid, whole(grid)); });
  VertexField bad = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  resampler->set_field(view(bad));
  bad.displacement[3].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(resampler->set_field(view(bad)), InputError);
  expect_refused("set_field", [&] { resampler->resample(whole(grid), {}); });
}

/// A resampler at rest and views that fit: each test spoils one thing.
struct Call {
  Geometry grid = unit_grid({7, 6, 5});
  VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  Volume<std::int16_t> source{grid, std::vector<std::int16_t>(210, 5)}, output = poisoned<std::int16_t>(grid);
  Target target{.source = view(source), .output = view(output)};
  Maps maps;
  Region region = whole(grid);
  std::unique_ptr<ForwardResampler> resampler;

  explicit Call(std::unique_ptr<ForwardResampler> made) : resampler(std::move(made)) {
    resampler->set_field(view(field));
  }
  void operator()() { resampler->resample(region, {&target, 1}, maps); }
};

TEST_P(Refusals, ViewsThatDoNotFit) {
  const Geometry grid = unit_grid({7, 6, 5});
  const auto refuse = [&](const std::string& part, auto&& spoil) {
    Call call(make(grid));
    EXPECT_NO_THROW(call());
    spoil(call);
    expect_refused(part, call);
  };
  const Geometry other = unit_grid({7, 6, 6});
  refuse("the source is empty", [](Call& c) { c.target.source.voxels = nullptr; });
  refuse("the output is empty", [](Call& c) { c.target.output.geometry = nullptr; });
  refuse("int16", [](Call& c) { c.target.output.type = VoxelType::u16; });
  refuse("output has 1 components, the source 3", [](Call& c) { c.target.source.components = 3; });
  refuse("output has 2 components, the source 1", [](Call& c) { c.target.output.components = 2; });
  refuse("0 components", [](Call& c) { c.target.source.components = c.target.output.components = 0; });
  refuse("grid", [&](Call& c) { c.target.output.geometry = &other; });
  refuse("output buffers", [](Call& c) { c.target.output.buffered.end.z = 4; });
  refuse("source buffers", [](Call& c) { c.target.source.buffered.begin.x = 3; });
  refuse("not part of its grid", [](Call& c) { c.target.source.buffered.end.y = 7; });
  refuse("region", [](Call& c) { c.region.end.x = 8; });
  refuse("region", [](Call& c) { c.region.begin.z = -1; });
  std::vector<SliceRange> slices(4);
  refuse("sampled_slices", [&](Call& c) { c.target.sampled_slices = slices; });
}

TEST_P(Refusals, MapsOfAnotherTypeOrPlace) {
  const Geometry grid = unit_grid({7, 6, 5}), other = unit_grid({5, 6, 7});
  auto outcome = poisoned_outcome<std::int16_t>(grid);
  const Maps good = maps_of(outcome);
  for (VolumeView Maps::*map : {&Maps::coverage, &Maps::inverse_mm, &Maps::jacobian, &Maps::owners}) {
    Call call(make(grid));
    call.maps = good;
    EXPECT_NO_THROW(call());
    (call.maps.*map).type = VoxelType::i32;
    expect_refused("map", call);
    call.maps = good;
    (call.maps.*map).components = 2;
    expect_refused("map", call);
    call.maps = good;
    (call.maps.*map).geometry = &other;
    expect_refused("map", call);
    call.maps = good;
    (call.maps.*map).buffered.begin.y = 1;
    expect_refused("map", call);
  }
}

TEST_P(Refusals, HostMemoryThatIsSaidToBeOnADevice) {
  const Geometry grid = unit_grid({7, 6, 5});
  auto outcome = poisoned_outcome<std::int16_t>(grid);
  const auto refuse = [&](auto&& spoil) {
    Call call(make(grid));
    call.maps = maps_of(outcome);
    EXPECT_NO_THROW(call());
    spoil(call);
    expect_refused("memory", call);
  };
  refuse([](Call& c) { c.target.source.memory = Memory::device; });
  refuse([](Call& c) { c.target.output.memory = Memory::device; });
  refuse([](Call& c) { c.maps.owners.memory = Memory::device; });
  const VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  FieldView lying = view(field);
  lying.memory = Memory::device;
  expect_refused("memory", [&] { make(grid)->set_field(lying); });
}

TEST_P(Refusals, AnEmptyRegionIsNoError) {
  Call call(make(unit_grid({7, 6, 5})));
  call.region = {{2, 2, 2}, {2, 4, 4}};
  const Report report = call.resampler->resample(call.region, {&call.target, 1});
  EXPECT_EQ(report.covered + report.uncovered, 0u);
  EXPECT_TRUE(same_bits(poisoned<std::int16_t>(call.grid).voxels, call.output.voxels));
}

}  // namespace
}  // namespace tetwarp
