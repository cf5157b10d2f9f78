// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Films of `render`: what goes to ffmpeg, and what is left when either of the two ends early.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "tests/support/png_picture.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using test::read_png;

/// `render` of a small phantom, with an ffmpeg that is a script, and an empty folder `tmp` for temporary files.
class MovieProgram : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(scratch_ / "tmp");
    fs::create_directories(scratch_ / "bin");
    fs::create_directories(scratch_ / "out");
    ASSERT_EQ(run_tetwarp(scratch_.path(), "phantom --size 64,64,40 --spacing 6,6,8 --quiet -o ct.nii").status, 0);
  }
  /// In the script `$film` is the file to be written, and what it leaves is in the folder where tetwarp runs.
  void fake_ffmpeg(const std::string& script) const {
    write_file(scratch_ / "bin/ffmpeg", "#!/bin/sh\nfor film; do :; done\nfilm=${film#file:}\n" + script);
    fs::permissions(scratch_ / "bin/ffmpeg", fs::perms::owner_all);
  }
  /// @param more  after the command: "& ..."
  Outcome render(const std::string& arguments, const std::string& more = "") const {
    write_file(scratch_ / "script", "PATH=\"$PWD/bin:$PATH\" TMPDIR=\"$PWD/tmp\" '" TETWARP_PROGRAM
                                    "' render ct.nii --plain --quiet " +
                                        arguments + more + "\n");
    return run_program(scratch_.path(), "/bin/sh", "script");
  }
  /// Lines of a shell behind tetwarp's end: they wait until the process named in `begun` is gone, for five seconds at
  /// most, and end with tetwarp's status. They print "gone" or "alive".
  static constexpr const char* kUntilGone =
      "ended=$?\n"
      "for n in $(seq 50); do\n"
      "  [ -e /proc/$(cat begun) ] || break\n"
      "  grep -q '^State:.Z' /proc/$(cat begun)/status && break\n"
      "  sleep 0.1\n"
      "done\n"
      "[ $n = 50 ] && echo alive || echo gone\n"
      "exit $ended";
  /// Sends tetwarp a signal once there is a file `begun`, and waits for the process that it names.
  Outcome render_until_begun(const std::string& arguments, const std::string& signal) const {
    return render(arguments,
                  " &\nwhile [ ! -s begun ]; do sleep 0.05; done\nkill -" + signal + " $!\nwait $!\n" + kUntilGone);
  }
  std::vector<std::string> left_in(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(scratch_ / folder))
      names.push_back(entry.path().filename().string());
    return names;
  }

  Scratch scratch_;
};

using Names = std::vector<std::string>;

TEST_F(MovieProgram, PicturesGoThroughThePipeAndAreInNoOtherFile) {
  fake_ffmpeg(
      "echo \"$@\" > arguments\ncat > frames\nls -A \"$TMPDIR\" > temporary\nls -A out > staged\n"
      "echo film > \"$film\"");
  ASSERT_EQ(render("-o out/film.mp4 --turntable 3 --size 65,48 --rate 12").status, 0);
  ASSERT_EQ(render("-o out/film.png --turntable 3 --size 65,48").status, 0);
  const std::string frames = read_text(scratch_ / "frames");
  ASSERT_EQ(frames.size(), 3U * 3 * 65 * 48);
  for (int n = 0; n < 3; ++n) {
    const Picture picture = read_png(scratch_ / ("out/film.000" + std::to_string(n + 1) + ".png"));
    EXPECT_EQ(frames.compare(static_cast<std::size_t>(n) * 3 * 65 * 48, 3 * 65 * 48,
                             reinterpret_cast<const char*>(picture.data()), 3 * 65 * 48),
              0)
        << n;
  }
  EXPECT_TRUE(says(read_text(scratch_ / "arguments"), {"rawvideo", "rgb24", "65x48", "-framerate 12 ", "pipe:0"}));
  EXPECT_EQ(read_text(scratch_ / "temporary"), "");
  EXPECT_TRUE(says(read_text(scratch_ / "staged"), {".tetwarp-partial-"}));
  EXPECT_EQ(read_text(scratch_ / "out/film.mp4"), "film\n");
}

TEST_F(MovieProgram, TheEncoderHasNoSignalNorFileOfTheProgram) {
  // By the shell alone, and first: dash lets signals through again once it waits for a program.
  fake_ffmpeg(
      "while read -r name mask; do\n"
      "  case $name in SigBlk: | SigIgn:) echo $name $mask ;; esac\n"
      "done < /proc/$$/status > signals\n"
      "cat > frames\nls /proc/$$/fd > descriptors\necho film > \"$film\"");
  ASSERT_EQ(render("-o out/film.gif --turntable 2 --size 64,48", " 9< ct.nii").status, 0);
  // 32 and 33 are the C library's own, which it ignores in every program that it starts.
  const std::string signals = read_text(scratch_ / "signals"), none = "0000000000000000\n";
  EXPECT_TRUE(signals == "SigBlk: " + none + "SigIgn: " + none ||
              signals == "SigBlk: " + none + "SigIgn: 0000000180000000\n")
      << signals;
  const std::string open = read_text(scratch_ / "descriptors");
  EXPECT_EQ(open.find('9'), std::string::npos) << open;
}

TEST_F(MovieProgram, AnInterruptEndsTheEncoderAtOnceAndLeavesNothing) {
  for (const std::string& script :
       {std::string("echo part > \"$film\"\necho $$ > begun\nexec sleep 120"),        // takes no picture
        std::string("cat > \"$film\"\necho $$ > begun\nexec sleep 120"),              // has them all
        std::string("trap '' TERM INT HUP\necho $$ > begun\nexec sleep 120"),         // lets nobody ask it to end
        std::string("sleep 120 &\necho $! > begun\necho part > \"$film\"\nwait")}) {  // is a script itself
    for (const std::string signal : {"INT", "TERM"}) {
      fs::remove(scratch_ / "begun");
      fake_ffmpeg(script);
      const auto begin = std::chrono::steady_clock::now();
      const Outcome run = render_until_begun("-o out/film.mp4 --turntable 60 --size 96,96", signal);
      EXPECT_EQ(run.status, 130) << script << ": " << run.err;
      EXPECT_EQ(run.out, "gone\n") << script;
      EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
      EXPECT_EQ(left_in("out"), Names());
      EXPECT_EQ(left_in("tmp"), Names());
    }
  }
}

TEST_F(MovieProgram, APictureThatCannotBeMadeEndsTheEncoderToo) {
  fake_ffmpeg("echo $$ > begun\ncat > \"$film\"\nexec sleep 30");
  for (const char* field : {"a.mha", "b.mha"}) {
    const std::string arguments =
        "field translate:by=2/0/0 --like ct.nii --cell-size 4 --quiet -o " + std::string(field);
    ASSERT_EQ(run_tetwarp(scratch_.path(), arguments).status, 0);
  }
  fs::resize_file(scratch_ / "b.mha", fs::file_size(scratch_ / "b.mha") - 1);
  // Pictures that a pipe does not hold: the encoder has begun by then.
  const Outcome run = render("-o out/film.mp4 --size 256,256 --outside background --sequence a.mha a.mha b.mha",
                             std::string("\n") + kUntilGone);
  EXPECT_EQ(run.status, 4) << run.err;
  EXPECT_TRUE(says(run.err, {"b.mha"}));
  EXPECT_EQ(run.out, "gone\n");
  EXPECT_EQ(left_in("out"), Names());
}

TEST_F(MovieProgram, AKilledProgramLeavesNothingThatLooksFinished) {
  fake_ffmpeg("echo $$ > begun\ncat > \"$film\"");
  const Outcome run = render_until_begun("-o out/film.mp4 --turntable 3000 --size 96,96", "KILL");
  EXPECT_EQ(run.status, 137) << run.err;
  EXPECT_EQ(run.out, "gone\n") << "the encoder waits for pictures that never come";
  for (const std::string& name : left_in("out")) EXPECT_TRUE(name.starts_with(".tetwarp-partial-")) << name;
  EXPECT_EQ(left_in("tmp"), Names());
}

TEST_F(MovieProgram, AnEncoderThatFailsIsAnErrorWithItsWords) {
  const std::vector<std::pair<std::string, std::string>> all = {
      {"echo first >&2\necho 'Unknown encoder libx264' >&2\nexit 1", "Unknown encoder libx264"},
      {"cat > frames\necho \"$film: No space left on device\" >&2\nexit 1", "out/film.mp4: No space left on device"},
      {"cat > frames\nexit 1", "it says nothing"},
      {"exit 0", "ends before it has all pictures"},
      {"cat > frames", "it wrote no film"},
      {"kill -SEGV $$", "Segmentation fault"}};
  for (const auto& [script, words] : all) {
    fake_ffmpeg(script);
    const Outcome run = render("-o out/film.mp4 --turntable 40 --size 128,128");
    EXPECT_EQ(run.status, 1) << script << ": " << run.err;
    EXPECT_TRUE(says(run.err, {"ffmpeg failed", "out/film.mp4", words, "nothing was written"})) << script;
    EXPECT_EQ(run.err.find("partial"), std::string::npos) << run.err;
    EXPECT_EQ(left_in("out"), Names()) << script;
  }
  fake_ffmpeg("");
  write_file(scratch_ / "bin/ffmpeg", "no program");
  const Outcome run = render("-o out/film.mp4 --turntable 2 --size 64,64");
  EXPECT_EQ(run.status, 1);
  EXPECT_TRUE(says(run.err, {"bin/ffmpeg cannot be started"}));
}

/// The system takes the status of a child from a process that began with SIGCHLD ignored.
TEST_F(MovieProgram, ACallerThatIgnoresItsChildrenGetsAFilmToo) {
  fake_ffmpeg("cat > frames\necho film > \"$film\"");
  write_file(scratch_ / "script", "PATH=\"$PWD/bin:$PATH\" exec env --ignore-signal=CHLD '" TETWARP_PROGRAM
                                  "' render ct.nii -o out/film.mp4 --turntable 2 --size 64,64 --quiet\n");
  const Outcome run = run_program(scratch_.path(), "/bin/sh", "script");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(read_text(scratch_ / "out/film.mp4"), "film\n");
}

TEST_F(MovieProgram, NamesThatLookLikeProtocolsArePaths) {
  fake_ffmpeg("cat > frames\necho film > \"$film\"");
  fs::create_directories(scratch_ / "http:");
  EXPECT_EQ(render("-o http:/film.mp4 --turntable 2 --size 64,64").status, 0);
  EXPECT_EQ(read_text(scratch_ / "http:/film.mp4"), "film\n");
}

/// Tests with ffmpeg itself, where it is installed.
class RealMovie : public MovieProgram {
 protected:
  void SetUp() override {
    if (std::system("command -v ffmpeg > '/dev/null' && command -v ffprobe > '/dev/null'") != 0)
      GTEST_SKIP() << "ffmpeg is not on PATH";
    MovieProgram::SetUp();
  }
  /// The Nth picture of a film, from 1, as ffmpeg decodes it.
  Picture decoded(const std::string& film, int number) const {
    const Outcome run = run_program(scratch_.path(), "/usr/bin/env",
                                    "ffmpeg -y -loglevel error -i " + film + " -pix_fmt rgb24 decoded.%d.png");
    EXPECT_EQ(run.status, 0) << run.err;
    return read_png(scratch_ / ("decoded." + std::to_string(number) + ".png"));
  }
};

TEST_F(RealMovie, HoldsThePicturesInTheirOrder) {
  ASSERT_EQ(render("-o out/t.png --turntable 4 --size 96,96").status, 0);
  for (const std::string film : {"out/t.mp4", "out/t.gif"}) {
    ASSERT_EQ(render("-o " + film + " --turntable 4 --size 96,96 --rate 10").status, 0);
    const Outcome probe = run_program(
        scratch_.path(), "/usr/bin/env",
        "ffprobe -v error -count_frames -of csv -show_entries stream=width,height,r_frame_rate,nb_read_frames " + film);
    EXPECT_EQ(probe.out, "stream,96,96,10/1,4\n") << film;
    for (int n = 1; n <= 4; ++n) {
      const Picture seen = decoded(film, n), drawn = read_png(scratch_ / ("out/t.000" + std::to_string(n) + ".png"));
      double off = 0;
      for (int y = 0; y < 96; ++y) {
        for (int x = 0; x < 96; ++x) {
          for (int c = 0; c < 3; ++c)
            off += std::abs(static_cast<int>(seen.at(x, y)[c]) - static_cast<int>(drawn.at(x, y)[c]));
        }
      }
      EXPECT_LT(off / (3 * 96 * 96), 3.0) << film << " " << n;
    }
  }
}

TEST_F(RealMovie, AnInterruptLeavesNothingAndAKillNothingThatLooksFinished) {
  // A stage lasts long enough to be interrupted: many pictures.
  for (const std::string signal : {"INT", "KILL"}) {
    fs::remove(scratch_ / "begun");
    fake_ffmpeg("echo $$ > begun\nPATH=${PATH#*:}\nexec ffmpeg \"$@\"");
    const Outcome run = render_until_begun("-o out/film.mp4 --turntable 3000 --size 256,256", signal);
    EXPECT_EQ(run.status, signal == "INT" ? 130 : 137) << run.err;
    EXPECT_EQ(run.out, "gone\n");
    for (const std::string& name : left_in("out"))
      EXPECT_TRUE(signal == "KILL" && name.starts_with(".tetwarp-partial-")) << name;
    EXPECT_EQ(left_in("tmp"), Names());
  }
}

}  // namespace
}  // namespace tetwarp
