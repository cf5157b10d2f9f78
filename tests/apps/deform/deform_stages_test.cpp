// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The stages of a run of `deform` that follow its plan, each from values, without a disk.
#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "tests/apps/deform/stages.h"
#include "tests/support/says.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::test;
using nlohmann::json;

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
  DeformOptions onto_another = options;
  onto_another.grid = "fit";
  EXPECT_TRUE(Stages(onto_another, sheared).field.origin.notes.empty()) << "another grid was asked for";
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

TEST(DeformPass, AGridThatFitsHoldsInputWhereverItGoes) {
  DeformOptions options = options_of({"translate:by=-2/0/0vox"});  // refuses what does not cover INPUT: this does
  options.grid = "fit";
  Stages run(options);
  const DeformResult result = run.resampled();
  ASSERT_EQ(result.output.geometry().size, glm::i64vec3(9, 6, 5));
  EXPECT_EQ(result.output.geometry().origin, kGrid.origin - glm::dvec3(4, 0, 0));
  const auto output = voxels_of(result.output), input = ramp(kGrid).voxels;
  for (std::size_t row = 0; row < 6 * 5; ++row) {
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_EQ(output[9 * row + i], i < 7 ? input[7 * row + i] : -1000) << row << ", " << i;
  }
}

TEST(DeformPass, ValuesBetweenVoxelsAreThoseOfTheInterpolationAndNeverOfPadding) {
  DeformOptions options = options_of({"translate:by=1/0/0"});  // half a voxel
  options.outside = Outside::background;
  options.interpolation = Interpolation::nearest;
  Stages nearest(options);
  const auto input = ramp(kGrid).voxels;
  const auto chosen = voxels_of(nearest.resampled().output);
  EXPECT_TRUE(chosen[1] == input[0] || chosen[1] == input[1]);
  options.interpolation = Interpolation::linear;
  Stages linear(options);
  const DeformResult mixed = linear.resampled();
  EXPECT_EQ(voxels_of(mixed.output)[3], -282) << "of -286 and -279, a half to even";
  EXPECT_EQ(mixed.report.padded, 0u);
  auto padded = std::make_shared<InputVolume>();
  padded->volume = AnyVolume(ramp(kGrid));
  padded->dicom.emplace().padding = PaddingRange{double(input[2]), double(input[2])};
  linear.inputs.input = padded;
  linear.field.room = AnyVolume(kGrid, VoxelType::i16);
  const DeformResult kept = linear.resampled();
  EXPECT_EQ(kept.report.padded, 2u) << "on both sides of it";
  EXPECT_TRUE(voxels_of(kept.output)[3] == input[2] || voxels_of(kept.output)[3] == input[3]);
}

TEST(DeformPass, TheReportCountsVoxelsOfInputAloneAndEachVolumeHasItsOwnWay) {
  DeformOptions options = options_of({"translate:by=1/0/0"});
  options.outside = Outside::rest;
  options.with = {"far.mha=a.mha:background=5", "near.mha=b.mha:nearest", "far.mha=c.mha:own"};
  Stages run(options);
  Geometry far_away = kGrid;
  far_away.origin.x += 1000;
  for (const AlongVolumeChoice& choice : run.request.volumes) {
    const Geometry& grid = choice.input.path == "near.mha" ? kGrid : far_away;
    run.headers.along.volumes.push_back(AlongHeader{choice, {}, {}, grid});
    AlongInput& input = run.inputs.along.emplace_back();
    input.sources.emplace_back(ramp(grid));
    input.background = -7;
  }
  const DeformResult result = run.resampled();
  EXPECT_EQ(result.report.covered, 6u * 6 * 5) << "all but the plane that is left";
  ASSERT_EQ(result.along.size(), 3u);
  EXPECT_EQ(voxels_of(result.along[0].outputs[0]), std::vector<std::int16_t>(7 * 6 * 5, 5)) << "it lies elsewhere";
  const auto input = ramp(kGrid).voxels, near_by = voxels_of(result.along[1].outputs[0]);
  EXPECT_TRUE(near_by[3] == input[2] || near_by[3] == input[3]) << near_by[3];
  EXPECT_EQ(result.along[2].outputs[0].geometry(), far_away);
  EXPECT_EQ(voxels_of(result.along[2].outputs[0]), input) << "the field rests there";
}

TEST(DeformPass, AVolumeOnItsOwnGridIsRefusedWhereTheFieldDoesNotReachWhateverOutputGrowsTo) {
  DeformOptions options = options_of({"translate:by=1/0/0"});
  options.grid = "fit";
  options.with = {"far.mha=a.mha:own"};
  Stages run(options);
  Geometry far_away = kGrid;
  far_away.origin.x += 1000;
  run.headers.along.volumes.push_back(AlongHeader{run.request.volumes[0], {}, {}, far_away});
  run.inputs.along.emplace_back().sources.emplace_back(ramp(far_away));
  EXPECT_TRUE(says(failure<InputError>([&] { run.resampled(); }), {"does not reach over"}));
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

TEST(DeformReport, TellsOfTheGridAndTheBackgroundThatWereUsed) {
  DeformOptions options = options_of({"translate:by=4/0/0"});
  options.grid = "fit";
  options.background = -5;
  Stages run(options);
  run.inputs.background = -5;
  const DeformResult result = run.resampled();
  const DeformRun done{run.request, run.plan, run.headers, run.inputs, run.field, result};
  const json told = sidecar(done, {});
  EXPECT_EQ(told["options"]["grid"], "fit");
  EXPECT_EQ(told["options"]["background"], -5);
  EXPECT_EQ(told["output"]["geometry"]["size"], json({9, 6, 5}));
  EXPECT_EQ(told["report"]["uncovered"], 2 * 6 * 5);
  EXPECT_TRUE(says(summary(done), {"9 x 6 x 5 voxels, 77.78 % covered"}));
}

TEST(DeformReport, SumsTheTimesOfTheStages) {
  DeformOptions options = options_of({"identity"});
  options.report = "nowhere/report.json";
  Stages run(options);
  DeformResult result = run.resampled();
  run.headers.seconds = 1, run.inputs.seconds = 2, run.field.seconds = 4;
  result.seconds = 8, result.check_seconds = 16;
  DeformWritten written;
  written.seconds = 32;
  const json told = report_with_times({run.request, run.plan, run.headers, run.inputs, run.field, result}, written);
  const auto seconds = [&](const char* stage) { return told["stages"][stage]["seconds"].get<double>(); };
  EXPECT_EQ(seconds("read"), 3);
  EXPECT_EQ(seconds("field"), 4);
  EXPECT_EQ(seconds("resample"), 8);
  EXPECT_EQ(seconds("check"), 16);
  EXPECT_EQ(seconds("write"), 32);
  EXPECT_EQ(told["total_seconds"], 63);
}

TEST(DeformReport, LosesNoNoteOfAnyStage) {
  const DeformOptions options = options_of({"identity"});
  Stages run(options);
  run.headers.input.series.emplace();
  run.headers.input.series->warnings = {"of the series"};
  run.headers.input.series->set_aside = {{"odd.dcm", "is odd", {}}};
  run.headers.notes = {"of a header", "of a grid"};
  run.headers.along.notes = {"of a volume"};
  run.field.warnings = {"of a simulation"};
  run.field.origin.notes = {"of a field"};
  DeformResult result = run.resampled();
  const DeformRun done{run.request, run.plan, run.headers, run.inputs, run.field, result};
  const std::vector<std::string> expected = {"warning: of the series",
                                             "warning: of a simulation",
                                             "note: of a header",
                                             "note: of a grid",
                                             "note: of a field",
                                             "note: of a volume",
                                             "note: 1 file of the series is no slice of it; OUTPUT.json names them"};
  EXPECT_EQ(notes_of(done, {}), expected);
  result.report.conflicts = 3, result.report.clamped = 2, result.report.inverted = 1, result.report.degenerate = 4;
  EXPECT_TRUE(says(summary(done), {"the field folds: 1 tetrahedra inverted, 4 flat", "2 values clamped",
                                   "3 voxels outside the field were moved into"}));
}

TEST(DeformReport, ADerivedSeriesSaysWhatBecameOfIt) {
  DeformOptions options = options_of({"identity"});
  const DeformOptions twist = options_of({"twist:angle=10"});
  const Stages still(options), turned(twist);
  EXPECT_FALSE(derivation_of(still.request, still.inputs, still.field).deformed);
  const DicomDerivation of_twist = derivation_of(turned.request, turned.inputs, turned.field);
  EXPECT_TRUE(of_twist.deformed);
  EXPECT_EQ(of_twist.background_hu, -1000);
  EXPECT_EQ(of_twist.field_sha256, turned.field.sha256);
  options.interpolation = Interpolation::cubic;
  options.outside = Outside::rest;
  const Stages cubic(options);
  const DicomDerivation of_input = input_derivation_of(cubic.request, cubic.inputs, cubic.field);
  EXPECT_EQ(of_input.parameters, "interpolation=cubic outside=rest background=-1000.0 direction=forward");
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
