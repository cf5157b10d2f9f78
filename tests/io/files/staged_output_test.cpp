// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/staged_output.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <climits>
#include <exception>
#include <fstream>
#include <memory>
#include <sstream>
#include <thread>
#include <vector>

#include "deform/errors.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace fs = std::filesystem;
using tetwarp::Error;
using tetwarp::StagedOutput;
using Kind = tetwarp::StagedOutput::Kind;

namespace {

std::string content(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

bool is_ours(const fs::path& path) { return content(path).starts_with("ours"); }

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// The text of the error, which must be thrown.
template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return {};
}

std::string refusal(const fs::path& target, Kind kind, bool overwrite = false) {
  return error_of([&] { StagedOutput(target, kind, overwrite, is_ours); });
}

void make_folder(const fs::path& folder, const std::string& name, const std::string& text) {
  fs::create_directories(folder);
  write_file(folder / name, text);
}

std::string numbered(int n) { return "IM000" + std::to_string(10 + n) + ".dcm"; }

TEST(StagedFile, AppearsOnlyWhenCommitted) {
  const Scratch scratch;
  StagedOutput output(scratch / "out.nii.gz", Kind::file, false);
  write_file(output.path(), "new");
  EXPECT_FALSE(fs::exists(scratch / "out.nii.gz"));
  output.commit();
  EXPECT_EQ(content(scratch / "out.nii.gz"), "new");
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFile, IsWrittenUnderAHiddenNameOfTheSameSuffix) {
  const Scratch scratch;
  const StagedOutput output(scratch / "out.nii.gz", Kind::file, false);
  const std::string name = output.path().filename().string();
  EXPECT_EQ(output.path().parent_path(), scratch.path());
  EXPECT_TRUE(name.starts_with(".tetwarp-partial-" + std::to_string(::getpid()))) << name;
  EXPECT_TRUE(name.ends_with("out.nii.gz")) << name;
}

TEST(StagedFile, LeavesNothingWhenNotCommitted) {
  const Scratch scratch;
  {
    const StagedOutput output(scratch / "out.nii", Kind::file, false);
    write_file(output.path(), "half");
    EXPECT_EQ(entries(scratch.path()), 1U);
  }
  EXPECT_EQ(entries(scratch.path()), 0U);
}

TEST(StagedFile, RefusesAnExistingTargetWithoutOverwrite) {
  const Scratch scratch;
  write_file(scratch / "out.nii.gz", "old");
  EXPECT_EQ(refusal(scratch / "out.nii.gz", Kind::file),
            (scratch / "out.nii.gz").string() + " exists; choose another name or add --overwrite");
  EXPECT_EQ(content(scratch / "out.nii.gz"), "old");
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFile, ReplacesAnExistingTargetWithOverwriteOnlyAtCommit) {
  const Scratch scratch;
  write_file(scratch / "out.nii", "old");
  StagedOutput output(scratch / "out.nii", Kind::file, true);
  write_file(output.path(), "new");
  EXPECT_EQ(content(scratch / "out.nii"), "old");
  output.commit();
  EXPECT_EQ(content(scratch / "out.nii"), "new");
}

TEST(StagedFile, DoesNotReplaceATargetThatAppearedMeanwhile) {
  const Scratch scratch;
  StagedOutput output(scratch / "out.nii", Kind::file, false);
  write_file(output.path(), "new");
  write_file(scratch / "out.nii", "of someone else");
  EXPECT_THROW(output.commit(), Error);
  EXPECT_EQ(content(scratch / "out.nii"), "of someone else");
}

TEST(StagedFile, RefusesAFolderAndADevice) {
  const Scratch scratch;
  fs::create_directory(scratch / "out.nii");
  EXPECT_NE(refusal(scratch / "out.nii", Kind::file, true).find("is a folder"), std::string::npos);
  EXPECT_NE(refusal("/dev/null", Kind::file, true).find("is no regular file"), std::string::npos);
}

TEST(StagedFile, APipeBehindALinkIsNamedAsTheLinkIs) {
  const Scratch scratch;
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  fs::create_symlink("/proc/self/fd/" + std::to_string(ends[1]), scratch / "out.nii");
  const std::string why = refusal(scratch / "out.nii", Kind::file, true);
  ::close(ends[0]);
  ::close(ends[1]);
  EXPECT_NE(why.find((scratch / "out.nii").string() + " is no regular file"), std::string::npos) << why;
}

TEST(StagedFile, ANameOfAsManyLettersAsAFileSystemAllowsIsGood) {
  const Scratch scratch;
  const std::string name = std::string(NAME_MAX - 4, 'x') + ".nii";
  StagedOutput output(scratch / name, Kind::file, false);
  EXPECT_EQ(output.path().extension(), ".nii");
  write_file(output.path(), "new");
  output.commit();
  EXPECT_EQ(content(scratch / name), "new");
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFile, WritesThroughASymbolicLink) {
  const Scratch scratch;
  fs::create_directory(scratch / "disk");
  write_file(scratch / "disk" / "real.nii", "old");
  fs::create_symlink(scratch / "disk" / "real.nii", scratch / "out.nii");
  EXPECT_THROW(StagedOutput(scratch / "out.nii", Kind::file, false), Error);
  StagedOutput output(scratch / "out.nii", Kind::file, true);
  write_file(output.path(), "new");
  output.commit();
  EXPECT_TRUE(fs::is_symlink(scratch / "out.nii"));
  EXPECT_EQ(content(scratch / "disk" / "real.nii"), "new");
}

TEST(StagedFile, FollowsLinksBeforeDotsInItsName) {
  const Scratch scratch;
  fs::create_directories(scratch / "far/deep");
  fs::create_directory(scratch / "near");
  fs::create_directory_symlink(scratch / "far/deep", scratch / "near/link");
  write_file(scratch / "near/out.nii", "another's");
  StagedOutput output(scratch / "near/link/../out.nii", Kind::file, true);
  write_file(output.path(), "new");
  output.commit();
  EXPECT_EQ(content(scratch / "near/out.nii"), "another's");
  EXPECT_EQ(content(scratch / "far/out.nii"), "new");
}

TEST(StagedFile, RefusesALinkThatGoesInCircles) {
  const Scratch scratch;
  fs::create_symlink(scratch / "b.nii", scratch / "a.nii");
  fs::create_symlink(scratch / "a.nii", scratch / "b.nii");
  EXPECT_NE(refusal(scratch / "a.nii", Kind::file, true).find("cannot follow the link"), std::string::npos);
}

TEST(StagedFile, TwoOfTheSameNameDoNotShareTheirWork) {
  const Scratch scratch;
  const StagedOutput first(scratch / "out.nii", Kind::file, false), second(scratch / "out.nii", Kind::file, false);
  EXPECT_NE(first.path(), second.path());
}

TEST(StagedOutputPlace, MustHaveAParentFolder) {
  const Scratch scratch;
  write_file(scratch / "file", "x");
  EXPECT_NE(refusal(scratch / "missing" / "out.nii", Kind::file).find("does not exist"), std::string::npos);
  EXPECT_NE(refusal(scratch / "file" / "out", Kind::folder).find("is not a folder"), std::string::npos);
}

TEST(StagedOutputPlace, MustHaveAName) {
  EXPECT_NE(refusal("", Kind::folder).find("names no file or folder"), std::string::npos);
  EXPECT_NE(refusal("..", Kind::folder).find("names no file or folder"), std::string::npos);
  EXPECT_NE(refusal("missing/..", Kind::folder).find("names no file or folder"), std::string::npos);
  EXPECT_NE(refusal("./", Kind::folder).find("names no file or folder"), std::string::npos);
  EXPECT_NE(refusal("/", Kind::folder).find("names no file or folder"), std::string::npos);
}

TEST(StagedOutputPlace, MustBeWritableAndIsKnownBeforeTheWork) {
  const Scratch scratch;
  fs::create_directory(scratch / "locked");
  fs::permissions(scratch / "locked", fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_exec);
  const auto as_a_user = [&] {  // root may write everywhere
    if (::geteuid() == 0 && ::setuid(65534) != 0) std::_Exit(2);
    const std::string message = refusal(scratch / "locked" / "out.nii", Kind::file);
    std::_Exit(message.find("Permission denied") == std::string::npos ? 1 : 0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(as_a_user(), testing::ExitedWithCode(0), "");
  fs::permissions(scratch / "locked", fs::perms::owner_all);
}

TEST(StagedFolder, AppearsOnlyWhenCommitted) {
  const Scratch scratch;
  StagedOutput output((scratch / "series").string() + "/", Kind::folder, false);
  EXPECT_EQ(output.target(), scratch / "series");
  write_file(output.path() / "IM00001.dcm", "ours");
  EXPECT_FALSE(fs::exists(scratch / "series"));
  output.commit();
  EXPECT_EQ(content(scratch / "series" / "IM00001.dcm"), "ours");
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFolder, LeavesNothingWhenNotCommitted) {
  const Scratch scratch;
  {
    const StagedOutput output(scratch / "series", Kind::folder, false);
    write_file(output.path() / "IM00001.dcm", "half");
  }
  EXPECT_EQ(entries(scratch.path()), 0U);
}

TEST(StagedFolder, CountsAnEmptyFolderAsAbsent) {
  const Scratch scratch;
  fs::create_directory(scratch / "series");
  StagedOutput output(scratch / "series", Kind::folder, false);
  write_file(output.path() / "a", "ours");
  output.commit();
  EXPECT_EQ(content(scratch / "series" / "a"), "ours");
  EXPECT_NE(refusal(scratch / "series", Kind::folder).find("exists"), std::string::npos);
}

TEST(StagedFolder, RefusesAFile) {
  const Scratch scratch;
  write_file(scratch / "series", "ours");
  EXPECT_NE(refusal(scratch / "series", Kind::folder, true).find("is a file"), std::string::npos);
}

TEST(StagedFolder, ReplacesAFolderOfOursWhole) {
  const Scratch scratch;
  make_folder(scratch / "series", "IM00009.dcm", "ours, old");
  StagedOutput output(scratch / "series", Kind::folder, true, is_ours);
  write_file(output.path() / "IM00001.dcm", "ours, new");
  EXPECT_TRUE(fs::exists(scratch / "series" / "IM00009.dcm"));
  output.commit();
  EXPECT_EQ(entries(scratch / "series"), 1U);
  EXPECT_EQ(content(scratch / "series" / "IM00001.dcm"), "ours, new");
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFolder, OneThatSeveralReplaceAtOnceIsTheWholeOfOneOfThem) {
  const Scratch scratch;
  make_folder(scratch / "series", numbered(0), "ours, old");
  const auto replace = [&](const std::string& writer) {
    for (int turn = 0; turn < 50; ++turn) {
      StagedOutput output(scratch / "series", Kind::folder, true, [](const fs::path&) { return true; });
      for (int n = 0; n < 20; ++n) write_file(output.path() / numbered(n), "ours, of " + writer);
      output.give_name();
    }
  };
  std::exception_ptr failures[2];
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 2; ++n) {
      threads.emplace_back([&, n] {
        try {
          replace(std::to_string(n));
        } catch (...) {
          failures[n] = std::current_exception();
        }
      });
    }
  }
  for (const std::exception_ptr& failure : failures) EXPECT_NO_THROW(if (failure) std::rethrow_exception(failure));
  EXPECT_EQ(entries(scratch.path()), 1U) << "something is left behind";
  ASSERT_EQ(entries(scratch / "series"), 20U);
  for (int n = 1; n < 20; ++n)
    EXPECT_EQ(content(scratch / "series" / numbered(n)), content(scratch / "series" / numbered(0)));
}

TEST(StagedFolder, RefusesToReplaceWhatIsNotOurs) {
  const Scratch scratch;
  make_folder(scratch / "series", "IM00009.dcm", "ours");
  write_file(scratch / "series" / "notes.txt", "mine");
  EXPECT_NE(refusal(scratch / "series", Kind::folder, true).find("notes.txt was not written by Tetwarp"),
            std::string::npos);
  fs::remove(scratch / "series" / "notes.txt");
  make_folder(scratch / "series" / "deeper", "scan.dcm", "mine");
  EXPECT_NE(refusal(scratch / "series", Kind::folder, true).find("scan.dcm was not written by Tetwarp"),
            std::string::npos);
  fs::remove_all(scratch / "series" / "deeper");
  fs::create_symlink(scratch / "series" / "IM00009.dcm", scratch / "series" / "link.dcm");
  EXPECT_NE(refusal(scratch / "series", Kind::folder, true).find("link.dcm was not written by Tetwarp"),
            std::string::npos);
  EXPECT_EQ(entries(scratch.path()), 1U);
}

TEST(StagedFolder, LooksAgainBeforeItReplaces) {
  const Scratch scratch;
  make_folder(scratch / "series", "IM00009.dcm", "ours");
  StagedOutput output(scratch / "series", Kind::folder, true, is_ours);
  write_file(scratch / "series" / "notes.txt", "mine");
  EXPECT_THROW(output.commit(), Error);
  EXPECT_EQ(content(scratch / "series" / "notes.txt"), "mine");
}

TEST(StagedFolder, DoesNotReplaceOneThatWasFilledMeanwhile) {
  const Scratch scratch;
  StagedOutput output(scratch / "series", Kind::folder, false);
  make_folder(scratch / "series", "notes.txt", "mine");
  EXPECT_THROW(output.commit(), Error);
  EXPECT_EQ(content(scratch / "series" / "notes.txt"), "mine");
}

TEST(StagedFolder, OfManyForeignFilesTheFirstIsNamed) {
  const Scratch scratch;
  for (int n = 0; n < 60; ++n) make_folder(scratch / "series", numbered(n), n % 20 == 7 ? "mine" : "ours");
  for (int attempt = 0; attempt < 5; ++attempt) {
    EXPECT_NE(refusal(scratch / "series", Kind::folder, true).find(numbered(7) + " was not written"),
              std::string::npos);
  }
}

TEST(StagedFolder, OneFileOfManyThatCannotBeFlushedStopsAll) {
  const Scratch scratch;
  {
    StagedOutput output(scratch / "series", Kind::folder, false);
    for (int n = 0; n < 60; ++n) write_file(output.path() / numbered(n), "ours");
    fs::create_directory(output.path() / "deeper");
    fs::create_symlink("nowhere", output.path() / "deeper" / "lost.dcm");
    EXPECT_NE(error_of([&] { output.commit(); }).find("cannot write " + (scratch / "series").string() + " to disk"),
              std::string::npos);
    fs::remove(output.path() / "deeper" / "lost.dcm");
    output.commit();
  }
  EXPECT_EQ(entries(scratch / "series"), 61U);
}

TEST(StagedOutputs, OfSeveralAllGetTheirNamesOrNoneThatWasFree) {
  const Scratch scratch;
  write_file(scratch / "old", "old");
  std::vector<std::unique_ptr<StagedOutput>> outputs;
  for (const char* name : {"old", "a", "b", "c"}) {
    outputs.push_back(std::make_unique<StagedOutput>(scratch / name, Kind::file, std::string(name) == "old"));
    write_file(outputs.back()->path(), "new");
  }
  write_file(scratch / "c", "somebody else's");
  EXPECT_NE(error_of([&] { tetwarp::commit_together(outputs); }).find("c exists"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch / "a"));
  EXPECT_FALSE(fs::exists(scratch / "b"));
  EXPECT_EQ(content(scratch / "c"), "somebody else's");
  outputs.clear();
  EXPECT_EQ(entries(scratch.path()), 2U) << "no hidden file";
}

TEST(StagedOutputs, NoneIsReplacedBeforeAllAreOnTheDisk) {
  const Scratch scratch;
  write_file(scratch / "old", "old");
  std::vector<std::unique_ptr<StagedOutput>> outputs;
  for (const char* name : {"old", "new"}) {
    outputs.push_back(std::make_unique<StagedOutput>(scratch / name, Kind::file, true));
    write_file(outputs.back()->path(), "new");
  }
  fs::remove(outputs.back()->path());  // what is gone cannot be flushed
  EXPECT_NE(error_of([&] { tetwarp::commit_together(outputs); }).find("cannot write"), std::string::npos);
  EXPECT_EQ(content(scratch / "old"), "old");
  EXPECT_FALSE(fs::exists(scratch / "new"));
}

TEST(StagedOutputs, WhatWasReplacedIsNotTakenAway) {
  const Scratch scratch;
  write_file(scratch / "old", "old");
  std::vector<std::unique_ptr<StagedOutput>> outputs;
  for (const char* name : {"old", "new"}) {
    outputs.push_back(std::make_unique<StagedOutput>(scratch / name, Kind::file, std::string(name) == "old"));
    write_file(outputs.back()->path(), "made");
  }
  write_file(scratch / "new", "somebody else's");
  EXPECT_NE(error_of([&] { tetwarp::commit_together(outputs); }).find("new exists"), std::string::npos);
  EXPECT_EQ(content(scratch / "old"), "made");
  EXPECT_EQ(content(scratch / "new"), "somebody else's");
}

TEST(StagedOutput, FollowsLinksThatLeadNowhereYetAndNoCircle) {
  const Scratch scratch;
  fs::create_directory(scratch / "deep");
  fs::create_symlink("deep/second", scratch / "first");
  fs::create_symlink(scratch / "deep/third", scratch / "deep/second");
  {
    StagedOutput output(scratch / "first", Kind::file, false);
    write_file(output.path(), "new");
    output.commit();
  }
  EXPECT_EQ(content(scratch / "deep/third"), "new");
  EXPECT_TRUE(fs::is_symlink(scratch / "first") && fs::is_symlink(scratch / "deep/second"));
  fs::create_symlink("circle", scratch / "circle");
  EXPECT_NE(refusal(scratch / "circle", Kind::file, true).find("Too many levels"), std::string::npos);
}

}  // namespace
