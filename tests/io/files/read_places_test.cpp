// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/read_places.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

namespace fs = std::filesystem;
using tetwarp::ReadPlaces;
using tetwarp::real_path;

/// data/in.nii, and data/out, which is a link to far/deep.
struct Tree {
  Scratch scratch;

  Tree() {
    fs::create_directories(scratch / "data/series");
    fs::create_directories(scratch / "far/deep");
    fs::create_directory_symlink(scratch / "far/deep", scratch / "data/out");
    write_file(scratch / "data/in.nii", "in");
  }
  fs::path operator/(const std::string& name) const { return scratch / name; }
};

TEST(RealPath, FollowsLinksBeforeDots) {
  const Tree tree;
  const fs::path root = fs::canonical(tree.scratch.path());
  EXPECT_EQ(real_path(tree / "data/out/../in.nii"), root / "far/in.nii");
  EXPECT_EQ(real_path(tree / "data/out/../deep/new/er"), root / "far/deep/new/er");
  EXPECT_EQ(real_path(tree / "data/series/../in.nii"), root / "data/in.nii");
  EXPECT_EQ(real_path(tree / "data/series/"), root / "data/series");
}

TEST(RealPath, NamesWhatALinkThatLeadsNowhereWillName) {
  const Tree tree;
  const fs::path root = fs::canonical(tree.scratch.path());
  fs::create_symlink("out/later.nii", tree / "data/dangling");
  EXPECT_EQ(real_path(tree / "data/dangling"), root / "far/deep/later.nii");
  fs::create_symlink("circle/again", tree / "circle");
  EXPECT_NE(real_path(tree / "circle").string().find(root.string()), std::string::npos) << "and ends";
}

TEST(ReadPlaces, KnowEverySpellingOfAFile) {
  const Tree tree;
  fs::create_hard_link(tree / "data/in.nii", tree / "hard.nii");
  fs::create_symlink(tree / "data/in.nii", tree / "soft.nii");
  fs::create_directory_symlink(tree / "data", tree / "also");
  ReadPlaces places;
  places.add(tree / "data/in.nii");
  for (const char* same : {"data/in.nii", "data/./in.nii", "data/series/../in.nii", "hard.nii", "soft.nii",
                           "also/in.nii", "far/deep/../../data/in.nii"})
    EXPECT_EQ(places.touched_by(tree / same), tree / "data/in.nii") << same;
  for (const char* other : {"data/out/../in.nii", "data/in.nii.json", "data/other.nii", "far/in.nii", "data/series"})
    EXPECT_EQ(places.touched_by(tree / other), std::nullopt) << other;
}

TEST(ReadPlaces, CountWhatIsInsideAndAround) {
  const Tree tree;
  ReadPlaces places;
  places.add(tree / "data/out");
  for (const char* inside : {"data/out", "far/deep", "far/deep/new.nii", "data/out/new/er.nii"})
    EXPECT_TRUE(places.touched_by(tree / inside)) << inside;
  for (const char* around : {"far", "data"}) EXPECT_TRUE(places.touched_by(tree / around)) << around;
  for (const char* clear : {"far/new.nii", "data/series", "data/in.nii"})
    EXPECT_FALSE(places.touched_by(tree / clear)) << clear;
}

TEST(ReadPlaces, KnowByItsNameWhatIsNotThere) {
  const Tree tree;
  ReadPlaces places;
  places.add(tree / "data/later.nii");
  EXPECT_TRUE(places.touched_by(tree / "data/series/../later.nii"));
  EXPECT_TRUE(places.touched_by(tree / "data"));
  EXPECT_FALSE(places.touched_by(tree / "far/later.nii"));
  places.add(tree / "absent/deep/later.nii");
  EXPECT_TRUE(places.touched_by(tree / "absent")) << "nothing of it is there";
  EXPECT_FALSE(places.touched_by(tree / "absent/deep/later.nii.json"));
}

TEST(ReadPlaces, CountTheFoldersAroundALinkAndAroundWhatItLeadsTo) {
  const Tree tree;
  write_file(tree / "far/deep/volume.nii", "volume");
  fs::create_symlink(tree / "far/deep/volume.nii", tree / "data/series/link.nii");
  ReadPlaces places;
  places.add(tree / "data/series/link.nii");
  for (const char* around : {"data/series", "data", "far/deep", "far"})
    EXPECT_EQ(places.touched_by(tree / around), tree / "data/series/link.nii") << around;
  EXPECT_FALSE(places.touched_by(tree / "data/in.nii"));
}

TEST(ReadPlaces, TellFoldersOfOneNameApart) {
  const Tree tree;
  ReadPlaces places;
  for (const char* folder : {"one/deep", "two/deep"}) {
    fs::create_directories(tree / folder);
    write_file(tree / folder / "in.nii", "in");
    places.add(tree / folder / "in.nii");
  }
  EXPECT_EQ(places.touched_by(tree / "one"), tree / "one/deep/in.nii");
  EXPECT_EQ(places.touched_by(tree / "two"), tree / "two/deep/in.nii");
}

}  // namespace
