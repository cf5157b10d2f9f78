// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "tests/support/png_picture.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using test::read_png;

/// Runs `render` on a small phantom, as the file `ct.nii` and as the series `series`.
class RenderProgram : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* output : {"ct.nii", "series"}) {
      ASSERT_EQ(run(std::string("phantom --size 64,64,40 --spacing 6,6,8 --quiet -o ") + output).status, 0);
    }
  }
  Outcome run(const std::string& arguments) const { return run_tetwarp(scratch_.path(), arguments); }
  /// Renders without text into NAME and returns its bytes.
  std::string picture(const std::string& name, const std::string& arguments) const {
    const Outcome made = run("render " + arguments + " -o " + name + " --plain --size 96,96 --quiet");
    EXPECT_EQ(made.status, 0) << made.err;
    return read_text(scratch_ / name);
  }
  void refused(const std::string& arguments, int status, const std::vector<std::string>& words) const {
    const Outcome made = run("render " + arguments);
    EXPECT_EQ(made.status, status) << arguments << ": " << made.err;
    EXPECT_TRUE(says(made.err, words)) << arguments;
  }

  Scratch scratch_;
};

TEST_F(RenderProgram, DicomAndNiftiGiveTheSamePicture) {
  for (const std::string look : {"--transfer ct-bone --angle 30", "--view montage", "--transfer xray"})
    EXPECT_EQ(picture("a.png", "ct.nii --overwrite " + look), picture("b.png", "series --overwrite " + look)) << look;
}

TEST_F(RenderProgram, WhatIsDeformedFirstIsWhatDeformWrites) {
  const std::string field = " -f twist:angle=40 -f wave:amplitude=20,wavelength=150 ";
  ASSERT_EQ(run("deform ct.nii -o deformed.nii --quiet" + field).status, 0);
  const std::string still = picture("still.png", "ct.nii --transfer ct-skin");
  const std::string first = picture("first.png", "ct.nii --transfer ct-skin" + field);
  EXPECT_EQ(first, picture("second.png", "deformed.nii --transfer ct-skin"));
  EXPECT_NE(first, still);
}

TEST_F(RenderProgram, ABodyFromTheFrontHasItsHeartOnTheRight) {
  // The phantom's heart reaches further to the patient's left, which is right in the picture.
  picture("xray.png", "ct.nii --transfer xray");
  const Picture seen = read_png(scratch_ / "xray.png");
  double left = 0, right = 0;
  for (int y = 40; y < 56; ++y) {
    for (int x = 0; x < 48; ++x) {
      left += seen.at(x, y)[0];
      right += seen.at(95 - x, y)[0];
    }
  }
  EXPECT_GT(right, left * 1.01);
}

TEST_F(RenderProgram, FramesGrowFromNothingToTheWholeField) {
  const std::string look = "ct.nii --transfer ct-skin", field = " -f wave:amplitude=20,wavelength=150 --cell-size 2";
  const Outcome made = run("render " + look + field + " --frames 4 -o grow.png --plain --size 96,96 --quiet");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_FALSE(fs::exists(scratch_ / "grow.png"));
  EXPECT_FALSE(fs::exists(scratch_ / "grow.0005.png"));
  std::vector<std::string> frames;
  for (const char* number : {"1", "2", "3", "4"})
    frames.push_back(read_text(scratch_ / ("grow.000" + std::string(number) + ".png")));
  EXPECT_EQ(frames[0], picture("still.png", look));
  EXPECT_EQ(frames[3], picture("whole.png", look + field));
  EXPECT_NE(frames[1], frames[0]);
  EXPECT_NE(frames[1], frames[2]);
}

TEST_F(RenderProgram, ATurntableGoesAround) {
  ASSERT_EQ(run("render ct.nii --turntable 4 -o turn.png --plain --size 96,96 --quiet").status, 0);
  ASSERT_EQ(run("render ct.nii --turntable 2 --angle 90 -o half.png --plain --size 96,96 --quiet").status, 0);
  EXPECT_EQ(read_text(scratch_ / "turn.0002.png"), read_text(scratch_ / "half.0001.png"));
  EXPECT_EQ(read_text(scratch_ / "turn.0004.png"), read_text(scratch_ / "half.0002.png"));
  EXPECT_NE(read_text(scratch_ / "turn.0001.png"), read_text(scratch_ / "turn.0003.png"));
}

TEST_F(RenderProgram, ASequenceTakesAFieldForEachPicture) {
  for (const char* angle : {"10", "20"})
    ASSERT_EQ(
        run(std::string("field twist:angle=") + angle + " --like ct.nii --cell-size 4 --quiet -o t" + angle + ".mha")
            .status,
        0);
  ASSERT_EQ(run("render ct.nii --sequence t10.mha t20.mha -o s.png --plain --size 96,96 --quiet").status, 0);
  EXPECT_EQ(read_text(scratch_ / "s.0001.png"), picture("a.png", "ct.nii -f t10.mha"));
  EXPECT_EQ(read_text(scratch_ / "s.0002.png"), picture("b.png", "ct.nii -f t20.mha"));
}

TEST_F(RenderProgram, WhatAFieldDoesNotSayIsNotedOfASequenceAndOfALatticeToo) {
  for (const std::string angle : {"10", "20"}) {
    const std::string name = "t" + angle + ".mha";
    ASSERT_EQ(run("field twist:angle=" + angle + " --like ct.nii --cell-size 16 --quiet -o " + name).status, 0);
    std::string text = read_text(scratch_ / name);
    const std::size_t key = text.find("tetwarp_direction");
    ASSERT_NE(key, std::string::npos);
    text.erase(key, text.find('\n', key) + 1 - key);
    write_file(scratch_ / name, text);
  }
  const auto expect_noted = [&](const std::string& arguments, const std::vector<std::string>& files) {
    const Outcome made = run("render ct.nii --size 96,96 --overwrite " + arguments);
    EXPECT_EQ(made.status, 0) << made.err;
    for (const std::string& file : files) {
      const std::string note = "tetwarp: note: " + file + " does not say its direction: taken as forward\n";
      EXPECT_TRUE(says(made.err, {note})) << arguments;
      EXPECT_EQ(made.err.find(note), made.err.rfind(note)) << "once: " << made.err;
    }
  };
  expect_noted("-o p.png -f t10.mha", {"t10.mha"});
  expect_noted("-o s.png --sequence t10.mha t20.mha t10.mha", {"t10.mha", "t20.mha"});
  expect_noted("-o l.png --view axial --overlay lattice=t20.mha", {"t20.mha"});
}

TEST_F(RenderProgram, OverlaysOfAFieldAreThoseOfTheMapsThatDeformWrites) {
  const std::string field = " -f twist:angle=30 -f translate:by=60/0/0 --cell-size 4 --outside background";
  ASSERT_EQ(
      run("deform ct.nii -o d.nii.gz --jacobian j.nii.gz --coverage c.nii.gz --folds f.nii.gz --quiet" + field).status,
      0);
  ASSERT_EQ(run("field twist:angle=30 translate:by=60/0/0 --like ct.nii --cell-size 4 -o t.mha --quiet").status, 0);
  for (const std::string view : {"--view montage", "--transfer ct-skin"}) {
    for (const auto& [name, file] : {std::pair<std::string, std::string>{"jacobian", "j.nii.gz"},
                                     {"coverage", "c.nii.gz"},
                                     {"folds", "f.nii.gz"},
                                     {"lattice", "t.mha"}}) {
      const std::string before = picture("p.png", "ct.nii --overwrite " + view + field);
      const std::string of_field = picture("a.png", "ct.nii --overwrite " + view + field + " --overlay " + name);
      EXPECT_EQ(of_field, picture("b.png", "d.nii.gz --overwrite " + view + " --overlay " + name + "=" + file))
          << view << name;
      const bool nothing_to_show = name == "folds" || (name == "coverage" && view == "--transfer ct-skin");
      if (!nothing_to_show) {
        EXPECT_NE(of_field, before) << view << name;
      }
    }
  }
}

TEST_F(RenderProgram, TextLettersAndBarAreOverThePicture) {
  picture("plain.png", "ct.nii");
  ASSERT_EQ(run("render ct.nii -o named.png --size 96,96 --quiet").status, 0);
  const Picture plain = read_png(scratch_ / "plain.png"), named = read_png(scratch_ / "named.png");
  int changed = 0;
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 96; ++x) changed += plain.at(x, y) != named.at(x, y);
  EXPECT_GT(changed, 100);
  EXPECT_LT(changed, 96 * 96 / 2);
}

TEST_F(RenderProgram, AVolumeThatIsNoCtIsShownByItsBrightest) {
  // A field's Jacobian: floats around 1.
  ASSERT_EQ(run("deform ct.nii -f bubble:radius=150,strength=0.6 -o d.nii.gz --jacobian j.nii.gz --quiet").status, 0);
  picture("j.png", "j.nii.gz");
  const Picture seen = read_png(scratch_ / "j.png");
  EXPECT_GT(seen.at(48, 48)[0], 200);
  EXPECT_LT(seen.at(20, 48)[0], 150);
}

TEST_F(RenderProgram, FilmsAreMadeWhereTheEncoderIs) {
  refused("ct.nii -o film.mp4 --turntable 3 --size 64,64 --quiet",
          std::system("command -v ffmpeg > '/dev/null'") == 0 ? 0 : 1, {});
  const Outcome without = run_program(scratch_.path(), "/usr/bin/env",
                                      "PATH='/none' " TETWARP_PROGRAM " render ct.nii -o none.gif --turntable 3");
  EXPECT_EQ(without.status, 1);
  EXPECT_TRUE(says(without.err, {"ffmpeg", "not on PATH", "none.gif", ".png"}));
  EXPECT_FALSE(fs::exists(scratch_ / "none.gif"));
  if (!fs::exists(scratch_ / "film.mp4")) GTEST_SKIP() << "ffmpeg is not on PATH";
  EXPECT_GT(fs::file_size(scratch_ / "film.mp4"), 1000u);
  ASSERT_EQ(run("render ct.nii -o again.mp4 --turntable 3 --size 64,64 --quiet").status, 0);
  EXPECT_EQ(read_text(scratch_ / "film.mp4"), read_text(scratch_ / "again.mp4"));
}

TEST_F(RenderProgram, WhatDoesNotGoTogetherIsRefusedAndNothingIsWritten) {
  refused("ct.nii -o x.jpg", 2, {"x.jpg", ".png"});
  refused("ct.nii -o x.png --transfer bone", 2, {"bone", "ct-bone", ".json"});
  refused("ct.nii -o x.png --transfer none.json", 4, {"No such file or directory", "none.json"});
  refused("ct.nii -o x.png --overlay folds", 2, {"--overlay folds", "-f", "folds=FILE"});
  refused("ct.nii -o x.png --overlay shape=x", 2, {"shape", "coverage, folds, jacobian and lattice"});
  refused("ct.nii -o x.png --overlay jacobian=none.nii", 4, {"none.nii"});
  refused("ct.nii -o x.png -f twist:angle=3 --overlay folds --overlay jacobian", 2,
          {"one of coverage, folds and jacobian"});
  refused("ct.nii -o x.png --frames 3", 2, {"--frames", "-f"});
  refused("ct.nii -o x.png --frames 3 --turntable 4 -f twist:angle=3", 2, {"same number"});
  refused("ct.nii -o x.png --view axial --turntable 4", 2, {"--view volume"});
  refused("ct.nii -o x.png --view axial --transfer mip", 2, {"--view volume"});
  refused("ct.nii -o x.png --view axial --position 0/0/5000", 4, {"axial", "outside"});
  refused("ct.nii -o x.png --window 100", 2, {"--window", "ct-bone"});
  refused("ct.nii -o x.png --background red", 2, {"red", "#rrggbb"});
  refused("ct.nii -o x.png --zoom 0", 2, {"--zoom"});
  refused("ct.nii -o x.png --size 8,8", 2, {"--size"});
  refused("ct.nii -o x.png --size 20,20 --view montage", 4, {"too small", "--size"});
  refused("ct.nii -o x.png -f wive:amplitude=2", 2, {"wive"});
  refused("none.nii -o x.png", 4, {"none.nii"});
  refused("ct.nii -o none/x.png", 1, {"none"});
  ASSERT_EQ(run("deform ct.nii -f identity -o small.nii --quiet").status, 0);
  ASSERT_EQ(run("phantom -o other.nii --size 20,20,20 --quiet").status, 0);
  refused("ct.nii -o x.png --overlay jacobian=other.nii", 4, {"20 x 20 x 20", "64 x 64 x 40"});
  write_file(scratch_ / "there.png", "somebody's");
  refused("ct.nii -o there.png", 1, {"there.png exists", "--overwrite"});
  EXPECT_EQ(read_text(scratch_ / "there.png"), "somebody's");
  write_file(scratch_ / "turn.0002.png", "somebody's");
  refused("ct.nii -o turn.png --turntable 3", 1, {"turn.0002.png exists"});
  EXPECT_FALSE(fs::exists(scratch_ / "turn.0001.png"));
  EXPECT_FALSE(fs::exists(scratch_ / "x.png"));
}

TEST_F(RenderProgram, AFullDiskLeavesNothing) {
  const Outcome made =
      run_program(scratch_.path(), "/bin/sh",
                  "-c 'ulimit -f 8; exec \"" TETWARP_PROGRAM "\" render ct.nii -o x.png --size 512,512'");
  EXPECT_EQ(made.status, 1) << made.err;
  EXPECT_TRUE(says(made.err, {"x.png"}));
  for (const auto& entry : fs::directory_iterator(scratch_.path()))
    EXPECT_EQ(entry.path().filename().string().find("x.png"), std::string::npos);
}

TEST_F(RenderProgram, TheFiguresAreDrawnWithoutRealSeriesToo) {
  const Outcome made = run_program(
      scratch_.path(), "/usr/bin/env",
      "TETWARP='" TETWARP_PROGRAM
      "' SIZE=96,96 PHANTOM='--size 128,128,75 --spacing 3.2,3.2,4' TETWARP_TEST_DATA= " TETWARP_FIGURES " figures");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(says(made.out, {"left out: colon", "left out: upper-leg", "figures/figures.html"}));
  const std::string page = read_text(scratch_ / "figures/figures.html");
  std::set<std::string> pictures;
  for (const auto& entry : fs::directory_iterator(scratch_ / "figures")) {
    if (entry.path().extension() != ".png") continue;
    EXPECT_NE(page.find(entry.path().filename().string()), std::string::npos);
    EXPECT_TRUE(pictures.insert(read_text(entry.path())).second) << entry.path() << " is there twice";
  }
  EXPECT_EQ(pictures.size(), 12u);
}

TEST_F(RenderProgram, TiltedAndUnevenSeriesStandStraight) {
  for (const char* name : {"tilt-variable-spacing-ge", "tilt-uniform-philips"}) {
    TETWARP_REAL_DATA(folder, name);
    const Outcome made = run("render '" + folder.string() + "' --uneven exact -o " + name + ".png --size 128,128");
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_TRUE(says(made.err, {"lean or lie at uneven distances"}));
    const Picture seen = read_png(scratch_ / (std::string(name) + ".png"));
    int bright = 0;
    for (int y = 30; y < 98; ++y)
      for (int x = 30; x < 98; ++x) bright += seen.at(x, y)[0] > 100;
    EXPECT_GT(bright, 500) << name;
  }
}

}  // namespace
}  // namespace tetwarp
