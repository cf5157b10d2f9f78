// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp truth` and `tetwarp score`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kCases = " --case elastic:amplitude=6,spacing=80 --case slip:amplitude=8 --case shift";
constexpr const char* kRoles = " --labels labels.nii.gz --label lung=2 --label bone=3";

class TruthProgram : public testing::Test {
 protected:
  /// Runs the program in a folder of this test. @return the exit status
  int run(const std::string& arguments) {
    outcome_ = run_tetwarp(scratch_.path(), arguments);
    return outcome_.status;
  }
  void make_phantom() {
    ASSERT_EQ(run("phantom -o ct.nii.gz --labels labels.nii.gz --size 64,60,48 --spacing 6.4,6.8,6.25 --noise 0"), 0);
  }
  /// A set of three cases with its truth as results.
  void make_set(const std::string& more = "", const std::string& suffix = ".nii.gz") {
    make_phantom();
    ASSERT_EQ(run("truth ct.nii.gz -o set --dense" + std::string(kCases) + kRoles + more), 0) << outcome_.err;
    fs::create_directories(at("exact"));
    for (const std::string& name : names())
      fs::copy_file(at("set/" + name + "/inverse" + suffix), at("exact/" + name + suffix));
  }
  std::vector<std::string> names() const { return {"elastic-amplitude-6-spacing-80", "slip-amplitude-8", "shift"}; }
  fs::path at(const std::string& name) const { return scratch_.path() / name; }
  json document(const std::string& name) const { return json::parse(read_text(at(name))); }
  /// What a file says of each case. A copy: a loop over a part of a document that nobody holds has nothing left to
  /// read.
  json scores(const std::string& name) const { return document(name).at("scores"); }
  const std::string& err() const { return outcome_.err; }
  const std::string& out() const { return outcome_.out; }

 private:
  Scratch scratch_;
  Outcome outcome_;
};

TEST_F(TruthProgram, TheTruthOfASetIsExact) {
  make_set(" --noise 10");
  ASSERT_EQ(run("score set -r exact --json s.json --csv s.csv --html s.html"), 0) << err() << out();
  const json found = scores("s.json");
  ASSERT_EQ(found.size(), 3U);
  for (const json& score : found) {
    EXPECT_LT(score.at("body").at("largest_mm").get<double>(), 1e-4) << score;
    // Across the surface of a slip neighbours differ by more than a gradient.
    const bool slips = score.at("case") == "slip-amplitude-8";
    EXPECT_EQ(score.at("jacobian").at("folded"), 0) << score;
    ASSERT_EQ(score.contains("near_slip"), slips);
    if (slips) {
      EXPECT_GT(score.at("near_slip").at("points").get<int>(), 1000);
      EXPECT_LT(score.at("near_slip").at("largest_mm").get<double>(), 1e-4);
      const json& bands = score.at("from_slip");
      ASSERT_EQ(bands.size(), 3U);
      EXPECT_NEAR(bands[1].at("from_mm").get<double>() - bands[0].at("from_mm").get<double>(), 10, 1e-9);
      EXPECT_TRUE(bands[2].at("to_mm").is_null());
      std::uint64_t points = 0;
      for (const json& band : bands) points += band.at("points").get<std::uint64_t>();
      EXPECT_EQ(points, score.at("body").at("points").get<std::uint64_t>());
    }
    for (const auto& [label, surface] : score.at("surfaces").items())
      EXPECT_LT(surface.at("mean_mm").get<double>(), 0.1) << label;
    EXPECT_GT(score.at("mean_mm_read_as").at("no displacement").get<double>(), 0.5);
    for (const auto& [label, dice] : score.at("dice").items()) EXPECT_GT(dice.get<double>(), 0.99) << label;
    EXPECT_GT(score.at("landmarks").at("points").get<int>(), 100);
    EXPECT_TRUE(score.at("passed").get<bool>());
  }
  // Noise is another one in each volume.
  const AnyVolume moving = read_image(at("set/moving/moving.nii.gz")), ct = read_image(at("ct.nii.gz"));
  std::size_t differ = 0;
  for (std::size_t n = 0; n < ct.as<std::int16_t>().size(); ++n)
    differ += moving.as<std::int16_t>()[n] != ct.as<std::int16_t>()[n];
  EXPECT_GT(differ, ct.as<std::int16_t>().size() / 2);
  const std::string page = read_text(at("s.html")), table = read_text(at("s.csv"));
  EXPECT_NE(page.find("data:image/png;base64,iVBOR"), std::string::npos);
  EXPECT_NE(page.find("AAPM TG-132"), std::string::npos);
  EXPECT_NE(page.find("0 or below</td><td>0</td><td>0</td>"), std::string::npos) << "counts are whole";
  EXPECT_NE(table.find("exact,shift,body,"), std::string::npos);
}

TEST_F(TruthProgram, TheSameAgainAndAfterAnInterruption) {
  make_set(" --noise 10 --compress 0", ".nii");
  const std::string again =
      "truth ct.nii.gz -o again --dense" + std::string(kCases) + kRoles + " --noise 10 --compress 0";
  ASSERT_EQ(run(again + " --threads 1"), 0) << err();
  // As if the program had been killed after the first case.
  fs::remove(at("again/set.json"));
  fs::remove_all(at("again/shift"));
  fs::remove_all(at("again/slip-amplitude-8"));
  EXPECT_EQ(run(again), 1);
  EXPECT_NE(err().find("--resume"), std::string::npos);
  EXPECT_EQ(run("score again -r exact"), 4);
  EXPECT_EQ(run(again + " --resume --noise 11"), 2) << "an option given twice";
  ASSERT_EQ(run(again + " --resume"), 0) << err();
  const json first = document("set/set.json"), second = document("again/set.json");
  EXPECT_EQ(first.at("sha256"), second.at("sha256"));
  EXPECT_GT(first.at("sha256").size(), 15U);
  EXPECT_EQ(run(again + " --resume"), 0) << "the set is complete";
  EXPECT_EQ(run(again), 1);
  // What is missing from a case is made again.
  fs::remove(at("again/set.json"));
  fs::remove(at("again/shift/jacobian.nii"));
  ASSERT_EQ(run(again + " --resume"), 0) << err();
  EXPECT_TRUE(fs::exists(at("again/shift/jacobian.nii")));
}

TEST_F(TruthProgram, AnotherInputDoesNotGoOnWithASet) {
  make_phantom();
  ASSERT_EQ(run("truth ct.nii.gz -o set --case shift"), 0) << err();
  fs::remove(at("set/set.json"));
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift:x=1 --resume"), 1);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --cell-size 8 --resume"), 1);
  EXPECT_NE(err().find("another input, other options"), std::string::npos);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --with ct.nii.gz --resume"), 1);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --resume"), 0) << err();
  fs::remove(at("set/set.json"));
  std::ofstream(at("set/plan.json")) << "{\"cut";
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --resume"), 1);
  fs::create_directories(at("foreign"));
  std::ofstream(at("foreign/notes.txt")) << "mine";
  EXPECT_EQ(run("truth ct.nii.gz -o foreign --case shift --resume"), 1);
  EXPECT_FALSE(fs::exists(at("foreign/plan.json")));
}

TEST_F(TruthProgram, LabelsOfFloatAndTheExactSlipPass) {
  make_phantom();
  const AnyVolume labels = read_image(at("labels.nii.gz"));
  Volume<float> real{labels.geometry(), {}};
  for (const std::uint8_t label : labels.as<std::uint8_t>()) real.voxels.push_back(label);
  write_image(at("real.nii.gz"), view(real));
  ASSERT_EQ(
      run("truth ct.nii.gz -o set --dense --case slip:amplitude=20 --labels real.nii.gz --label lung=2 --label bone=3"),
      0)
      << err();
  EXPECT_EQ(run("score set -r set/slip-amplitude-20/inverse.nii.gz"), 0) << out() << err();
  real.voxels[77] = 1.5F;
  write_image(at("real.nii.gz"), view(real));
  EXPECT_EQ(run("truth ct.nii.gz -o other --case shift --labels real.nii.gz"), 4);
  EXPECT_FALSE(fs::exists(at("other")));
}

TEST_F(TruthProgram, AResultWithoutAnyPlaceFails) {
  make_phantom();
  ASSERT_EQ(run("truth ct.nii.gz -o set --dense --case shift"), 0) << err();
  PullField field = read_pull_field({at("set/shift/inverse.nii.gz")});
  for (glm::vec3& by : field.displacement) by = glm::vec3(NAN);
  write_field_file(at("none.mha"), field);
  std::ofstream(at("limits.json")) << R"({"missing_voxels": {"most": 1e9}, "mean_mm": {"most": 1}})";
  EXPECT_EQ(run("score set -r none.mha --limits limits.json"), 3);
}

TEST_F(TruthProgram, WrongResultsAreNamed) {
  make_set();
  PullField field = read_pull_field({at("exact/shift.nii.gz")});
  const auto result = [&](const std::string& folder) {
    fs::create_directories(at(folder));
    write_field_file(at(folder + "/shift.mha"), field);
  };
  for (glm::vec3& by : field.displacement) by = -by;
  result("negative");
  EXPECT_EQ(run("score set -r negative --json n.json"), 3);
  EXPECT_NE(err().find("this looks like the inverse"), std::string::npos) << err();
  EXPECT_NE(out().find("elastic-amplitude-6-spacing-80: no result in negative"), std::string::npos);
  for (glm::vec3& by : field.displacement) by = -by + glm::vec3(0, 0, 3);
  result("off");
  EXPECT_EQ(run("score set -r exact -r off --json o.json"), 3);
  for (const json& score : scores("o.json")) {
    if (score.at("case") != "shift" || score.at("result") != "off") continue;
    EXPECT_NEAR(score.at("body").at("mean_mm").get<double>(), 3, 1e-4);
    EXPECT_NEAR(score.at("landmarks").at("mean_mm").get<double>(), 3, 1e-3);
    EXPECT_FALSE(score.at("passed").get<bool>());
  }
  // Wider limits, and one on the whole body.
  std::ofstream(at("limits.json"))
      << R"({"landmarks_mean_mm": {"most": 4, "source": "ours"}, "mean_mm": {"most": 3.5}})";
  fs::copy_file(at("exact/slip-amplitude-8.nii.gz"), at("off/slip-amplitude-8.nii.gz"));
  fs::copy_file(at("exact/elastic-amplitude-6-spacing-80.nii.gz"), at("off/elastic-amplitude-6-spacing-80.nii.gz"));
  EXPECT_EQ(run("score set -r off --limits limits.json --json l.json"), 0) << out();
  std::ofstream(at("limits.json")) << R"({"beauty": {"most": 4}})";
  EXPECT_EQ(run("score set -r off --limits limits.json"), 4);
}

TEST_F(TruthProgram, BothDirectionsAreScoredAndAreConsistent) {
  make_set();
  fs::create_directories(at("back"));
  for (const std::string& name : names())
    fs::copy_file(at("set/" + name + "/forward.nii.gz"), at("back/" + name + ".nii.gz"));
  EXPECT_EQ(run("score set -r exact --back back --json there.json"), 0) << out() << err();
  EXPECT_EQ(run("score set -r back --direction forward --json back.json --html back.html"), 0) << out() << err();
  for (const json& score : scores("there.json")) {
    EXPECT_LT(score.at("inverse_consistency").at("mean_mm").get<double>(), 0.1);
    EXPECT_GT(score.at("inverse_consistency").at("points").get<int>(), 10000);
  }
  for (const json& score : scores("back.json")) {
    EXPECT_EQ(score.at("body").at("largest_mm"), 0) << score;
    EXPECT_LT(score.at("landmarks").at("largest_mm").get<double>(), 1e-4)
        << "landmarks are voxel centres of the moving";
    EXPECT_GT(score.at("mean_mm_read_as").at("no displacement").get<double>(), 0.5);
    EXPECT_FALSE(score.contains("dice"));
  }
  EXPECT_EQ(document("back.json").at("direction"), "forward");
  // A field that leads the other way states it, and is refused.
  EXPECT_EQ(run("score set -r back"), 3);
  EXPECT_NE(out().find("cannot be scored: a forward field where a pull field is expected"), std::string::npos) << out();
  EXPECT_EQ(run("score set -r exact -r exact --back back"), 2);
  EXPECT_EQ(run("score set -r exact --back nowhere"), 4);
}

TEST_F(TruthProgram, ThreeResultsOfThreeVolumesAreTransitive) {
  make_phantom();
  ASSERT_EQ(run("truth ct.nii.gz -o set --dense --case shift:x=4,y=0,z=0 --case shift:x=0,y=-6,z=0"), 0) << err();
  fs::create_directories(at("exact"));
  fs::create_directories(at("between"));
  const std::string first = "shift-x-4-y-0-z-0", second = "shift-x-0-y--6-z-0";
  for (const std::string& name : {first, second})
    fs::copy_file(at("set/" + name + "/inverse.nii.gz"), at("exact/" + name + ".nii.gz"));
  PullField between = read_pull_field({at("exact/" + first + ".nii.gz")});
  // From the first fixed volume to the second: back by the first shift, on by the second; here 2 mm too far.
  for (glm::vec3& by : between.displacement) by = glm::vec3(-4, -6, 2);
  write_field_file(at("between/" + first + "--" + second + ".mha"), between);
  EXPECT_EQ(run("score set -r exact --triples between --json t.json"), 0) << out() << err();
  const json found = scores("t.json");
  EXPECT_NEAR(found[0].at("transitivity").at(second).at("mean_mm").get<double>(), 2, 1e-3);
  EXPECT_FALSE(found[1].contains("transitivity"));
  std::ofstream(at("limits.json")) << R"({"transitivity_mean_mm": {"most": 1}})";
  EXPECT_EQ(run("score set -r exact --triples between --limits limits.json"), 3);
  EXPECT_EQ(run("score set -r exact --triples ct.nii.gz"), 4);
  EXPECT_EQ(run("score set -r exact --triples between --direction forward"), 2);
}

TEST_F(TruthProgram, ADoseGoesAlongAndIsCompared) {
  make_phantom();
  Volume<float> dose{read_image(at("ct.nii.gz")).geometry(), {}};
  dose.geometry.size /= 2;
  dose.geometry.spacing *= 2.0;
  for (std::int64_t n = 0; n < voxel_count(dose.geometry); ++n) {
    const double x = static_cast<double>(n % 32 - 16), y = static_cast<double>(n / 32 % 30 - 15);
    dose.voxels.push_back(static_cast<float>(60 * std::exp(-(x * x + y * y) / 20)));
  }
  write_image(at("dose.nii.gz"), view(dose));
  ASSERT_EQ(run("truth ct.nii.gz -o set --dense --case elastic:amplitude=9 --dose dose.nii.gz"), 0) << err();
  EXPECT_EQ(read_image(at("set/elastic-amplitude-9/dose.nii.gz")).geometry().size, dose.geometry.size);
  EXPECT_EQ(run("score set -r set/elastic-amplitude-9/inverse.nii.gz --json exact.json"), 0) << out();
  EXPECT_GT(scores("exact.json")[0].at("gamma").at("passing_percent").get<double>(), 99.5);
  PullField off = read_pull_field({at("set/elastic-amplitude-9/inverse.nii.gz")});
  for (glm::vec3& by : off.displacement) by.x += 9;
  write_field_file(at("off.mha"), off);
  EXPECT_EQ(run("score set -r off.mha --json off.json --html off.html"), 3);
  EXPECT_LT(scores("off.json")[0].at("gamma").at("passing_percent").get<double>(), 80);
  EXPECT_NE(read_text(at("off.html")).find("global gamma index of 3 %, 2 mm"), std::string::npos);
}

TEST_F(TruthProgram, AManifestMakesASetOfEachRow) {
  make_phantom();
  fs::create_directories(at("cohort"));
  fs::copy_file(at("ct.nii.gz"), at("cohort/ct.nii.gz"));
  fs::copy_file(at("labels.nii.gz"), at("cohort/labels.nii.gz"));
  std::ofstream(at("cohort/scans.csv")) << "study,input,labels,label,case,noise\n"
                                           "first,ct.nii.gz,labels.nii.gz,lung=2;bone=3,breathing;shift,12\n"
                                           "second,ct.nii.gz,,,,\n"
                                           "third,broken.nii.gz,,,,\n";
  std::ofstream(at("cohort/broken.nii.gz")) << "no volume";
  EXPECT_EQ(run("truth cohort/scans.csv -o sets --case rotation --seed 4"), 3);
  EXPECT_NE(err().find("third"), std::string::npos) << err();
  EXPECT_NE(err().find("1 of 3 studies have no set"), std::string::npos) << err();
  EXPECT_TRUE(fs::exists(at("sets/first/breathing/fixed.nii.gz")));
  EXPECT_TRUE(fs::exists(at("sets/first/shift/labels.nii.gz")));
  EXPECT_TRUE(fs::exists(at("sets/second/rotation/fixed.nii.gz")));
  EXPECT_FALSE(fs::exists(at("sets/third/set.json")));
  EXPECT_EQ(document("sets/first/set.json").at("options").at("noise_seed"), 4);
  // The same as the row's own command.
  ASSERT_EQ(run("truth ct.nii.gz -o alone --case breathing --case shift --noise 12 --seed 4 --labels labels.nii.gz "
                "--label lung=2 --label bone=3"),
            0);
  EXPECT_EQ(document("alone/set.json").at("sha256"), document("sets/first/set.json").at("sha256"));
  // All that is wrong is told at once, and nothing is made.
  std::ofstream(at("cohort/bad.csv")) << "study,input,labels,organ\n"
                                         "a,nothing.nii.gz,,\n"
                                         "a,ct.nii.gz,,\n"
                                         "../b,ct.nii.gz,,7\n"
                                         "c,,,\n";
  EXPECT_EQ(run("truth cohort/bad.csv -o more --case wobble"), 4);
  for (const char* what :
       {"bad.csv:2: no such file", "bad.csv:3: the study \"a\" is there twice", "\"../b\" is no name",
        "unknown key \"organ\"", "bad.csv:5: no input", "no kind of deformation \"wobble\""})
    EXPECT_NE(err().find(what), std::string::npos) << what << "\n" << err();
  EXPECT_FALSE(fs::exists(at("more")));
  EXPECT_EQ(run("truth cohort/scans.csv -o more --labels labels.nii.gz"), 2);
}

TEST_F(TruthProgram, NoiseIsMeasuredOfTheVolume) {
  ASSERT_EQ(run("phantom -o ct.nii.gz --size 128,120,40 --spacing 3.2,3.4,7.5 --noise 20"), 0);
  ASSERT_EQ(run("truth ct.nii.gz -o set --case shift --noise measured"), 0) << err();
  const json noise = document("set/set.json").at("noise");
  EXPECT_TRUE(noise.at("measured").get<bool>());
  EXPECT_GT(noise.at("standard_deviation_hu").get<double>(), 19);
  EXPECT_LT(noise.at("standard_deviation_hu").get<double>(), 30);
  EXPECT_EQ(noise.at("kernel").size(), 81U);
  EXPECT_EQ(run("truth ct.nii.gz -o other --case shift --noise much"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o other --case shift --noise 2000"), 2);
}

TEST_F(TruthProgram, LandmarksAreScored) {
  make_set();
  fs::create_directories(at("points"));
  for (const std::string& name : names()) fs::copy_file(at("set/moving/landmarks.csv"), at("points/" + name + ".csv"));
  EXPECT_EQ(run("score set -r points --json p.json"), 0) << out() << err();
  for (const json& score : scores("p.json")) EXPECT_EQ(score.at("landmarks").at("largest_mm"), 0);
  std::ofstream(at("points/shift.csv")) << "x,y,z\n1,2,3\n";
  // One that cannot be read, or two, lose nothing of the others.
  EXPECT_EQ(run("score set -r points --json q.json"), 3);
  EXPECT_NE(out().find("shift: cannot be scored: "), std::string::npos) << out();
  EXPECT_TRUE(scores("q.json").at(0).at("passed").get<bool>());
  fs::copy_file(at("set/shift/inverse.nii.gz"), at("points/shift.nii.gz"));
  EXPECT_EQ(run("score set -r points"), 3);
  EXPECT_NE(out().find("several results of shift"), std::string::npos) << out();
  EXPECT_EQ(run("score set -r points --csv points/all.csv"), 2) << "among the results";
}

/// An array of NumPy, z, y, x, as a registration in Python would save it.
void write_array(const fs::path& path, const glm::i64vec3& size, const std::vector<glm::vec3>& values) {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(size.z) + ", " +
                       std::to_string(size.y) + ", " + std::to_string(size.x) + ", 3), }";
  header.resize(117, ' ');
  fs::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << std::string("\x93NUMPY\x01\0", 8) << static_cast<char>(header.size() + 1) << '\0' << header << '\n';
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(glm::vec3)));
}

TEST_F(TruthProgram, WhatAResultDoesNotSayStandsBehindItsFolder) {
  make_phantom();
  ASSERT_EQ(run("truth ct.nii.gz -o set --dense --case elastic:amplitude=6,spacing=80 --case shift"), 0) << err();
  for (const char* name : {"elastic-amplitude-6-spacing-80", "shift"}) {
    const fs::path folder = at("set") / name, file = std::string(name) + ".npy";
    const PullField inverse = read_pull_field(folder / "inverse.nii.gz");
    const VertexField forward = read_forward_field(folder / "forward.nii.gz");
    write_array(at("there") / file, inverse.grid.size, inverse.displacement);
    write_array(at("back") / file, forward.lattice.size, forward.displacement);
  }
  const std::string options = ":order=zyx,units=mm";
  EXPECT_EQ(run("score set -r there" + options + " --back back" + options + " --json a.json"), 0) << out() << err();
  const json found = scores("a.json");
  ASSERT_EQ(found.size(), 2U);
  for (const json& score : found) {
    EXPECT_LT(score.at("body").at("largest_mm").get<double>(), 1e-3);
    EXPECT_LT(score.at("inverse_consistency").at("largest_mm").get<double>(), 2);
    EXPECT_EQ(score.at("result"), "there" + options);
  }
  // An array may be anything.
  EXPECT_EQ(run("score set -r there"), 2);
  EXPECT_NE(err().find("order="), std::string::npos) << err();
  EXPECT_EQ(run("score set -r nothing" + options), 4);
  fs::remove(at("there/shift.npy"));
  fs::copy_file(at("set/moving/landmarks.csv"), at("there/shift.csv"));
  EXPECT_EQ(run("score set -r there" + options), 3);
  EXPECT_NE(out().find("points, which take no options"), std::string::npos) << out();
}

#ifdef TETWARP_WITH_DCMTK
TEST_F(TruthProgram, OfASeriesEachCaseIsASeriesToo) {
  ASSERT_EQ(run("phantom -o ct --size 48,44,30 --spacing 8,9,10 --noise 0"), 0);
  ASSERT_EQ(run("truth ct -o set --case elastic:amplitude=8,spacing=90 --noise 20"), 0) << err();
  const std::string folder = "set/elastic-amplitude-8-spacing-90/";
  ASSERT_EQ(run("deform ct -f set/fields/elastic-amplitude-8-spacing-90.mha --outside background -o again.nii.gz"), 0);
  ASSERT_EQ(run("deform " + folder + "dicom-without-noise -f identity -o series.nii.gz"), 0) << err();
  const AnyVolume again = read_image(at("again.nii.gz")), series = read_image(at("series.nii.gz")),
                  fixed = read_image(at(folder + "fixed.nii.gz"));
  const auto expected = again.as<std::int16_t>(), written = series.as<std::int16_t>(), noisy = fixed.as<std::int16_t>();
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), written.begin(), written.end()));
  double squares = 0;
  for (std::size_t n = 0; n < noisy.size(); ++n) squares += std::pow(noisy[n] - expected[n], 2);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(noisy.size())), 20, 2);
}
#endif

TEST_F(TruthProgram, WhatCannotBeMadeIsRefused) {
  make_phantom();
  EXPECT_EQ(run("truth ct.nii.gz -o set --case wobble"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --case shift"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case breathing"), 2);
  EXPECT_NE(err().find("--label lung=N"), std::string::npos);
  EXPECT_EQ(run("truth ct.nii.gz -o set --label lung=2"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o set --labels labels.nii.gz --label liver=8"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o set --labels labels.nii.gz --label lung=2.5"), 2);
  EXPECT_EQ(run("truth missing.nii.gz -o set"), 4);
  EXPECT_FALSE(fs::exists(at("set")));
  EXPECT_EQ(run("truth ct.nii.gz -o set --labels labels.nii.gz --label lung=99 --case elastic"), 4);
  EXPECT_EQ(run("truth ct.nii.gz -o set --case shift --with body.nii.gz"), 2);
  EXPECT_EQ(run("truth ct.nii.gz -o 'se=t' --case shift"), 2);
  EXPECT_FALSE(fs::exists(at("set")));
  EXPECT_EQ(run("truth ct.nii.gz -o set --case elastic:amplitude=60,spacing=30"), 4);
  EXPECT_NE(err().find("folds"), std::string::npos);
  EXPECT_EQ(run("score set -r ct.nii.gz"), 4);
  EXPECT_EQ(run("score nowhere -r ct.nii.gz"), 4);
  std::ofstream(at("set/set.json")) << R"({"set": {"moving": "../ct.nii.gz", "cases": []}})";
  EXPECT_EQ(run("score set -r ct.nii.gz"), 4);
  EXPECT_NE(err().find("not in the set"), std::string::npos);
}

}  // namespace
