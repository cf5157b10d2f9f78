// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The stages of a run of `deform`, each from values, without a disk.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/deform/deform_report.h"
#include "deform/fields/formula.h"
#include "tests/support/says.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::apps;
using nlohmann::json;

const Geometry kGrid{.size = {7, 6, 5}, .spacing = {2, 2, 3}, .origin = {10, 20, 30}};

Volume<std::int16_t> ramp(const Geometry& grid) {
  Volume<std::int16_t> volume{grid, {}};
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) volume.voxels.push_back(static_cast<std::int16_t>(7 * n - 300));
  return volume;
}

DeformOptions options_of(const std::vector<std::string>& fields) {
  DeformOptions options;
  options.common.quiet = true;
  options.common.threads = 1;
  options.input.path = "nowhere/in.nii.gz";
  options.output = "nowhere/out.nii.gz";
  options.field.forward = fields;
  options.backend = BackendChoice::cpu;
  return options;
}

DeformHeaders headers_of(const Geometry& grid) {
  DeformHeaders headers;
  headers.input.geometry = grid;
  return headers;
}

DeformInputs inputs_of(const Geometry& grid) {
  auto volume = std::make_shared<InputVolume>();
  volume->volume = AnyVolume(ramp(grid));
  volume->background = -1000;
  return {.input = volume, .headers = nullptr, .background = volume->background, .along = {}};
}

/// The values of a run whose options outlive it.
struct Stages {
  explicit Stages(const DeformOptions& options, const Geometry& grid = kGrid)
      : request(request_of(options)),
        headers(headers_of(grid)),
        plan(plan_deformation(request, headers)),
        inputs(inputs_of(grid)),
        field(make_field(request, plan, inputs, {BackendChoice::cpu, 0})) {}

  /// Sends the volume through a field. @param wanted  maps that no file gets
  DeformResult resampled(const std::vector<WantedMap>& wanted = {}) {
    OutputSet none(Reads(), false);
    DeformSinks sinks{nullptr, MapStream(field.grid, none), none};
    add_maps(wanted, field.grid, nullptr, sinks.maps);
    return resample(request, headers, inputs, field, std::move(field.room), sinks, {BackendChoice::cpu, 0});
  }

  DeformRequest request;
  DeformHeaders headers;
  DeformPlan plan;
  DeformInputs inputs;
  DeformField field;
};

std::vector<std::int16_t> voxels_of(const AnyVolume& volume) {
  const auto values = volume.as<std::int16_t>();
  return {values.begin(), values.end()};
}

template <class Failure>
std::string failure(const std::function<void()>& call) {
  try {
    call();
  } catch (const Failure& error) {
    return error.what();
  }
  return "";
}

TEST(DeformPlan, FollowsFromHeaders) {
  const DeformOptions options = options_of({"identity"});
  const DeformPlan plan = plan_deformation(request_of(options), headers_of(kGrid));
  EXPECT_EQ(plan.grid, kGrid);
  EXPECT_EQ(plan.output_bytes, 7u * 6 * 5 * 2);
  DeformOptions with_field = options;
  with_field.write_field = "nowhere/field.mha";
  with_field.maps.coverage = "nowhere/coverage.mha";
  const DeformPlan more = plan_deformation(request_of(with_field), headers_of(kGrid));
  EXPECT_EQ(more.output_bytes, plan.output_bytes + 7 * 6 * 5 * (1 + 12));
  EXPECT_EQ(more.bytes, plan.bytes + 7 * 6 * 5) << "a map that is whole in one slab";
}

TEST(DeformPlan, CountsTheMapsThatMassNeedsOnce) {
  DeformOptions options = options_of({"identity"});
  const std::uint64_t plain = plan_deformation(request_of(options), headers_of(kGrid)).bytes;
  options.preserve_mass = true;
  const std::uint64_t mass = plan_deformation(request_of(options), headers_of(kGrid)).bytes;
  EXPECT_EQ(mass - plain, 7u * 6 * 5 * (2 * 4 + 1 + 4)) << "two volumes of floats, coverage, determinants";
  options.maps.jacobian = "nowhere/jacobian.mha";
  EXPECT_EQ(plan_deformation(request_of(options), headers_of(kGrid)).bytes, mass);
}

TEST(DeformPlan, TakesTheGridThatOptionsName) {
  DeformOptions options = options_of({"identity"});
  Geometry sheared = kGrid;
  sheared.direction[2] = glm::dvec3(0, 0.6, 0.8);
  EXPECT_EQ(plan_deformation(request_of(options), headers_of(sheared)).grid, straightened(sheared));
  options.grid = "fit";
  EXPECT_FALSE(plan_deformation(request_of(options), headers_of(kGrid)).grid.has_value());
  options.grid = "/";  // a folder that exists
  DeformHeaders headers = headers_of(kGrid);
  headers.grid = Geometry{.size = {3, 3, 3}};
  EXPECT_EQ(plan_deformation(request_of(options), headers).grid, headers.grid);
}

TEST(DeformPlan, RefusesWhatTheMemoryDoesNotHold) {
  DeformOptions options = options_of({"identity"});
  options.memory_bytes = 1000;
  const std::string said = failure<Error>([&] { plan_deformation(request_of(options), headers_of(kGrid)); });
  EXPECT_TRUE(says(said, {"of memory are needed, --memory allows"}));
}

TEST(DeformRequest, RefusesWhatDoesNotGoTogether) {
  const auto refused = [](const std::function<void(DeformOptions&)>& change) {
    DeformOptions options = options_of({"identity"});
    change(options);
    return failure<UsageError>([&] { request_of(options); });
  };
  EXPECT_EQ(refused([](DeformOptions&) {}), "");
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.labels = "l.mha"; }), {"--labels is for --scenario"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.scenario = "s.json"; }), {"--scenario makes the field"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.field.forward = {}; }), {"no field; give -f FIELD"}));
  EXPECT_TRUE(
      says(refused([](DeformOptions& o) { o.grid = "nowhere/grid.mha"; }), {"expected same, fit, or a volume"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.output = "series"; }), {"can only be derived from DICOM"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.maps.inverse = "i.dcm"; }), {"is a DICOM registration"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.with = {"a.mha"}; }), {"names no output"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.points = {"a.csv=b.stl"}; }), {"--points writes the form"}));
  const auto pull = [&](const std::function<void(DeformOptions&)>& change) {
    return refused([&](DeformOptions& o) {
      o.field = {{}, "nowhere/pull.mha", {}};
      change(o);
    });
  };
  EXPECT_EQ(pull([](DeformOptions&) {}), "");
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.preserve_mass = true; }), {"--preserve mass needs"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.field.cell_size = 2; }), {"--pull-field has its own grid"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.points = {"a.csv=b.csv"}; }), {"--points needs a forward field"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.maps.folds = "f.mha"; }), {"--jacobian and --folds"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.grid = "fit"; }), {"--grid fit needs to know"}));
}

TEST(DeformField, IsMadeOfAParsedFormula) {
  DeformOptions options = options_of({"twist:angle=10"});
  options.field.cell_size = 2;
  const Stages run(options);
  const VertexField expected = twist(kGrid, 10 * 0.017453292519943295769, 2);
  EXPECT_EQ(run.field.sha256, hash_field(expected, 1));
  EXPECT_EQ(run.field.grid, kGrid);
  EXPECT_EQ(run.field.room.geometry(), kGrid);
  EXPECT_TRUE(run.field.origin.files.empty());
  EXPECT_FALSE(run.field.origin.identity);
}

TEST(DeformField, LeadsOntoAGridThatFitsIt) {
  DeformOptions options = options_of({"translate:by=4/0/0"});
  options.grid = "fit";
  const Stages run(options);
  EXPECT_EQ(run.field.grid.size, kGrid.size + glm::i64vec3(2, 0, 0));
  EXPECT_EQ(run.field.room.geometry().size, run.field.grid.size);
}

TEST(DeformField, NotesAGridThatHadToBeStraightened) {
  const DeformOptions options = options_of({"identity"});
  Geometry sheared = kGrid;
  sheared.direction[2] = glm::dvec3(0, 0.6, 0.8);
  const Stages run(options, sheared);
  ASSERT_EQ(run.field.origin.notes.size(), 1u);
  EXPECT_TRUE(says(run.field.origin.notes[0], {"INPUT's slices lean"}));
}

TEST(DeformPass, TheIdentityReturnsInput) {
  const DeformOptions options = options_of({"identity"});
  Stages run(options);
  const DeformResult result = run.resampled();
  EXPECT_EQ(result.backend, "cpu");
  EXPECT_EQ(voxels_of(result.output), ramp(kGrid).voxels);
  EXPECT_EQ(result.report.covered, static_cast<std::uint64_t>(voxel_count(kGrid)));
  EXPECT_FALSE(result.check);
}

TEST(DeformPass, ATranslationLeavesBackgroundBehind) {
  DeformOptions options = options_of({"translate:by=1/0/0vox"});
  options.outside = Outside::background;
  Stages run(options);
  const DeformResult result = run.resampled();
  const auto output = voxels_of(result.output), input = ramp(kGrid).voxels;
  EXPECT_EQ(output[0], -1000);
  EXPECT_EQ(output[1], input[0]);
  EXPECT_EQ(result.report.uncovered, 6u * 5);
}

TEST(DeformPass, MassIsKeptWithoutAFileOfItsMaps) {
  DeformOptions options = options_of({"identity"});
  options.preserve_mass = true;
  Stages run(options);
  const std::vector<WantedMap> maps = wanted_maps(run.request, {});
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_TRUE(maps[0].file.empty() && maps[1].file.empty());
  EXPECT_EQ(voxels_of(run.resampled(maps).output), ramp(kGrid).voxels);
}

TEST(DeformPass, APullFieldGoesTheOtherWay) {
  DeformOptions options = options_of({"identity"});
  options.outside = Outside::rest;
  Stages run(options);
  run.field.field = PullField{kGrid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(kGrid)), {2, 0, 0})};
  const DeformResult result = run.resampled();
  EXPECT_EQ(voxels_of(result.output)[0], ramp(kGrid).voxels[1]) << "one voxel of 2 mm";
}

TEST(DeformReport, TellsOfTheRunInTheWordsOfTheCommandLine) {
  DeformOptions options = options_of({"twist:angle=0", "identity"});
  options.field.cell_size = 3;
  options.report = "nowhere/report.json";
  Stages run(options);
  const DeformResult result = run.resampled();
  const DeformRun done{run.request, run.plan, run.headers, run.inputs, run.field, result};
  DeformWritten written;
  written.input_sha256 = "of the input";
  const json told = sidecar(done, written);
  EXPECT_EQ(told["options"]["field"], json({"twist:angle=0", "identity"}));
  EXPECT_EQ(told["options"]["cell_size"], 3);
  EXPECT_EQ(told["options"]["background"], -1000);
  EXPECT_EQ(told["input"], json({{"path", "nowhere/in.nii.gz"}, {"sha256", "of the input"}}));
  EXPECT_EQ(told["field"]["sha256"], run.field.sha256);
  EXPECT_EQ(told["field"]["direction"], "forward");
  EXPECT_EQ(told["report"]["covered"], voxel_count(kGrid));
  for (const char* none : {"with", "structures", "maps", "points", "bids"}) EXPECT_FALSE(told.contains(none)) << none;
  EXPECT_EQ(summary(done), "wrote nowhere/out.nii.gz: 7 x 6 x 5 voxels, 100.00 % covered, backend cpu");
  EXPECT_TRUE(notes_of(done, written).empty());
  EXPECT_EQ(title_of(run.request), "twist:angle=0, then identity");
  const json timed = report_with_times(done, written);
  EXPECT_EQ(timed["quality"]["verdict"].is_string(), true);
  EXPECT_EQ(timed["memory"]["planned_bytes"], run.plan.bytes);
  EXPECT_EQ(timed["stages"].size(), 5u) << timed["stages"];
}

TEST(DeformReport, OfADeidentifiedRunNamesNoInputAndNoFile) {
  DeformOptions options = options_of({"identity"});
  options.input.path = "nowhere";
  options.output = "nowhere/series";
  options.dicom.deidentification.emplace();
  Stages run(options);
  DeformResult result;
  result.output = std::move(run.field.room);
  const DeformRun done{run.request, run.plan, run.headers, run.inputs, run.field, result};
  const json told = sidecar(done, {});
  EXPECT_EQ(told["input"], json::object());
  EXPECT_EQ(title_of(run.request), "identity");
  EXPECT_TRUE(says(notes_of(done, {}).back(), {"de-identified by"}));
}

}  // namespace
