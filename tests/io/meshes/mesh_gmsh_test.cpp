// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Gmsh's MSH: files that Gmsh wrote, and files made number by number, whole and damaged.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "deform/errors.h"
#include "io/mesh_file.h"
#include "tests/support/gmsh_file.h"
#include "tests/support/random.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::test;

/// What reading the file is refused with; "taken": it is not.
std::string refusal(const FieldSource& source) {
  try {
    read_mesh_file(source);
  } catch (const InputError& error) {
    return error.what();
  }
  return "taken";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

double volume(const TetrahedralMesh& mesh, const glm::u32vec4& t) {
  const glm::dvec3 a = mesh.rest[t[0]];
  return glm::dot(glm::cross(mesh.rest[t[1]] - a, mesh.rest[t[2]] - a), mesh.rest[t[3]] - a) / 6;
}

/// All rest but the vertex there, which moves so.
void expect_one_moved(const TetrahedralMesh& mesh, const glm::dvec3& at, const glm::vec3& by) {
  ASSERT_EQ(mesh.displacement.size(), mesh.rest.size());
  int moved = 0;
  for (std::size_t v = 0; v < mesh.rest.size(); ++v) {
    const bool there = glm::length(mesh.rest[v] - at) < 1e-9;
    EXPECT_EQ(mesh.displacement[v], there ? by : glm::vec3(0)) << v;
    if (there) ++moved;
  }
  EXPECT_EQ(moved, 1);
}

TEST(MeshGmsh, EveryStyleGivesTheSameMesh) {
  const Scratch scratch;
  for (const GmshStyle& style : gmsh_styles()) {
    SCOPED_TRACE(style.name());
    write_file(scratch / "a.msh", GmshSample().write(style));
    EXPECT_TRUE(is_mesh_file(scratch / "a.msh"));
    const MeshFile file = read_mesh_file(scratch / "a.msh");
    const std::vector<glm::dvec3> rest = {
        {0, 0, 0}, {0, 6, 0}, {0, 0, 5}, {8, 0, 0}, {8, 6, 5}};  // tags 3 7 11 20 1000
    EXPECT_EQ(file.mesh.rest, rest);
    EXPECT_EQ(file.mesh.tetrahedra, (std::vector<glm::u32vec4>{{0, 3, 1, 2}, {3, 1, 2, 4}}));
    expect_one_moved(file.mesh, {8, 0, 0}, {3, 5, 7});
    EXPECT_TRUE(
        file.header.format.starts_with("Gmsh MSH " + std::string(style.version == "2.2" ? "2" : style.version)));
    EXPECT_EQ(file.header.displacement, "U");
    EXPECT_DOUBLE_EQ(file.header.largest_mm.value(), std::sqrt(83.0));
    EXPECT_EQ(file.header.vertices, 5U);
    EXPECT_EQ(file.header.tetrahedra, 2U);
    EXPECT_EQ(file.header.cells[0], 2U);
    EXPECT_EQ(file.header.notes, (std::vector<std::string>{"1 points, lines and surface elements are left out",
                                                           "1 vertices are corners of no cell and are left out"}));
  }
}

TEST(MeshGmsh, AFileTruncatedAtAnyLengthIsRefusedByName) {
  const Scratch scratch;
  for (const GmshStyle& style : gmsh_styles()) {
    SCOPED_TRACE(style.name());
    const std::string whole = GmshSample().write(style);
    write_file(scratch / "a.msh", whole);
    for (std::size_t length = whole.size() - 1; length-- > 0;) {
      std::filesystem::resize_file(scratch / "a.msh", length);
      ASSERT_TRUE(says(refusal(scratch / "a.msh"), {"a.msh"})) << length;
    }
  }
}

TEST(MeshGmsh, AFileWithAWrongByteIsRefusedOrGivesAWholeMesh) {
  const Scratch scratch;
  const std::uint64_t seed = test_seed(), cases = test_cases(60);
  SCOPED_TRACE(seed_text(seed));
  for (const GmshStyle& style : gmsh_styles()) {
    const std::string whole = GmshSample().write(style);
    for (std::uint64_t n = 0; n < cases; ++n) {
      Random random(seed, n);
      std::string damaged = whole;
      for (std::int64_t times = random.integer(1, 3); times > 0; --times) {
        const char byte = random.chance(0.5) ? random.one_of({'\xFF', '\x7F', '\0', '9', '-', ' ', '\n', '$'})
                                             : static_cast<char>(random.integer(0, 255));
        damaged[static_cast<std::size_t>(random.integer(0, static_cast<std::int64_t>(whole.size()) - 1))] = byte;
      }
      write_file(scratch / "a.msh", damaged);
      try {
        const TetrahedralMesh mesh = read_mesh_file(scratch / "a.msh").mesh;
        ASSERT_EQ(mesh.rest.size(), mesh.displacement.size());
        for (const glm::u32vec4& t : mesh.tetrahedra)
          for (int v = 0; v < 4; ++v) ASSERT_LT(t[v], mesh.rest.size());
        for (std::size_t v = 0; v < mesh.rest.size(); ++v)
          for (int axis = 0; axis < 3; ++axis)
            ASSERT_TRUE(std::isfinite(mesh.rest[v][axis]) && std::isfinite(mesh.displacement[v][axis]));
      } catch (const InputError& error) {
        ASSERT_TRUE(says(error.what(), {"a.msh"})) << style.name();
      }
    }
  }
}

TEST(MeshGmsh, WhatIsWrongIsNamed) {
  const Scratch scratch;
  const std::string text = GmshSample().write({"4.1"}), old = GmshSample().write({"2.2"});
  const auto refused = [&](const std::string& bytes) {
    write_file(scratch / "a.msh", bytes);
    return refusal(scratch / "a.msh");
  };
  EXPECT_EQ(refused(text), "taken");
  EXPECT_TRUE(says(refused(replaced(text, "$MeshFormat", "(0 \"Fluent\")")), {"$MeshFormat is expected", "MSH 4.1"}));
  EXPECT_TRUE(says(refused("$NOD\n1\n1 0 0 0\n$ENDNOD\n"), {"MSH 1", "save the mesh with Gmsh as MSH 4.1"}));
  EXPECT_TRUE(says(refused(replaced(text, "4.1 0 8", "5 0 8")), {"version 5 of MSH", "4.1, 4.0 or 2"}));
  EXPECT_TRUE(says(refused(replaced(text, "8 0 0 ", "nan 0 0 ")), {"a position that is not finite", "vertex 20"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 5 7 ", "3 inf 7 ")),
                   {"a displacement that is missing or not finite", "vertex 20"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 5 7 ", "3 1e60 7 ")),
                   {"a displacement that is missing or not finite", "vertex 20"}));
  EXPECT_TRUE(
      says(refused(replaced(text, "2 6 3 1000", "2 99999999999999999 3 1000")), {"99999999999999999 items", "$Nodes"}));
  EXPECT_TRUE(says(refused(replaced(text, "2 6 3 1000", "2 7 3 1000")), {"6 of 7 nodes"}));
  EXPECT_TRUE(
      says(refused(replaced(text, "2 3 1 11", "2 18446744073709551615 1 11")), {"3 of 18446744073709551615 elements"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 1 4 2 ", "3 1 4 18446744073709551615 ")), {"more elements than 3"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 20 7 11 ", "3 20 7 12 ")), {"the node 12 is not in $Nodes", "$Elements"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 20 7 11 ", "3 20 7 7 ")), {"no solid is left", "tetrahedron 10"}));
  EXPECT_TRUE(says(refused(replaced(text, "11 20 7 11 1000", "10 20 7 11 1000")), {"the element 10 is there twice"}));
  EXPECT_TRUE(says(refused(replaced(text, "20 \n3 \n", "20 \n20 \n")), {"the node 20 is there twice"}));
  EXPECT_TRUE(says(refused(replaced(text, "3 1 4 2 ", "3 1 77 2 ")), {"elements of the type 77"}));
  EXPECT_TRUE(
      says(refused(replaced(text, "20 3 5 7 ", "20 3 5 x7 ")), {"\"x7\" where a number is expected", "$NodeData"}));
  EXPECT_TRUE(says(refused(replaced(text, "20 3 5 7 ", "21 3 5 7 ")), {"the node 21 is not in $Nodes", "$NodeData"}));
  EXPECT_TRUE(says(refused(replaced(text, "20 3 5 7 ", "3 3 5 7 ")), {"the node 3 is there twice", "$NodeData"}));
  EXPECT_TRUE(says(refused(replaced(replaced(text, "\n6\n", "\n5\n"), "20 3 5 7 ", "")), {"not finite", "vertex 20"}));
  EXPECT_TRUE(says(refused(replaced(text, "$EndNodes", "1 2 3\n$EndNodes")), {"more than its header says in $Nodes"}));
  EXPECT_TRUE(says(refused(text + "$Nodes\n0 0 0 0\n$EndNodes\n"), {"two sections $Nodes"}));
  EXPECT_TRUE(says(refused(replaced(replaced(old, "$Nodes", "$ParametricNodes"), "$EndNodes", "$EndParametricNodes")),
                   {"no section $Nodes", "Mesh.SaveParametric = 0"}));
  EXPECT_TRUE(says(refused(replaced(old, "10 4 2 1 1 ", "10 4 99999 1 1 ")), {"$Elements"}));
  EXPECT_TRUE(says(refused(replaced(replaced(old, "10 4 2 1 1 3 20 7 11", "10 2 2 1 1 3 20 7"),
                                    "11 4 2 1 1 20 7 11 1000", "11 2 2 1 1 20 7 11")),
                   {"no cells with a volume", "3 points, lines and surface elements are left out"}));
}

TEST(MeshGmsh, WindowsLinesOtherSuffixesAndOtherSectionsAreTaken) {
  const Scratch scratch;
  std::string text = GmshSample().write({"4.1"});
  text = replaced(text, "$Nodes", "$Comments\nby hand\n$EndComments\n$Nodes") +
         "$ElementData\n1\n\"stress\"\n0\n3\n0\n3\n1\n10 1 2 3\n$EndElementData\n";
  std::string lines;
  for (const char c : text) lines += c == '\n' ? "\r\n" : std::string(1, c);
  write_file(scratch / "a.dat", lines);
  ASSERT_TRUE(is_mesh_file(scratch / "a.dat"));
  const MeshFile file = read_mesh_file(FieldSource(scratch / "a.dat"));
  expect_one_moved(file.mesh, {8, 0, 0}, {3, 5, 7});
  EXPECT_EQ(file.header.arrays, std::vector<std::string>{"U"});
  ASSERT_EQ(file.header.notes.size(), 3U);
  EXPECT_TRUE(says(file.header.notes[1], {"1 sections of data at the elements are left out"}));
}

TEST(MeshGmsh, AnElementOfTwoPhysicalGroupsCountsOnce) {
  const Scratch scratch;
  const std::string text = GmshSample().write({"2.2"});
  write_file(scratch / "a.msh", replaced(replaced(text, "$Elements\n3\n", "$Elements\n4\n"), "10 4 2 1 1 3 20 7 11",
                                         "12 4 2 2 1 3 20 7 11\n10 4 2 1 1 3 20 7 11"));
  const MeshFile file = read_mesh_file(scratch / "a.msh");
  EXPECT_EQ(file.mesh.tetrahedra, (std::vector<glm::u32vec4>{{0, 3, 1, 2}, {3, 1, 2, 4}}));
  ASSERT_FALSE(file.header.notes.empty());
  EXPECT_TRUE(says(file.header.notes[1], {"1 tetrahedra are there twice"}));
}

/// @return  false: Python or Gmsh is missing
bool gmsh_writes(const std::string& kind, int binary, const std::string& version, const std::filesystem::path& path) {
  const std::string command = "'" TETWARP_PYTHON "' '" TETWARP_MAKE_MESH "' " + kind + " " + std::to_string(binary) +
                              " " + version + " '" + path.string() + "' > /dev/null";
  const int status = std::system(command.c_str());
  if (WIFEXITED(status) && (WEXITSTATUS(status) == 77 || WEXITSTATUS(status) == 127)) return false;
  EXPECT_EQ(status, 0) << command;
  return true;
}

struct GmshCase {
  const char *kind, *version;
  int binary;
};

class MeshOfGmsh : public testing::TestWithParam<GmshCase> {};

TEST_P(MeshOfGmsh, HasTheVolumeAndTheMovedVertex) {
  const auto& [kind, version, binary] = GetParam();
  const Scratch scratch;
  if (!gmsh_writes(kind, binary, version, scratch / "a.msh")) GTEST_SKIP() << "needs python3-gmsh";
  const MeshFile file = read_mesh_file(scratch / "a.msh");
  expect_one_moved(file.mesh, {10, 0, 30}, {3, 5, 7});
  double sum = 0;
  for (const glm::u32vec4& t : file.mesh.tetrahedra) {
    EXPECT_GT(volume(file.mesh, t), 0);
    sum += volume(file.mesh, t);
  }
  EXPECT_NEAR(sum, 6000, 1e-6);
  const auto cells = [&](CellShape shape) { return file.header.cells[static_cast<std::size_t>(shape)] > 0; };
  const std::string name = kind;
  EXPECT_EQ(cells(CellShape::tetrahedron), name == "tetrahedra" || name == "quadratic");
  EXPECT_EQ(cells(CellShape::hexahedron), name == "hexahedra" || name == "mixed");
  EXPECT_EQ(cells(CellShape::wedge), name == "wedges" || name == "mixed");
  EXPECT_EQ(cells(CellShape::pyramid), name == "mixed");
  std::string notes;
  for (const std::string& note : file.header.notes) notes += note + "\n";
  EXPECT_EQ(notes.find("quadratic cells are made linear") != std::string::npos, name == "quadratic") << notes;
  EXPECT_EQ(notes.find("corners of no cell") != std::string::npos, name == "quadratic") << notes;

  FieldSource ras(scratch / "a.msh");
  ras.options = {{"frame", "ras"}, {"units", "m"}};
  const MeshFile turned = read_mesh_file(ras);
  expect_one_moved(turned.mesh, {-10'000, 0, 30'000}, {-3000, -5000, 7000});
  EXPECT_EQ(turned.mesh.tetrahedra, file.mesh.tetrahedra);

  ASSERT_TRUE(gmsh_writes(name + ":deformed", binary, version, scratch / "b.msh"));
  FieldSource both(scratch / "a.msh");
  both.options = {{"deformed", (scratch / "b.msh").string()}};
  expect_one_moved(read_mesh_file(both).mesh, {10, 0, 30}, {3, 5, 7});
}

INSTANTIATE_TEST_SUITE_P(Styles, MeshOfGmsh,
                         testing::Values(GmshCase{"tetrahedra", "4.1", 0}, GmshCase{"tetrahedra", "4.1", 1},
                                         GmshCase{"tetrahedra", "4.0", 0}, GmshCase{"tetrahedra", "2.2", 0},
                                         GmshCase{"tetrahedra", "2.2", 1}, GmshCase{"quadratic", "4.1", 1},
                                         GmshCase{"quadratic", "2.2", 0}, GmshCase{"wedges", "4.1", 0},
                                         GmshCase{"wedges", "2.2", 1}, GmshCase{"hexahedra", "4.1", 1},
                                         GmshCase{"mixed", "4.1", 0}, GmshCase{"mixed", "2.2", 1}),
                         [](const auto& each) {
                           std::string name = std::string(each.param.kind) + "_" + each.param.version;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name + (each.param.binary ? "_binary" : "_text");
                         });

}  // namespace
