// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What is the same for every mesh format: options, and how vertices and cells become a TetrahedralMesh.
#include "io/mesh_file.h"

#include <gtest/gtest.h>

#include "deform/errors.h"
#include "tests/support/gmsh_file.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

/// $NodeData of three components, (x, 0, 0) at every node of a GmshSample.
std::string vectors(const std::string& name, int step, double x) {
  std::string text = "$NodeData\n1\n\"" + name + "\"\n0\n3\n" + std::to_string(step) + "\n3\n6\n";
  for (const std::uint64_t tag : GmshSample().tags) text += std::to_string(tag) + " " + std::to_string(x) + " 0 0\n";
  return text + "$EndNodeData\n";
}

/// A sample without vectors, then others behind it.
std::string mesh_with(const std::string& data) {
  const std::string text = GmshSample().write({"4.1"});
  return text.substr(0, text.find("$NodeData")) + data;
}

MeshFile read(const Scratch& scratch, const std::string& options = "") {
  return read_mesh_file(parse_field_source((scratch / "a.msh").string() + (options.empty() ? "" : ":" + options)));
}

std::string refusal(const Scratch& scratch, const std::string& options = "") {
  try {
    read(scratch, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "taken";
}

/// The first component at all vertices.
float x_of(const MeshFile& file) {
  for (const glm::vec3& d : file.mesh.displacement) EXPECT_EQ(d, file.mesh.displacement[0]);
  return file.mesh.displacement.at(0).x;
}

TEST(MeshFile, TheDisplacementIsTheOnlyOrTheUsualOneOrRefusedWithAList) {
  const Scratch scratch;
  write_file(scratch / "a.msh", mesh_with(vectors("whatever", 4, 2)));
  EXPECT_EQ(x_of(read(scratch)), 2);
  EXPECT_EQ(x_of(read(scratch, "step=4")), 2);
  EXPECT_TRUE(says(refusal(scratch, "step=3"), {"no step 3 of \"whatever\"", "a.msh", "it has \"whatever, step 4\""}));
  EXPECT_TRUE(says(refusal(scratch, "displacement=U"), {"no vectors called \"U\"", "it has \"whatever\""}));

  write_file(scratch / "a.msh", mesh_with(vectors("velocity", 0, 1) + vectors("u", 0, 2)));
  EXPECT_EQ(x_of(read(scratch)), 2);
  EXPECT_EQ(x_of(read(scratch, "displacement=velocity")), 1);

  write_file(scratch / "a.msh", mesh_with(vectors("U", 0, 1) + vectors("displacement", 0, 2)));
  EXPECT_TRUE(
      says(refusal(scratch), {"which vectors are the displacement?", "\"U\", \"displacement\"", "displacement=NAME"}));
  EXPECT_EQ(x_of(read(scratch, "displacement=U")), 1);

  write_file(scratch / "a.msh", mesh_with(vectors("a", 0, 1) + vectors("b", 0, 2)));
  EXPECT_TRUE(says(refusal(scratch), {"\"a\", \"b\""}));

  write_file(scratch / "a.msh", mesh_with(vectors("U", 1, 1) + vectors("U", 2, 2)));
  EXPECT_TRUE(says(refusal(scratch), {"\"U, step 1\", \"U, step 2\"", "step=N"}));
  EXPECT_EQ(x_of(read(scratch, "step=2")), 2);
  EXPECT_EQ(read(scratch, "step=2").header.displacement, "U, step 2");

  write_file(scratch / "a.msh", mesh_with(""));
  EXPECT_TRUE(says(refusal(scratch), {"it has no vectors at its vertices", "deformed=FILE"}));
  const MeshFileHeader header = read_mesh_header(scratch / "a.msh");
  EXPECT_EQ(header.displacement, "");
  EXPECT_FALSE(header.largest_mm);
  EXPECT_EQ(header.tetrahedra, 2U);
}

TEST(MeshFile, FrameAndUnitsAreAssumedUnlessGiven) {
  const Scratch scratch;
  write_file(scratch / "a.msh", GmshSample().write({"4.1"}));
  const MeshFile lps = read(scratch), ras = read(scratch, "frame=ras"), metres = read(scratch, "units=m,frame=lps");
  EXPECT_EQ(lps.header.frame + lps.header.units, "LPSmm");
  EXPECT_EQ(lps.header.frame_basis, FieldBasis::assumed);
  EXPECT_EQ(lps.header.units_basis, FieldBasis::assumed);
  EXPECT_EQ(ras.header.frame, "RAS");
  EXPECT_EQ(ras.header.frame_basis, FieldBasis::by_option);
  EXPECT_EQ(metres.header.units, "m");
  EXPECT_EQ(metres.header.units_basis, FieldBasis::by_option);
  EXPECT_EQ(metres.header.frame_basis, FieldBasis::by_option);
  for (std::size_t v = 0; v < lps.mesh.rest.size(); ++v) {
    EXPECT_EQ(ras.mesh.rest[v], lps.mesh.rest[v] * glm::dvec3(-1, -1, 1));
    EXPECT_EQ(ras.mesh.displacement[v], lps.mesh.displacement[v] * glm::vec3(-1, -1, 1));
    EXPECT_EQ(metres.mesh.rest[v], lps.mesh.rest[v] * 1000.0);
    EXPECT_EQ(metres.mesh.displacement[v], lps.mesh.displacement[v] * 1000.0f);
  }
  EXPECT_EQ(ras.mesh.displacement[3], glm::vec3(-3, -5, 7));
}

TEST(MeshFile, UnknownOptionsAreRefused) {
  const Scratch scratch;
  write_file(scratch / "a.msh", GmshSample().write({"4.1"}));
  EXPECT_TRUE(says(refusal(scratch, "order=zyx"), {"\"order\"", "a.msh", "a mesh takes displacement, step, deformed"}));
  EXPECT_TRUE(says(refusal(scratch, "frame=LPS"), {"frame=LPS", "expected frame=lps or frame=ras"}));
  EXPECT_TRUE(says(refusal(scratch, "units=cm"), {"units=cm", "expected units=mm or units=m"}));
  EXPECT_TRUE(says(refusal(scratch, "step=one"), {"step=one", "whole number"}));
  EXPECT_TRUE(says(refusal(scratch, "deformed=b.msh,displacement=U"), {"give one of them"}));
}

TEST(MeshFile, ADeformedFileGivesTheDifferenceRoundedOnce) {
  const Scratch scratch;
  GmshSample rest, deformed;
  for (glm::dvec3& point : rest.points) point += glm::dvec3(1e6);
  deformed.points = rest.points;
  deformed.points[0] += glm::dvec3(0.1, 0, 0);  // lost where positions are floats
  write_file(scratch / "a.msh", rest.write({"4.1"}));
  write_file(scratch / "b.msh", deformed.write({"2.2", true, true}));
  const std::string option = "deformed=" + (scratch / "b.msh").string();
  const MeshFile file = read(scratch, option);
  EXPECT_EQ(file.header.displacement, "positions of " + (scratch / "b.msh").string());
  EXPECT_EQ(file.mesh.displacement[3], glm::vec3(static_cast<float>(deformed.points[0].x - rest.points[0].x), 0, 0));
  EXPECT_NEAR(file.mesh.displacement[3].x, 0.1, 1e-8);
  EXPECT_EQ(read(scratch, option + ",frame=ras").mesh.displacement[3].x, -file.mesh.displacement[3].x);

  GmshSample other = deformed;
  other.tetrahedra[0] = {20, 3, 7, 11};
  write_file(scratch / "b.msh", other.write({"4.1"}));
  EXPECT_TRUE(
      says(refusal(scratch, option), {"other cells", "a.msh", "b.msh", "the vertices and cells of the mesh at rest"}));
  other = deformed;
  other.tags[5] = 6;
  std::string text = other.write({"4.1"});
  text.replace(text.find("3 7 5 "), 6, "3 7 6 ");
  write_file(scratch / "b.msh", text);
  EXPECT_TRUE(says(refusal(scratch, option), {"the vertex 5 is in one file only", "b.msh"}));
  other = deformed;
  other.tags.push_back(2000);
  other.points.emplace_back(0);
  other.displacement.emplace_back(0);
  write_file(scratch / "b.msh", other.write({"4.1"}));
  EXPECT_TRUE(says(refusal(scratch, option), {"7 and 6 vertices", "b.msh"}));
  std::filesystem::remove(scratch / "b.msh");
  EXPECT_TRUE(says(refusal(scratch, option), {"no such file", "b.msh"}));
}

TEST(MeshFile, OtherFilesAreNoMeshes) {
  const Scratch scratch;
  write_file(scratch / "a.txt", "no mesh");
  EXPECT_FALSE(is_mesh_file(scratch / "a.txt"));
  EXPECT_FALSE(is_mesh_file(scratch / "none.txt"));
  std::filesystem::create_directory(scratch / "series.msh");
  EXPECT_FALSE(is_mesh_file(scratch / "series.msh"));
  try {
    read_mesh_file(scratch / "a.txt");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"not a mesh file", "a.txt", ".msh"}));
  }
}

}  // namespace
