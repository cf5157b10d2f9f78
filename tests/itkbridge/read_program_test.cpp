// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/read_program.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include "deform/errors.h"
#include "itkbridge/transform_file.h"
#include "tests/itkbridge/itk_transforms.h"
#include "tests/support/image_samples.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

TEST(ReadProgram, IsLookedForBesideLibraryAndProgramAndInLibexec) {
  const std::vector<fs::path> expected = {"/opt/x/lib/tetwarp-read", "/opt/x/libexec/tetwarp/tetwarp-read",
                                          "/home/me/bin/tetwarp-read", "/home/me/libexec/tetwarp/tetwarp-read"};
  EXPECT_EQ(read_program_places("/opt/x/lib/libtetwarp_transform.so", "/home/me/bin/mine"), expected);
  EXPECT_EQ(read_program_places("/opt/x/bin/a", "/opt/x/bin/a").size(), 2U) << "no place twice";
}

/// Where the module is loaded from, in a tree of the test's own.
const std::string kModule = TETWARP_TEST_MODULE_FOLDER "/libtetwarp_transform.so";

void copy_to(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  fs::copy_file(from, to);
}

/// Lets the module at a place read a transform of HDF5. @return its class, or what the module throws
std::string read_by(const fs::path& module, const fs::path& file) {
  sheared_about().write(file);
  void* const loaded = ::dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!loaded) return ::dlerror();
  auto* const load = reinterpret_cast<decltype(&tetwarp_load_transform)>(::dlsym(loaded, "tetwarp_load_transform"));
  LoadedTransform transform;
  const std::string why = refusal([&] { load(file, {}, transform); });
  return why.empty() ? transform.stored.parts.at(0).type : why;
}

TEST(ReadProgram, IsFoundWhereverAnInstallationWasMovedTo) {
  for (const std::string folder : {TETWARP_TEST_MODULE_FOLDER, TETWARP_TEST_LIBEXECDIR "/tetwarp"}) {
    const Scratch scratch;
    copy_to(TETWARP_TEST_MODULE, scratch / kModule);
    copy_to(TETWARP_READ_BUILT, scratch / (folder + "/tetwarp-read"));
    EXPECT_EQ(read_by(scratch / kModule, scratch / "t.h5"), "AffineTransform_double_3_3") << folder;
  }
}

TEST(ReadProgram, IsFoundBehindALinkToTheModule) {
  const Scratch scratch;
  copy_to(TETWARP_TEST_MODULE, scratch / ("package/" + kModule));
  copy_to(TETWARP_READ_BUILT, scratch / "package/" TETWARP_TEST_LIBEXECDIR "/tetwarp/tetwarp-read");
  fs::create_symlink("package/" + kModule, scratch / "linked.so");
  EXPECT_EQ(read_by(scratch / "linked.so", scratch / "t.h5"), "AffineTransform_double_3_3");
}

TEST(ReadProgram, MissingIsAnErrorThatNamesItAndEveryPlace) {
  const Scratch scratch;
  copy_to(TETWARP_TEST_MODULE, scratch / kModule);
  const std::string why = read_by(scratch / kModule, scratch / "t.h5");
  const fs::path root = fs::canonical(scratch.path());
  EXPECT_TRUE(
      says(why, {"Error: the program tetwarp-read, which reads " + (scratch / "t.h5").string() + ", is not there",
                 (root / TETWARP_TEST_MODULE_FOLDER "/tetwarp-read").string() + ", ",
                 (root / TETWARP_TEST_LIBEXECDIR "/tetwarp/tetwarp-read").string(), "TETWARP_READ_PROGRAM"}));
  EXPECT_EQ(why.find("InputError"), std::string::npos) << "the file is not to blame: " << why;
  const Variable named("TETWARP_READ_PROGRAM", TETWARP_READ_BUILT);
  EXPECT_EQ(read_by(scratch / kModule, scratch / "t.h5"), "AffineTransform_double_3_3");
}

TEST(ReadProgram, DoesNothingByHand) {
  const Scratch scratch;
  for (const std::string arguments :
       {"", "transform-hdf5 t.h5", "other t.h5 1 1 1 1 3> out", "transform-hdf5 t.h5 1 1 1 1 3>&-"}) {
    const Outcome run = run_program(scratch.path(), TETWARP_READ_BUILT, arguments);
    EXPECT_EQ(run.status, 2) << arguments;
    EXPECT_TRUE(says(run.err, {"tetwarp-read", "by hand"}));
  }
}

}  // namespace
}  // namespace tetwarp
