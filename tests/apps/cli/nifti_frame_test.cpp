// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `--nifti-frame`: one rule for everything that a command reads, and a note wherever it matters.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

constexpr double kApart = 4;  // mm, two voxels, by which the qform lies further to the patient's left

Geometry grid() { return {{12, 10, 8}, {2, 2, 2}, {-20, 10, 5}, glm::dmat3(1)}; }
Geometry moved_grid() {
  Geometry moved = grid();
  moved.origin.x += kApart;
  return moved;
}

/// Rewrites a NIfTI file of equal forms so that the qform is the scanner's and the sform leads to another file.
void part(const std::filesystem::path& path) {
  std::string bytes = read_bytes(path);
  put(bytes, 252, std::int16_t{1});
  put(bytes, 254, std::int16_t{2});
  put(bytes, 268, get<float>(bytes, 268) - static_cast<float>(kApart));
  write_file(path, bytes);
}

class NiftiFrameProgram : public testing::Test {
 protected:
  void SetUp() override {
    write_image(scratch_ / "v.nii", numbered(grid(), VoxelType::i16).view());
    part(scratch_ / "v.nii");
    write_field_file(scratch_ / "f.nii", VertexField{grid(), std::vector<glm::vec3>(960, glm::vec3(1, 0, 0))});
    part(scratch_ / "f.nii");
    write_field_file(scratch_ / "p.nii", PullField{grid(), std::vector<glm::vec3>(960, glm::vec3(1, 0, 0))});
    part(scratch_ / "p.nii");
    write_image(scratch_ / "plain.mha", numbered(grid(), VoxelType::i16).view());
  }

  std::string run(const std::string& arguments, int status = 0) {
    const Outcome outcome = run_tetwarp(scratch_.path(), arguments);
    EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.err;
    return outcome.out + outcome.err;
  }
  Geometry place_of(const char* name) const { return read_image_header(scratch_ / name).geometry; }
  /// Lines that say that two forms differ.
  static std::size_t notes_in(const std::string& text) {
    std::istringstream lines(text);
    std::size_t count = 0;
    for (std::string line; std::getline(lines, line);)
      count += line.starts_with("tetwarp: note: ") && line.find(" mm apart: placed by the ") != std::string::npos;
    return count;
  }

  Scratch scratch_;
};

TEST_F(NiftiFrameProgram, InputFieldsWithAndGridGoTogetherAndEachHasItsNote) {
  const std::string with = " --with v.nii=w.mha --grid v.nii ";
  std::string said = run("deform v.nii -f f.nii -o o.mha --outside background" + with);
  EXPECT_EQ(notes_in(said), 4u) << said;
  EXPECT_TRUE(same_grid(place_of("o.mha"), grid(), 1e-4));
  const AnyVolume by_sform = read_image(scratch_ / "o.mha");
  said = run("deform v.nii -f f.nii -o o.mha --outside background --overwrite --nifti-frame qform" + with);
  EXPECT_EQ(notes_in(said), 4u) << said;
  EXPECT_NE(said.find("placed by the qform, as --nifti-frame says"), std::string::npos) << said;
  EXPECT_TRUE(same_grid(place_of("o.mha"), moved_grid(), 1e-4));
  EXPECT_TRUE(same_grid(place_of("w.mha"), moved_grid(), 1e-4));
  EXPECT_TRUE(same_bytes(read_image(scratch_ / "o.mha"), by_sform)) << "all moved together";
  EXPECT_TRUE(same_bytes(read_image(scratch_ / "w.mha"), by_sform)) << "what goes along too";
  EXPECT_NE(read_bytes(scratch_ / "o.mha.json").find("\"nifti_frame\": \"qform\""), std::string::npos);
  EXPECT_NE(read_bytes(scratch_ / "o.mha.json").find("mm apart"), std::string::npos);
}

TEST_F(NiftiFrameProgram, OneAloneElsewhereShows) {
  run("deform plain.mha -f f.nii -o s.mha --outside refuse");
  run("deform plain.mha -f f.nii -o q.mha --outside refuse --nifti-frame qform", 4);
  EXPECT_EQ(notes_in(run("deform plain.mha --pull-field p.nii -o p.mha --outside background")), 1u);
  run("deform plain.mha --pull-field p.nii -o pq.mha --outside background --nifti-frame qform");
  EXPECT_FALSE(same_bytes(read_image(scratch_ / "p.mha"), read_image(scratch_ / "pq.mha")));
}

TEST_F(NiftiFrameProgram, LikeIsPlacedByItInFieldAndInvert) {
  EXPECT_EQ(notes_in(run("field identity --like v.nii -o a.mha")), 1u);
  EXPECT_TRUE(same_grid(place_of("a.mha"), grid(), 1e-4));
  EXPECT_EQ(notes_in(run("field identity --like v.nii -o b.mha --nifti-frame qform")), 1u);
  EXPECT_TRUE(same_grid(place_of("b.mha"), moved_grid(), 1e-4));
  EXPECT_EQ(notes_in(run("invert f.nii --like v.nii -o i.mha --nifti-frame qform")), 2u);
  EXPECT_TRUE(same_grid(place_of("i.mha"), moved_grid(), 1e-4));
  EXPECT_EQ(notes_in(run("field identity --like plain.mha -o c.mha")), 0u);
}

TEST_F(NiftiFrameProgram, LabelsAndOverlaysArePlacedByItToo) {
  write_image(scratch_ / "j.nii", numbered(grid(), VoxelType::f32).view());
  part(scratch_ / "j.nii");
  write_file(scratch_ / "push.json",
             R"({"method": "chainmail", "cell_size": 2, "tissues": [{"name": "all"}], "hold": [{"border": true}],
  "move": [{"name": "hand", "by_mm": [0, 1, 0], "handle": {"at": {"mm": [-5, 19, 12]}, "radius_mm": 3}}]})");
  for (const char* frame : {"sform", "qform"}) {
    const std::string option = std::string(" --backend cpu --nifti-frame ") + frame;
    run("simulate push.json v.nii --labels v.nii -o s-" + std::string(frame) + ".mha" + option);
    run("deform v.nii --scenario push.json --labels v.nii -o d-" + std::string(frame) + ".mha" + option);
    run("render v.nii --view axial --overlay jacobian=j.nii -o r-" + std::string(frame) + ".png" + option);
  }
  EXPECT_EQ(read_bytes(scratch_ / "r-sform.png"), read_bytes(scratch_ / "r-qform.png"));
}

TEST_F(NiftiFrameProgram, InfoHasTheNoteAndThePlace) {
  for (const char* name : {"v.nii", "f.nii"}) {
    const bool field = std::string(name) == "f.nii";
    for (const bool qform : {false, true}) {
      const auto document =
          nlohmann::json::parse(run(std::string("info --json ") + name + (qform ? " --nifti-frame qform" : "")));
      EXPECT_EQ(document["notes"].size(), 1u);
      const auto& place = document[field ? "lattice" : "geometry"];
      EXPECT_NEAR(place["origin_lps_mm"][0].get<double>(), grid().origin.x + (qform ? kApart : 0), 1e-4) << name;
    }
    EXPECT_NE(run(std::string("info ") + name).find("lie up to 4 mm apart"), std::string::npos);
  }
  EXPECT_TRUE(nlohmann::json::parse(run("info --json plain.mha"))["notes"].empty());
  run("info v.nii --nifti-frame other", 2);
}

}  // namespace
