// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Models of Abaqus and results of CalculiX. The files of the corpora are a bar that CalculiX 2.20 solved.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <sstream>

#include "deform/errors.h"
#include "io/mesh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::filesystem::path kCorpus = TETWARP_FUZZ_CORPUS;
const std::filesystem::path kResult = kCorpus / "mesh-frd" / "bar.frd", kModel = kCorpus / "mesh-inp" / "bar.inp";

/// What CalculiX prints of its nodes into bar.dat (*NODE PRINT).
constexpr const char* kTable =
    "node, ux, uy, uz\n# fixed end\n1,0,0,0\n2,0,0,0\n3;0;0;0\n4 0 0 0\n"
    "5,2.556289E-01,-2.049225E-01,-6.045817E-02\n6,2.892321E-01,4.129122E-03,-2.078596E-01\n"
    "7,2.043542E-02,3.706048E-02,-2.250873E-02\n8,3.279101E-02,-1.982533E-01,1.161773E-01\n"
    "9,4.817043E-01,-6.276537E-01,-3.698169E-01\n10,6.540848E-01,-1.361308E-01,-2.300761E-01\n"
    "11,7.063712E-02,-1.577796E-01,-3.959448E-02\n12,1.307861E-01,-6.038909E-01,2.411838E-01\n";

std::string refused(const std::filesystem::path& path, const std::string& options = "") {
  try {
    read_mesh_file(parse_field_source(path.string() + (options.empty() ? "" : ":" + options)));
  } catch (const InputError& error) {
    return error.what();
  }
  return "taken";
}

TEST(Calculix, ModelWithItsTableIsTheResult) {
  const Scratch scratch;
  write_file(scratch / "u.csv", kTable);
  const MeshFile result = read_mesh_file(kResult);
  const MeshFile model = read_mesh_file(parse_field_source(kModel.string() + ":table=" + (scratch / "u.csv").string()));
  EXPECT_EQ(result.header.format, "CalculiX result, text");
  EXPECT_EQ(result.header.displacement, "DISP");
  EXPECT_EQ(model.header.vertices, 12U);
  EXPECT_EQ(model.header.tetrahedra, 12U);
  EXPECT_EQ(model.mesh.tetrahedra, result.mesh.tetrahedra);
  ASSERT_EQ(model.mesh.displacement.size(), result.mesh.displacement.size());
  for (std::size_t v = 0; v < model.mesh.rest.size(); ++v) {
    EXPECT_EQ(model.mesh.rest[v], result.mesh.rest[v]);
    // A result has six digits, its table seven.
    EXPECT_LT(glm::distance(model.mesh.displacement[v], result.mesh.displacement[v]), 1e-6F) << v;
  }
  EXPECT_EQ(result.mesh.displacement[9], glm::vec3(6.54085e-01F, -1.36131e-01F, -2.30076e-01F));
}

TEST(Calculix, TablesThatDoNotFitAreRefused) {
  const Scratch scratch;
  const std::string path = (scratch / "u.csv").string();
  const auto with = [&](const std::string& table) {
    write_file(path, table);
    return refused(kModel, "table=" + path);
  };
  const std::string table = kTable;
  EXPECT_EQ(with(table), "taken");
  EXPECT_TRUE(says(with(table.substr(0, table.find("12,"))), {"not finite", "vertex 12"}));
  EXPECT_TRUE(says(with(table + "12,0,0,0\n"), {"vertex 12 a second time", "line 15", "u.csv"}));
  EXPECT_TRUE(says(with(table + "13,0,0,0\n"), {"node 13, which does not exist", "u.csv"}));
  EXPECT_TRUE(says(with("1,0,0\n"), {"4 values in line 1"}));
  EXPECT_TRUE(says(with("1,0,0,0,0\n"), {"4 values in line 1"}));
  EXPECT_TRUE(says(with("1,0,x,0\n"), {"\"x\" in line 1"}));
  EXPECT_EQ(with("\xEF\xBB\xBF" + table), "taken") << "a byte order mark";
  EXPECT_EQ(with("\xEF\xBB\xBF" + table.substr(table.find("1,0"))), "taken") << "and no heading";
  EXPECT_TRUE(says(with("1.0,0,0,0\n"), {"\"1.0\" in line 1", "whole number"})) << "no heading";
  EXPECT_TRUE(says(with("n1,0,0,0\n"), {"\"n1\" in line 1"}));
  EXPECT_TRUE(says(with("1,nan,0,0\n1,0,0,0\n"), {"vertex 1 a second time", "line 2"}));
  EXPECT_TRUE(says(refused(kModel), {"displacement", "table=FILE"}));
  EXPECT_TRUE(says(refused(kModel, "table=" + path + ",displacement=U"), {"give one of them"}));
  EXPECT_TRUE(says(refused(kModel, "table=absent.csv"), {"absent.csv"}));
}

TEST(Abaqus, ShapesOfAllKindsAndWhatIsLeftOut) {
  const Scratch scratch;
  const std::string nodes =
      "*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n6,0,1,1\n7,.5,.5,2\n8,1,1,0\n9,+1.,1E0,1\n 10 , 3,3,3\n";
  write_file(scratch / "a.inp", "** made by hand\n*HEADING\nanything, 1\n" + nodes +
                                    "*Element, Type=C3D6, elset=a\n1, 1,2,3, 4,5,6\n*ELEMENT,TYPE=C3D4H\n2,4,5,6,\n7\n"
                                    "*ELEMENT, TYPE=S3\n3, 1,2,3\n*ELEMENT, TYPE=B33\n4, 1,\n2\n*END\n");
  write_file(scratch / "u.csv", "1 0 0 0\n2 0 0 0\n3 0 0 0\n4 0 0 0\n5 0 0 0\n6 0 0 0\n7 0 0 1\n");
  const MeshFile file =
      read_mesh_file(parse_field_source((scratch / "a.inp").string() + ":table=" + (scratch / "u.csv").string()));
  EXPECT_EQ(file.header.cells[0], 1U);  // tetrahedra
  EXPECT_EQ(file.header.cells[2], 1U);  // wedges
  EXPECT_EQ(file.header.tetrahedra, 4U);
  std::string notes;
  for (const std::string& note : file.header.notes) notes += note + "\n";
  EXPECT_TRUE(says(notes, {"1 elements of the type S3 are left out", "1 elements of the type B33 are left out"}));
  for (const glm::u32vec4& t : file.mesh.tetrahedra) {
    const glm::dvec3 a = file.mesh.rest[t[0]];
    const double volume =
        glm::dot(file.mesh.rest[t[1]] - a, glm::cross(file.mesh.rest[t[2]] - a, file.mesh.rest[t[3]] - a));
    EXPECT_GT(volume, 0);
  }
}

TEST(Abaqus, WhatIsNotReadIsRefusedByName) {
  const Scratch scratch;
  const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n", cell = "*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n";
  const auto with = [&](const std::string& text) {
    write_file(scratch / "a.inp", text);
    return refused(scratch / "a.inp");
  };
  EXPECT_TRUE(says(with(nodes + cell), {"table=FILE"}));  // only the displacement is missing
  EXPECT_TRUE(says(with("*INCLUDE, INPUT=b.inp\n" + nodes + cell), {"*include in line 1", "a.inp"}));
  EXPECT_TRUE(says(with("*NODE, SYSTEM=C\n1,0,0,0\n"), {"system=c, a coordinate system of its own"}));
  EXPECT_TRUE(says(with("*PART\n" + nodes + "*PART\n"), {"second *PART in line 7"}));
  EXPECT_TRUE(says(with(nodes + cell + "*INSTANCE\n1.,0,0\n"), {"*INSTANCE that is moved"}));
  EXPECT_TRUE(says(with(nodes + "*ELEMENT,TYPE=C3D27\n1,1,2,3,4\n"), {"c3d27", "expected C3D4"}));
  EXPECT_TRUE(says(with(nodes + "*ELEMENT\n1,1,2,3,4\n"), {"without TYPE="}));
  EXPECT_TRUE(says(with(nodes + "*ELEMENT,TYPE=C3D4\n1,1,2,3\n"), {"C3D4 of 3 nodes", "is the file whole?"}));
  EXPECT_TRUE(says(with(nodes + "*ELEMENT,TYPE=C3D4\n1,1,2,3,5\n"), {"node 5, which does not exist", "element 1"}));
  EXPECT_TRUE(says(with(nodes + nodes + cell), {"node 1 is there twice"}));
  EXPECT_TRUE(says(with(nodes + cell + cell), {"element 1 is there twice"}));
  EXPECT_TRUE(says(with("*NODE\n1,0,0\n"), {"3 values of a node in line 2"}));
  EXPECT_TRUE(says(with(nodes), {"no cells with a volume"}));
}

/// Reference points of an assembly have numbers of their own, and a keyword line that ends with a comma goes on.
TEST(Abaqus, AssembliesAndLongKeywordLinesAreRead) {
  const Scratch scratch;
  write_file(
      scratch / "a.inp",
      "*PART, NAME=a\n*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,\nTYPE=C3D4\n1,1,2,3,4\n*END PART\n"
      "*ASSEMBLY, NAME=all\n*INSTANCE, NAME=a-1, PART=a\n*END INSTANCE\n*NODE\n1,9,9,9\n*ELEMENT,TYPE=MASS\n1,1\n"
      "*END ASSEMBLY\n*STEP\n");
  write_file(scratch / "u.csv", "1 0 0 0\n2 0 0 0\n3 0 0 0\n4 0 0 1\n");
  const MeshFile file =
      read_mesh_file(parse_field_source((scratch / "a.inp").string() + ":table=" + (scratch / "u.csv").string()));
  ASSERT_EQ(file.mesh.rest.size(), 4U);
  EXPECT_EQ(file.mesh.rest[0], glm::dvec3(0));
  EXPECT_EQ(file.header.tetrahedra, 1U);
}

/// Each step has a block of results, of which one is read.
TEST(Calculix, StepsAreChosenAndEachIsWhole) {
  const Scratch scratch;
  std::string text = read_bytes(kResult);
  const std::size_t begin = text.find("  100CL"), end = text.find(" -3\n", begin) + 4;
  std::string second = text.substr(begin, end - begin);
  second.replace(58, 5, "    7");
  const std::size_t value = second.find("2.55629E-01");
  second.replace(value, 11, "5.00000E-01");
  write_file(scratch / "a.frd", text.substr(0, end) + second + text.substr(end));
  const std::string path = (scratch / "a.frd").string();
  EXPECT_TRUE(says(refused(path), {"which vectors", "\"DISP, step 1\", \"DISP, step 7\""}));
  EXPECT_TRUE(says(refused(path, "step=3"), {"no step 3", "step 7"}));
  EXPECT_EQ(read_mesh_file(parse_field_source(path + ":step=1")).mesh.displacement[4].x, 2.55629e-01F);
  EXPECT_EQ(read_mesh_file(parse_field_source(path + ":step=7")).mesh.displacement[4].x, 0.5F);
  EXPECT_TRUE(says(refused(kResult, "deformed=" + path), {"rest where those of", "DISP"}));
  text.erase(text.find(" -1         3", begin), text.find(" -1         4", begin) - text.find(" -1         3", begin));
  write_file(scratch / "a.frd", text);
  EXPECT_TRUE(says(refused(path), {"11 values of DISP before line", "12 are expected"}));
}

TEST(Calculix, DamagedResultsAreRefused) {
  const Scratch scratch;
  const std::string text = read_bytes(kResult);
  const auto with = [&](const std::string& changed) {
    write_file(scratch / "a.frd", changed);
    return refused(scratch / "a.frd");
  };
  for (std::size_t size = 0; size + 6 < text.size(); size += 11)
    EXPECT_TRUE(says(with(text.substr(0, size)), {"a.frd"})) << size;
  const auto replaced = [&](const std::string& what, const std::string& by) {
    std::string changed = text;
    changed.replace(changed.find(what), what.size(), by);
    return changed;
  };
  EXPECT_TRUE(says(with(replaced("    1    0    1\n -2", "   99    0    1\n -2")), {"element of the type 99"}));
  EXPECT_TRUE(says(with(replaced(" -1         5 2.55629E-01", " -1        99 2.55629E-01")),
                   {"node 99, which does not exist"}));
  const std::size_t elements = text.find("    3C"), behind = text.find(" -3\n", elements) + 4;
  EXPECT_TRUE(
      says(with(text.substr(0, behind) + text.substr(elements)), {"second block of elements in line", "a.frd"}));
  EXPECT_TRUE(says(with(replaced("2.55629E-01", "2.5562xE-01")), {"expected a number"}));
  EXPECT_TRUE(says(with(replaced("DISP ", "FORC ")), {"taken"}));  // the only vectors, whatever their name
}

}  // namespace
}  // namespace tetwarp
