// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// tetwarp-bench on the command line: exit statuses, and files that appear whole.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "backend/devices.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

constexpr const char* kTiny = "paper --backend cpu --width 12 --slices 9 --frames 1 --warmup 0 --fields wave ";

Outcome run_bench(const Scratch& scratch, const std::string& arguments) {
  return run_tetwarp(scratch.path(), arguments);  // TETWARP_PROGRAM is tetwarp-bench here
}

void expect_error(const Outcome& run, int status, const std::string& names) {
  EXPECT_EQ(run.status, status) << run.err;
  EXPECT_EQ(run.err.rfind("tetwarp-bench: error: ", 0), 0u) << run.err;
  EXPECT_TRUE(says(run.err, {names}));
  EXPECT_EQ(run.out, "");
}

/// With one space where there are several.
std::string squeezed(const std::string& text) {
  std::string found;
  for (const char c : text)
    if (c != ' ' || !found.ends_with(' ')) found += c;
  return found;
}

TEST(BenchProgram, PrintsTablesAndWritesTheNumbers) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, kTiny + std::string("--cell-sizes none --json r.json --csv r.csv"));
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(says(run.out, {"# tetwarp-bench paper", "## Runs", "12 x 12 x 9", "backend cpu"}));
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_EQ(document["runs"].size(), 14u) << "4 of them per voxel";
  std::set<std::string> keys;
  for (const auto& [key, value] : document.items()) keys.insert(key);
  EXPECT_EQ(keys, (std::set<std::string>{"appendix_a", "commit", "input", "machine", "options", "program", "runs",
                                         "version"}));
  EXPECT_EQ(document["program"], "tetwarp-bench paper");
  EXPECT_EQ(document["machine"].size(), 6u);
  EXPECT_TRUE(document["machine"]["gpu"].is_null());
  EXPECT_EQ(document["input"], (nlohmann::json{{"kind", "phantom"}, {"seed", 1}}));
  for (const std::string key : {"frames", "warmup", "backend", "methods", "fields"}) {
    EXPECT_TRUE(document["options"].contains(key)) << key;
  }
  EXPECT_TRUE(
      says(read_text(scratch / "r.csv"), {"12,12,9,wave,\"wave:amplitude=0.375,wavelength=3\",1,paper,memory"}));
}

TEST(BenchProgram, WrongCommandLinesExitWithTwo) {
  const Scratch scratch;
  expect_error(run_bench(scratch, ""), 2, "subcommand");
  expect_error(run_bench(scratch, "paper --methods fastest"), 2, "fastest");
  expect_error(run_bench(scratch, "paper --fields swirl"), 2, "swirl");
  expect_error(run_bench(scratch, "paper --fields wave-paper-2"), 2, "wave-paper-2");
  expect_error(run_bench(scratch, "paper --cell-sizes 1"), 2, "--cell-sizes");
  expect_error(run_bench(scratch, "paper --cell-sizes 4,x"), 2, "--cell-sizes");
  expect_error(run_bench(scratch, "paper --raw some.raw"), 2, "--size");
  expect_error(run_bench(scratch, "gpu --fields wave,swirl"), 2, "swirl");
  expect_error(run_bench(scratch, "gpu --cell-sizes 4,1"), 2, "--cell-sizes");
  expect_error(run_bench(scratch, "gpu --frames 0"), 2, "--frames");
  expect_error(run_bench(scratch, "gpu --slices 1"), 2, "--slices");
  expect_error(run_bench(scratch, "cpu --fields wave,swirl"), 2, "swirl");
  expect_error(run_bench(scratch, "cpu --peers gpu"), 2, "gpu");
  expect_error(run_bench(scratch, "cpu --cell-sizes 4,1"), 2, "--cell-sizes");
  expect_error(run_bench(scratch, "cpu --repeats 0"), 2, "--repeats");
  expect_error(run_bench(scratch, "invert --fields wave,elastic"), 2, "elastic");
  expect_error(run_bench(scratch, "invert --peers itk-warp"), 2, "itk-warp");
  expect_error(run_bench(scratch, "invert --width 4"), 2, "--width");
  expect_error(run_bench(scratch, "io --slices 1"), 2, "--slices");
  expect_error(run_bench(scratch, "io --steps in,through"), 2, "through");
  expect_error(run_bench(scratch, "io --folder missing"), 2, "missing");
  expect_error(run_bench(scratch, "itk --tasks pull,push"), 2, "push");
  expect_error(run_bench(scratch, "itk --fields wave"), 2, "wave");
  expect_error(run_bench(scratch, "itk --cell-sizes 0"), 2, "--cell-sizes");
}

constexpr const char* kTinyGpu = "gpu --width 64 --slices 20,40 --cell-sizes 4 --frames 2 --warmup 1 --json r.json ";

TEST(BenchProgram, TheGpusMeasureNeedsAGpu) {
  if (tetwarp::device_count() > 0) GTEST_SKIP() << "there is a CUDA device on this machine";
  const Scratch scratch;
  expect_error(run_bench(scratch, kTinyGpu), 1, "CUDA");
  EXPECT_FALSE(std::filesystem::exists(scratch / "r.json"));
}

TEST(BenchProgram, MeasuresEveryFieldOnAGpu) {
  if (tetwarp::device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine, or CUDA is not in this build";
  const Scratch scratch;
  const Outcome run = run_bench(scratch, kTinyGpu);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(says(run.out, {"# tetwarp-bench gpu", "rotation", "## Frame loops", "## Floors"}));
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_EQ(document["runs"].size(), 9u + 4u + 1u);
  EXPECT_EQ(document["frame_loops"].size(), 2u);
  for (const nlohmann::json& found : document["runs"]) {
    EXPECT_GT(found["report"]["covered"], 20000) << found["field"];
    if (found["field"] == "noise") continue;  // rough enough to turn a tetrahedron over
    EXPECT_EQ(found["report"]["inverted"] > 0, found["field"] == "folds") << found["field"];
  }
}

constexpr const char* kTinyCpu = "cpu --width 32 --slices 8 --slow-slices 6 --repeats 1 --threads 2 --json r.json ";

TEST(BenchProgram, MeasuresEveryFieldOnTheCpu) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, std::string(kTinyCpu) + "--cell-sizes 4");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(says(squeezed(run.out), {"# tetwarp-bench cpu", "32 x 32 x 8", "\nelastic ", "## Growth",
                                       "- scaling:", "## Floors", "\npaper / new field wave "}));
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_EQ(document["machine"]["threads"], 2);
  ASSERT_EQ(document["runs"].size(), 6u);
  for (const nlohmann::json& found : document["runs"]) {
    EXPECT_GT(found["new_field_ms"]["median"], 0) << found["field"];
    EXPECT_GT(found["bytes_ms"]["median"], 0) << found["field"];
    EXPECT_EQ(found["paper"].is_null(), found["field"] == "local");
    EXPECT_EQ(found["itk_warp"].is_null(), found["field"] == "local" || document["itk"].is_null());
  }
  EXPECT_EQ(document["slow_peers"].size(), document["itk"].is_null() && document["vtk"].is_null() ? 0u : 5u);
  EXPECT_EQ(document["larger_cells"].size(), 4u);
  EXPECT_EQ(document["growth"].size(), 4u);
  EXPECT_GT(document["scaling"]["efficiency"], 0);
}

TEST(BenchProgram, AMissedFloorIsAFailureWhereItIsAskedFor) {
  const Scratch scratch;
  const std::string alone = std::string(kTinyCpu) + "--peers none --cell-sizes none --fields ";
  EXPECT_EQ(run_bench(scratch, alone + "identity").status, 0);
  // 8192 voxels are moved in microseconds: seldom is a new field made in twice that.
  bool missed = false;
  for (int turn = 0; turn < 20 && !missed; ++turn) {
    const Outcome run = run_bench(scratch, alone + "identity --check");
    missed = says(run.out, {"at most 2, missed"});
    EXPECT_EQ(run.status, missed ? 1 : 0) << run.out;
    EXPECT_EQ(bool(says(run.err, {"a floor is missed"})), missed) << run.err;
    EXPECT_TRUE(says(read_text(scratch / "r.json"), {"floors"}));
  }
  EXPECT_TRUE(missed);
  EXPECT_EQ(run_bench(scratch, alone + "local --check").status, 0) << "nothing is required of it";
}

constexpr const char* kTinyInvert = "invert --width 64 --slices 12 --repeats 1 --threads 2 --json r.json ";

TEST(BenchProgram, MeasuresTheInverseOfEveryFieldByEveryProgram) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, kTinyInvert);
  ASSERT_EQ(run.status, 0) << run.err;
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_TRUE(says(squeezed(run.out), {"# tetwarp-bench invert", "width 64; slices 12", "## Floors"}));
  if (document["itk"].is_null()) {  // what is the same in all rows of a table is said once above it
    EXPECT_TRUE(
        says(squeezed(run.out), {"\nby: tetwarp\n", "\nfolds ", "at most 0, met", "\nwritten without a source folds"}));
  } else {
    EXPECT_TRUE(says(squeezed(run.out), {"\nfolds tetwarp ", "\nwritten without a source folds 0.000 at most 0, met"}));
  }
  EXPECT_EQ(document["machine"]["threads"], 2);
  ASSERT_EQ(document["runs"].size(), document["itk"].is_null() ? 4u : 16u);
  for (const nlohmann::json& found : document["runs"]) {
    EXPECT_GT(found["ms"]["median"], 0) << found["field"] << found["by"];
    EXPECT_EQ(found["mean_error"].is_null(), found["field"] == "folds");
    if (found["by"] != "tetwarp") continue;
    EXPECT_EQ(found["written_without_source"], 0) << found["field"];
    EXPECT_EQ(found["left_out"], 0) << found["field"];
  }
}

TEST(BenchProgram, AnInverterThatIsMoreAccurateIsAFailureWhereItIsAskedFor) {
  // Wave shifts whole slices: ITK's iteration finds minus the field itself, Tetwarp rounds vertices to 2^-12 voxel.
  const Scratch scratch;
  const std::string wave = std::string(kTinyInvert) + "--fields wave --check --peers ";
  EXPECT_EQ(run_bench(scratch, wave + "none").status, 0);
  const Outcome beside = run_bench(scratch, wave + "itk-iterative");
  if (nlohmann::json::parse(read_text(scratch / "r.json"))["itk"].is_null()) GTEST_SKIP() << "ITK is not in this build";
  EXPECT_EQ(beside.status, 1);
  EXPECT_TRUE(says(beside.err, {"a floor is missed"}));
  EXPECT_TRUE(says(squeezed(beside.out), {"\nmean error / tetwarp's wave, ITK iterative 0.00", "at least 1, missed"}));
}

TEST(BenchProgram, FramesAreSimulatedResampledAndRendered) {
  const Scratch scratch;
  write_file(scratch / "push.json",
             R"({"method": "chainmail", "cell_size": 8, "tissues": [{"name": "all"}],
                 "move": [{"handle": {"at": {"body": [0.5, 0.5, 0.5]}, "radius_mm": 40}, "by_mm": [0, 0, 20]}]})");
  const std::string tiny =
      "simulate push.json --methods chainmail --width 64 --slices 40 --frames 3 --warmup 1 --json r.json ";
  const Outcome run = run_bench(scratch, tiny + "--render 48,32");
  ASSERT_EQ(run.status, 0) << run.err;
  const nlohmann::json frame = nlohmann::json::parse(read_text(scratch / "r.json"))["frames"][0];
  for (const char* part : {"simulate_ms", "resample_ms", "render_ms", "turn_ms"})
    EXPECT_GT(frame[part]["median"], 0) << part;
  EXPECT_NE(run.out.find("ms of a picture"), std::string::npos) << run.out;
  ASSERT_EQ(run_bench(scratch, tiny).status, 0);
  EXPECT_FALSE(nlohmann::json::parse(read_text(scratch / "r.json"))["frames"][0].contains("turn_ms"));
  expect_error(run_bench(scratch, tiny + "--render 4,4"), 2, "--render");
}

#ifdef TETWARP_BENCH_IO
constexpr const char* kTinyIo = "io --width 32 --slices 6 --repeats 2 --cell-sizes 4 --folder . --json r.json ";

TEST(BenchProgram, MeasuresFilesAndLeavesNoneBehind) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, kTinyIo);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(says(run.out, {"# tetwarp-bench io", "32 x 32 x 6", "page_cache: yes", "## Floors"}));
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  std::set<std::string> runs, floors;
  for (const nlohmann::json& time : document["times"]) {
    runs.insert(time["step"].get<std::string>() + ", " + time["by"].get<std::string>());
    EXPECT_GT(time["ms"]["min"], 0) << time["step"];
    EXPECT_EQ(time["ms"]["frames"], 2) << time["step"];
  }
  for (const nlohmann::json& floor : document["floors"]) floors.insert(floor["where"]);
  for (const std::string coding : {"uncompressed", "JPEG lossless", "JPEG-LS", "RLE"}) {
    for (const std::string by : {"tetwarp", "ITK", "DCMTK"}) {
      EXPECT_TRUE(runs.contains("DICOM in, " + coding + ", " + by)) << coding << by;
    }
    EXPECT_TRUE(floors.contains("DICOM in, " + coding));
  }
  for (const std::string where : {"DICOM out", ".nii.gz out", ".nii.gz in, written by ITK", "whole job, cells of 4"}) {
    EXPECT_TRUE(floors.contains(where)) << where;
  }
  EXPECT_GT(document["sizes"].size(), 1u);
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
    EXPECT_FALSE(entry.is_directory()) << entry.path();
  }
}

TEST(BenchProgram, AJobThatMissesItsFloorFailsOnlyWhereItIsAsked) {
  // A volume so small that starting the program takes longer than deforming it, without a device.
  const NoDevices on_cpu;
  const Scratch scratch;
  const std::string job = std::string(kTinyIo) + "--steps job ";
  EXPECT_EQ(run_bench(scratch, job).status, 0);
  const Outcome checked = run_bench(scratch, job + "--check");
  EXPECT_EQ(checked.status, 1);
  EXPECT_TRUE(says(checked.err, {"a floor is missed"}));
  EXPECT_TRUE(says(squeezed(checked.out), {"\nprogram / sum of its stages whole job, cells of 4 ", "missed"}));
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "r.json"))["floors"][0]["required"]["met"], false);
}
#endif

#ifdef TETWARP_BENCH_ITK
constexpr const char* kTinyItk = "itk --repeats 1 --threads 2 --folder . --json r.json ";

/// The number at a JSON pointer of the one run of a filter.
double number_of(const nlohmann::json& document, const std::string& filters, std::int64_t cell_size,
                 const std::string& pointer) {
  double found = NAN;
  int runs = 0;
  for (const nlohmann::json& run : document["runs"]) {
    if (run["filters"] != filters || run["cell_size"] != cell_size) continue;
    found = run[nlohmann::json::json_pointer(pointer)].get<double>();
    ++runs;
  }
  EXPECT_EQ(runs, 1) << filters;
  return found;
}

TEST(BenchProgram, ItksFiltersAndOursAreAsNearToTheTruthAsIsSaid) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, std::string(kTinyItk) + "--width 64 --slices 40 --fields elastic");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(says(run.out, {"# tetwarp-bench itk", "width 64; slices 40", "VertexFieldResampleImageFilter",
                             "## Streams", "## Floors"}));
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_EQ(document["runs"].size(), 2 * (3u + 2u + 3u) + 2u + 2u);
  const auto rms = [&](const std::string& filters, std::int64_t cell_size = 1) {
    EXPECT_GT(number_of(document, filters, cell_size, "/ms/median"), 0) << filters;
    EXPECT_GT(number_of(document, filters, cell_size, "/error/compared"), 100) << filters;
    EXPECT_EQ(number_of(document, filters, cell_size, "/error/missing"), 0) << filters;
    return number_of(document, filters, cell_size, "/error/rms");
  };
  const std::string invert = "InvertDisplacementFieldImageFilter", border = ", EnforceBoundaryConditionOff";
  EXPECT_NEAR(rms("PullFieldResampleImageFilter"), 1 / std::sqrt(12.0), 0.02) << "rounded to nearest, no other error";
  for (const std::string itk : {"ResampleImageFilter, DisplacementFieldTransform", "WarpImageFilter"}) {
    EXPECT_NEAR(rms(itk), 1 / std::sqrt(3.0), 0.05) << "truncated, no other error";
    EXPECT_NEAR(rms(itk, 4) / rms("PullFieldResampleImageFilter", 4), 1, 0.02) << "the same vectors between samples";
  }
  EXPECT_LT(rms("VertexFieldResampleImageFilter"), 1);
  EXPECT_GT(rms(invert + ", WarpImageFilter"), 5) << "the border is held still";
  EXPECT_LT(rms("ExactInvertDisplacementFieldImageFilter"), 0.01);
  EXPECT_GT(rms(invert), 0.5) << "the border is held still";
  EXPECT_LT(rms(invert + border), 0.1);
  EXPECT_LT(rms("VertexFieldToJacobianDeterminantFilter"), 0.02);
  EXPECT_LT(rms("DisplacementFieldJacobianDeterminantFilter"), 0.002);
  for (const std::string sampled : {"TransformToVertexFieldFilter", "TransformToDisplacementFieldFilter"}) {
    EXPECT_LT(rms(sampled, 2), 1e-6);
    EXPECT_GT(number_of(document, sampled, 2, "/output_bytes"), 12 * 32 * 32 * 20);
  }
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
    EXPECT_FALSE(entry.is_directory()) << entry.path();
  }
}

TEST(BenchProgram, StreamsWriteTheSameBytesInLessMemory) {
  const Scratch scratch;
  const Outcome run = run_bench(scratch, std::string(kTinyItk) + "--width 192 --slices 128 --tasks stream");
  ASSERT_EQ(run.status, 0) << run.err;
  const nlohmann::json document = nlohmann::json::parse(read_text(scratch / "r.json"));
  ASSERT_EQ(document["streams"].size(), 6u);
  std::map<int, double> peak;
  for (const nlohmann::json& stream : document["streams"]) {
    EXPECT_EQ(stream["differing_bytes"], 0) << stream;
    if (stream["own"] == true) peak[stream["pieces"]] = stream["peak_bytes_beyond_field"];
  }
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "sanitizers keep freed memory";
#endif
  constexpr double kVolumeBytes = 2.0 * 192 * 192 * 128;
  EXPECT_GT(peak[1], 1.9 * kVolumeBytes) << "source and output";
  EXPECT_LT(peak[4], peak[1]);
  EXPECT_LT(peak[16], 0.5 * peak[1]);
}
#endif

TEST(BenchProgram, AVolumeOfZerosExitsWithFourAndWritesNothing) {
  const Scratch scratch;
  write_file(scratch / "zeros.raw", std::string(2 * 5 * 4 * 3, '\0'));
  expect_error(run_bench(scratch, "paper --backend cpu --raw zeros.raw --size 5,4,3 --json r.json"), 4, "zeros");
  EXPECT_FALSE(std::filesystem::exists(scratch / "r.json"));
}

TEST(BenchProgram, AnUnwritableResultIsKnownBeforeTheWork) {
  const Scratch scratch;
  expect_error(run_bench(scratch, kTiny + std::string("--json missing/r.json")), 1, "missing");
}

TEST(BenchProgram, NumbersAreNotWrittenOverWhatIsRead) {
  const Scratch scratch;
  write_file(scratch / "s.json", "a scenario");
  std::filesystem::create_hard_link(scratch / "s.json", scratch / "hard.json");
  for (const std::string json : {"s.json", "hard.json"}) {
    expect_error(run_bench(scratch, "simulate s.json --json " + json), 2, "around the input s.json");
    expect_error(run_bench(scratch, kTiny + ("--raw s.json --size 12,12,9 --csv " + json)), 2,
                 "around the input s.json");
  }
  EXPECT_EQ(read_text(scratch / "s.json"), "a scenario");
}

TEST(BenchProgram, HelpHasAnExample) {
  const Scratch scratch;
  for (const std::string command : {"paper", "gpu", "cpu", "invert", "io", "itk"}) {
    const Outcome run = run_bench(scratch, command + " --help");
    EXPECT_EQ(run.status, 0);
    EXPECT_TRUE(says(run.out, {"Example: tetwarp bench " + command}));
  }
}

}  // namespace
