// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What cannot be read: pipes, sockets and devices, which may never end, names that lead nowhere in ways of their own,
// and folders without rights. Each is refused at once, in one line that says why.
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cstring>

#include "tests/apps/batch/batch_case.h"
#include "tests/support/transforms.h"

namespace {

using namespace tetwarp::test;
namespace fs = std::filesystem;

class Unreadable : public BatchCase {
 protected:
  /// A run that may take ten seconds. @return it; status 137 where it took longer
  Outcome at_once(const std::string& arguments, const std::string& as = "") const {
    return run_program(scratch_.path(), "/bin/sh",
                       "-c \"timeout -s KILL 10 " + as + TETWARP_PROGRAM + " " + arguments + " < /dev/null\"");
  }
  void expect_refused(const std::string& arguments, const std::vector<std::string>& words, int status = 4,
                      const std::string& as = "") const {
    const Outcome made = at_once(arguments, as);
    EXPECT_EQ(made.status, status) << arguments << "\n" << made.err;
    EXPECT_TRUE(says(made.err, words)) << arguments;
    EXPECT_TRUE(made.err.starts_with("tetwarp: error: ")) << made.err;
    EXPECT_EQ(std::count(made.err.begin(), made.err.end(), '\n'), 1) << made.err;
    EXPECT_EQ(made.err.find("filesystem error"), std::string::npos) << made.err;
  }
  /// Every way to name a file with this stem; `with_suffix` makes one of a suffix.
  std::vector<std::string> ways(const std::string& stem) const {
    std::vector<std::string> ways;
    for (const char* suffix : {".nii", ".nii.gz", ".mha", ".nrrd", ".dcm", ""}) {
      ways.push_back("info " + stem + suffix);
      ways.push_back("deform " + stem + suffix + " -f identity -o o.nii");
      ways.push_back("deform ct.nrrd -f identity -o o.nii --grid " + stem + suffix);
      ways.push_back("deform ct.nrrd -f identity -o o.nii --with " + stem + suffix + "=w.nii");
    }
    for (const char* suffix : {".nii", ".mha", ".npy", ".vtk", ".vti", ".vtu", ".msh", ".h5", ".tfm", ".txt", ""}) {
      ways.push_back("deform ct.nrrd -o o.nii -f " + stem + suffix);
      ways.push_back("deform ct.nrrd -o o.nii --pull-field " + stem + suffix);
    }
    for (const char* suffix : {".csv", ".fcsv", ".mrk.json", ".stl", ".obj", ".vtk"})
      ways.push_back("deform ct.nrrd -f identity -o o.nii --points " + stem + suffix + "=o" + suffix);
    ways.push_back("deform ct.nrrd -o o.nii --scenario " + stem + ".json");
    ways.push_back("deform series -f identity -o o --deidentify basic --deidentify-key " + stem + ".key");
    ways.push_back("simulate " + stem + ".json ct.nrrd -o o.mha");
    ways.push_back("render ct.nrrd -o o.png --transfer " + stem + ".json");
    ways.push_back("render ct.nrrd -o o.png --sequence " + stem + ".mha");
    ways.push_back("render ct.nrrd -o o.png --overlay lattice=" + stem + ".mha");
    ways.push_back("render ct.nrrd -o o.png --overlay jacobian=" + stem + ".nii");
    ways.push_back("invert " + stem + ".mha --like ct.nrrd -o o.mha");
    ways.push_back("batch " + stem + ".csv -o out");
    ways.push_back("batch --init " + stem + ".d -o o.csv");
    return ways;
  }
  static constexpr const char* kSuffixes[] = {".nii", ".nii.gz", ".mha", ".nrrd",     ".dcm", ".npy", ".vtk",  ".vti",
                                              ".vtu", ".msh",    ".h5",  ".tfm",      ".txt", ".csv", ".fcsv", ".stl",
                                              ".obj", ".json",   ".key", ".mrk.json", ".d",   ""};
};

TEST_F(Unreadable, APipeIsRefusedAtOnceAsAnyInput) {
  for (const char* suffix : kSuffixes) ASSERT_EQ(::mkfifo((scratch_ / (std::string("p") + suffix)).c_str(), 0600), 0);
  for (const std::string& way : ways("p")) {
    expect_refused(way, {"neither a file nor a folder, p", "; "});
    if (HasFailure()) break;  // each that waits costs ten seconds
  }
}

TEST_F(Unreadable, ASocketAndADeviceAreRefusedToo) {
  const int file = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const fs::path path = fs::temp_directory_path() / ("tetwarp-socket-" + std::to_string(::getpid()));
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  for (const std::string& place : {path.string(), std::string("/dev/zero"), std::string("/dev/null")}) {
    expect_refused("info " + place, {"neither a file nor a folder"});
    expect_refused("deform ct.nrrd -o o.nii -f " + place, {"neither a file nor a folder"});
  }
  ::close(file);
  fs::remove(path);
}

TEST_F(Unreadable, APipeThatAFileNamesIsRefusedToo) {
  ASSERT_EQ(::mkfifo((scratch_ / "p.txt").c_str(), 0600), 0);
  write_file(scratch_ / "elastix.txt",
             "(Transform \"TranslationTransform\")\n(NumberOfParameters 3)\n(TransformParameters 1 0 0)\n"
             "(InitialTransformParametersFileName \"p.txt\")\n(HowToCombineTransforms \"Compose\")\n"
             "(FixedImageDimension 3)\n(MovingImageDimension 3)\n");
  const int refused = program_reads_transforms(scratch_.path()) ? 4 : 1;
  EXPECT_EQ(at_once("deform ct.nrrd -o o.nii --pull-field elastix.txt").status, refused);
  ASSERT_EQ(::mkfifo((scratch_ / "series/pipe").c_str(), 0600), 0);
  EXPECT_EQ(at_once("info series").status, 0) << "a folder is read without it";
}

TEST_F(Unreadable, ANameThatIsTooLongOrLeadsInACircleIsRefusedInTheSystemsWords) {
  const std::string stem(300, 'n');
  for (const std::string& way : ways(stem)) expect_refused(way, {"File name too long"});
  for (const char* suffix : kSuffixes)
    fs::create_symlink(std::string("l") + suffix, scratch_ / (std::string("l") + suffix));
  for (const std::string& way : ways("l")) expect_refused(way, {"Too many levels of symbolic links"});
}

TEST_F(Unreadable, AFileWithoutRightsIsRefusedInTheSystemsWords) {
  const auto as_other = as_another_user(65534);
  if (!as_other) GTEST_SKIP() << "no other user may run the program";
  fs::create_directory(scratch_ / "closed");
  for (const char* suffix : kSuffixes) {
    write_file(scratch_ / ("closed/p" + std::string(suffix)), "x");
    write_file(scratch_ / ("q" + std::string(suffix)), "x");
    fs::permissions(scratch_ / ("q" + std::string(suffix)), fs::perms::none);
  }
  fs::permissions(scratch_ / "closed", fs::perms::none);
  for (const std::string& way : ways("closed/p")) expect_refused(way, {"Permission denied", "closed/p"}, 4, *as_other);
  for (const std::string way :
       {"deform ct.nrrd -o o.nii -f q.mha", "deform ct.nrrd -o o.nii -f q.vtk", "deform ct.nrrd -o o.nii -f q.msh",
        "deform ct.nrrd -f identity -o o.nii --points q.csv=r.csv", "deform ct.nrrd -o o.nii --scenario q.json",
        "batch q.csv -o out", "deform series -f identity -o o --deidentify basic --deidentify-key q.key"})
    expect_refused(way, {"Permission denied"}, 4, *as_other);
  fs::permissions(scratch_ / "closed", fs::perms::all);
}

TEST_F(Unreadable, AnInputThatIsNotThereIsToldWhateverIsToBeWritten) {
  for (const char* output : {"o.nii", "o"}) {
    expect_refused("deform absent -f identity -o " + std::string(output), {"no such file or folder, absent"});
    EXPECT_FALSE(fs::exists(scratch_ / output));
  }
}

TEST_F(Unreadable, ANameThatIsNoTextIsShownByItsBytes) {
  const std::string name = "caf\xe9";
  expect_refused("info " + name + ".nii", {"caf\\xe9.nii"});
  fs::copy_file(scratch_ / "ct.nrrd", scratch_ / (name + ".nrrd"));
  EXPECT_EQ(at_once("deform " + name + ".nrrd -f identity -o " + name + ".mha").status, 0);
  EXPECT_TRUE(fs::exists(scratch_ / (name + ".mha.json")));
}

TEST_F(Unreadable, ALinkThatLeadsNowhereIsWrittenWhereItLeadsAndALoopIsRefusedBeforeTheWork) {
  fs::create_directory(scratch_ / "elsewhere");
  fs::create_symlink("elsewhere/there.nii", scratch_ / "link.nii");
  EXPECT_EQ(run("deform ct.nrrd -f identity -o link.nii --quiet").status, 0);
  EXPECT_TRUE(fs::is_regular_file(scratch_ / "elsewhere/there.nii"));
  EXPECT_TRUE(fs::is_symlink(scratch_ / "link.nii"));
  fs::create_symlink("missing/there.nii", scratch_ / "nowhere.nii");
  fs::create_symlink("loop.nii", scratch_ / "loop.nii");
  write_file(scratch_ / "broken.nrrd", "no volume");  // whoever reads first complains of it
  expect_refused("deform broken.nrrd -f identity -o nowhere.nii", {"missing", "does not exist"}, 1);
  expect_refused("deform broken.nrrd -f identity -o loop.nii", {"loop.nii", "Too many levels"}, 1);
}

}  // namespace
