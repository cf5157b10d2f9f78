// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Meshes that Tetwarp writes, read again by its own readers (of .vtu: by VTK).
#include "io/mesh_writer.h"

#include <gtest/gtest.h>

#include "deform/errors.h"
#include "io/mesh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/random.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

TetrahedralMesh sample() {
  test::Random random(7);
  TetrahedralMesh mesh;
  for (int n = 0; n < 60; ++n) {
    const auto number = [&] { return random.real(-200, 200); };
    mesh.rest.emplace_back(number(), number(), number() / 3);
    mesh.displacement.emplace_back(number(), number(), number());
  }
  for (std::uint32_t n = 0; n + 3 < 60; ++n) mesh.tetrahedra.emplace_back(n + 3, n, n + 2, n + 1);
  return mesh;
}

void expect_read_again(const char* name) {
  const Scratch scratch;
  const TetrahedralMesh mesh = sample();
  write_mesh_file(scratch / name, mesh);
  const MeshFile read = read_mesh_file(parse_field_source((scratch / name).string()));
  EXPECT_EQ(read.mesh.rest, mesh.rest);
  EXPECT_EQ(read.mesh.displacement, mesh.displacement);
  EXPECT_EQ(read.mesh.tetrahedra, mesh.tetrahedra);
  EXPECT_EQ(read.header.frame, "LPS");
}

TEST(MeshWriter, ALegacyFileReadsBackBitForBit) { expect_read_again("f.vtk"); }

TEST(MeshWriter, AnXmlFileReadsBackBitForBit) {
#ifdef TETWARP_WITH_VTK
  expect_read_again("f.vtu");
#else
  GTEST_SKIP() << "VTK is not in this build";
#endif
}

TEST(MeshWriter, OtherNamesAndMeshesThatDoNotFitAreRefused) {
  const Scratch scratch;
  TetrahedralMesh mesh = sample();
  EXPECT_TRUE(says(refusal([&] { write_mesh_file(scratch / "f.msh", mesh); }), {".vtu or .vtk", "f.msh"}));
  mesh.tetrahedra[3].y = 60;
  EXPECT_TRUE(says(refusal([&] { write_mesh_file(scratch / "f.vtk", mesh); }), {"vertex beyond its 60"}));
  mesh = sample();
  mesh.displacement.pop_back();
  EXPECT_TRUE(says(refusal([&] { write_mesh_file(scratch / "f.vtk", mesh); }), {"60 vertices", "59 displacements"}));
}

TEST(MeshWriter, AFullDiskIsTold) {
  const Scratch scratch;
  std::filesystem::create_symlink("/dev/full", scratch / "f.vtk");
  try {
    write_mesh_file(scratch / "f.vtk", sample());
    FAIL();
  } catch (const InputError&) {
    FAIL();
  } catch (const Error& error) {
    EXPECT_TRUE(says(error.what(), {"cannot write", "f.vtk", "No space left"}));
  }
}

}  // namespace
}  // namespace tetwarp
