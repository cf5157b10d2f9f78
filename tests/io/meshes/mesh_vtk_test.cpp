// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Meshes that VTK writes: one cell of each kind, 10 mm apart along x; the last vertex of the first moves.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "deform/errors.h"
#include "io/mesh_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/vtk_maker.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

struct Kind {
  const char* name;
  std::vector<const char*> encodings;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all = {{"f.vtk", {"ascii", "binary", "ascii-4", "binary-4", "binary:double"}}};
#ifdef TETWARP_WITH_VTK
  all.push_back(
      {"f.vtu", {"ascii", "binary", "raw", "base64", "zlib", "lz4", "inline-zlib", "big", "wide", "zlib:double"}});
#endif
  return all;
}

bool make(const std::string& encoding, const std::filesystem::path& file) {
  return make_vtk("UnstructuredGrid", encoding, file, {});
}

FieldSource with(const std::filesystem::path& path, const std::string& options) {
  return parse_field_source(path.string() + ":" + options);
}

std::string error_of(const FieldSource& source) {
  return refusal([&] { read_mesh_file(source); });
}

/// mm^3 of the tetrahedra of cell n, between 10 n and 10 n + 1 mm along x; each must be positively oriented.
std::vector<double> volumes(const TetrahedralMesh& mesh) {
  std::vector<double> sums(10, 0.0);
  for (const glm::u32vec4& t : mesh.tetrahedra) {
    const glm::dvec3 a = mesh.rest[t[0]], b = mesh.rest[t[1]], c = mesh.rest[t[2]], d = mesh.rest[t[3]];
    const double volume = glm::dot(b - a, glm::cross(c - a, d - a)) / 6;
    EXPECT_GT(volume, 0) << a.x << " " << a.y << " " << a.z;
    sums.at(static_cast<std::size_t>((a.x + 1) / 10)) += volume;
  }
  return sums;
}

std::string replaced(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t at = bytes.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? bytes : bytes.replace(at, from.size(), to);
}

TEST(VtkMesh, EveryEncodingGivesTheSameCells) {
  const Scratch scratch;
  for (const Kind& kind : kinds()) {
    for (const std::string encoding : kind.encodings) {
      SCOPED_TRACE(kind.name + (" " + encoding));
      if (!make(encoding, scratch / kind.name)) GTEST_SKIP() << "python3-vtk9";
      EXPECT_TRUE(is_mesh_file(scratch / kind.name));
      const MeshFile file = read_mesh_file(scratch / kind.name);
      const std::vector<double> found = volumes(file.mesh);
      const std::vector<double> expected = {1. / 6, 1, 1, 1. / 2, 1. / 3, 1. / 6, 1, 1. / 2, 1. / 3, 1};
      for (std::size_t n = 0; n < expected.size(); ++n) EXPECT_NEAR(found[n], expected[n], 1e-5) << n;
      EXPECT_EQ(file.header.cells, (std::array<std::uint64_t, 4>{2, 2, 2, 4}));
      ASSERT_EQ(file.mesh.rest.size(), 62U);  // corners alone
      for (std::size_t v = 0; v < 62; ++v)
        EXPECT_EQ(file.mesh.displacement[v], v == 3 ? glm::vec3(3, 5, 7) : glm::vec3(0)) << v;
      EXPECT_EQ(file.mesh.rest[3], glm::dvec3(0, 0, 1));
      EXPECT_EQ(file.header.displacement, "how far");
      std::string notes;
      for (const std::string& note : file.header.notes) notes += note + "; ";
      EXPECT_TRUE(says(notes, {"1 triangles are left out", "1 quadratic tetrahedra are taken by their corners",
                               "1 triquadratic hexahedra are taken by their corners"}));
    }
  }
}

TEST(VtkMesh, VectorsFrameAndUnitsAreOptions) {
  const Scratch scratch;
  const auto file = scratch / "f.vtk";
  if (!make("ascii:two", file)) GTEST_SKIP() << "python3-vtk9";
  EXPECT_EQ(read_mesh_file(file).mesh.displacement[3], glm::vec3(3, 5, 7));
  EXPECT_EQ(read_mesh_file(with(file, "displacement=velocity")).mesh.displacement[3], glm::vec3(30, 50, 70));
  const MeshFile turned = read_mesh_file(with(file, "frame=ras,units=m"));
  EXPECT_EQ(turned.mesh.displacement[3], glm::vec3(-3000, -5000, 7000));
  EXPECT_EQ(turned.mesh.rest[4], glm::dvec3(-10000, 0, 0));
  write_file(file, replaced(read_bytes(file), "vtk output", "SPACE=RAS"));
  EXPECT_EQ(read_mesh_file(file).mesh.displacement[3], glm::vec3(-3, -5, 7));
  EXPECT_EQ(read_mesh_header(file).frame_basis, FieldBasis::stated);
  ASSERT_TRUE(make("ascii:none", scratch / "rest.vtk"));
  EXPECT_TRUE(says(error_of(scratch / "rest.vtk"), {"which vectors are the displacement?"}));
}

TEST(VtkMesh, CellsThatCannotBeTakenAreRefused) {
  const Scratch scratch;
  const auto file = scratch / "f.vtk";
  if (!make("ascii-4", file)) GTEST_SKIP() << "python3-vtk9";
  const std::string good = read_bytes(file);
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& why) {
    write_file(file, replaced(good, from, to));
    const std::string text = error_of(file);
    EXPECT_TRUE(text.starts_with("InputError: ")) << text;
    EXPECT_TRUE(says(text, {why, file.string()})) << to;
  };
  refused("\n4 0 1 2 3 \n", "\n4 0 1 2 300 \n", "a cell with the point 300");
  refused("\n4 0 1 2 3 \n", "\n4 0 1 2 -3 \n", "a number in CELLS -3");
  refused("\n4 0 1 2 3 \n", "\n4 0 1 2 2.5 \n", "a number in CELLS 2.5");
  refused("\n4 0 1 2 3 \n", "\n3 0 1 2 3 \n", "");
  refused("\n4 0 1 2 3 \n", "\n4000000000 0 1 2 3 \n", "the cell 0 has 4000000000 points");
  refused("CELL_TYPES 11\n10\n", "CELL_TYPES 11\n12\n", "the cell 0 of hexahedra has 4 points");
  refused("CELL_TYPES 11\n10\n", "CELL_TYPES 11\n42\n", "polyhedron");
  refused("CELL_TYPES 11\n10\n", "CELL_TYPES 11\n71\n", "VTK's type 71");
  refused("CELL_TYPES 11\n10\n", "CELL_TYPES 11\n256\n", "the type of a cell 256");
  refused("CELL_TYPES 11", "CELL_TYPES 1000000000000", "is the file whole?");
  refused("CELLS 11 ", "CELLS 11 1000000000000 \n", "is the file whole?");
  ASSERT_TRUE(make("ascii", file));
  const std::string newer = read_bytes(file);
  EXPECT_NE(newer.find("OFFSETS vtktypeint64\n0 4 12 20 "), std::string::npos);
  for (const auto& [offsets, why] : std::vector<std::pair<const char*, const char*>>{
           {"0 4 12 2 ", "go back"}, {"1 4 12 20 ", "do not begin at 0"}, {"0 4 12 2e12 ", "an offset of a cell"}}) {
    write_file(file, replaced(newer, "0 4 12 20 ", offsets));
    EXPECT_TRUE(says(error_of(file), {why, file.string()}));
  }
#ifdef TETWARP_WITH_VTK
  ASSERT_TRUE(make("zlib:polyhedron", scratch / "f.vtu"));
  EXPECT_TRUE(says(error_of(scratch / "f.vtu"), {"the cell 11 is of VTK's type 42 (polyhedron)"}));
  ASSERT_TRUE(make("ascii", scratch / "f.vtu"));
  const std::string xml = read_bytes(scratch / "f.vtu");
  for (const auto& [from, to, why] : std::vector<std::array<const char*, 3>>{
           {"          4 12 20 ", "          4 12 2 ", "go back"},
           {"          4 12 20 ", "          4 12 1000000 ", "go back"},
           {"NumberOfCells=\"11\"", "NumberOfCells=\"10\"", "more than 10 values"},
           {"NumberOfCells=\"11\"", "NumberOfCells=\"12\"", "is the file whole?"},
           {"NumberOfCells=\"11\"", "NumberOfCells=\"100000000000\"", "promises too much"},
           {"NumberOfPoints=\"119\"", "NumberOfPoints=\"120\"", "is the file whole?"},
           {"NumberOfPoints=\"119\"", "NumberOfPoints=\"100000000000\"", "promises too much"},
           {"\"connectivity\"", "\"Connectivity\"", "no arrays types, offsets and connectivity"}}) {
    write_file(scratch / "f.vtu", replaced(xml, from, to));
    EXPECT_TRUE(says(error_of(scratch / "f.vtu"), {"InputError: ", why, (scratch / "f.vtu").string()})) << to;
  }
#endif
}

TEST(VtkMesh, TruncatedAtAnyByteIsRefused) {
  const Scratch scratch;
  for (const Kind& kind : kinds()) {
    for (const std::string encoding : kind.encodings) {
      if (encoding.ends_with("double") || encoding == "big" || encoding == "wide") continue;
      const auto file = scratch / kind.name;
      if (!make(encoding, file)) GTEST_SKIP() << "python3-vtk9";
      const std::string good = read_bytes(file);
      EXPECT_EQ(error_of(file), "");
      const std::size_t end = good.find_last_not_of(" \n") + 1;
      for (std::size_t n = 0; n < end; n += n < 100 || n + 100 > end ? 1 : 31) {
        if (n == end - 1 && encoding.starts_with("binary") && kind.name == std::string("f.vtk")) continue;  // a 0 byte
        write_file(file, good.substr(0, n));
        const std::string text = error_of(file);
        ASSERT_TRUE(text.starts_with("InputError: ")) << kind.name << " " << encoding << " byte " << n << ": " << text;
        ASSERT_TRUE(says(text, {file.string()})) << n;
      }
    }
  }
}

#ifndef TETWARP_WITH_VTK
/// A mesh as SOFA's VTKExporter writes it (VTKExporter.cpp): positions alone, edges before tetrahedra, and .vtu in the
/// name of either form. Points are shifted by x * z.
std::string sofa(bool xml, int shift) {
  std::ostringstream points, text;
  for (const glm::ivec3 p : {glm::ivec3(0), {10, 0, 0}, {0, 10, 0}, {0, 0, 10}, {10, 10, 10}})
    points << p.x + shift * p.z << " " << p.y << " " << p.z << "\n";
  if (xml) {
    text << "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"BigEndian\">\n  <UnstructuredGrid>\n"
            "    <Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n      <Points>\n        <DataArray type=\"Float32\" "
            "NumberOfComponents=\"3\" format=\"ascii\">\n"
         << points.str()
         << "        </DataArray>\n      </Points>\n      <Cells>\n        <DataArray type=\"Int32\" "
            "Name=\"connectivity\" format=\"ascii\">\n          0 1\n          0 1 2 3\n          1 2 3 4\n"
            "        </DataArray>\n        <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n"
            "          2 6 10 \n        </DataArray>\n        <DataArray type=\"UInt8\" Name=\"types\" "
            "format=\"ascii\">\n          3 10 10 \n        </DataArray>\n      </Cells>\n    </Piece>\n"
            "  </UnstructuredGrid>\n</VTKFile>\n";
  } else {
    text << "# vtk DataFile Version 2.0\nExported VTK file\nASCII\n\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
         << points.str() << "\nCELLS 3 13\n2 0 1\n4 0 1 2 3\n4 1 2 3 4\n\nCELL_TYPES 3\n3\n10\n10\n\n";
  }
  return text.str();
}

TEST(VtkMesh, FilesOfSofaAreReadWithTheirDeformedPlaces) {
  const Scratch scratch;
  std::vector<bool> forms = {false};
#ifdef TETWARP_WITH_VTK
  forms.push_back(true);
#endif
  for (const bool xml : forms) {
    write_file(scratch / "liver0.vtu", sofa(xml, 0));
    write_file(scratch / "liver1.vtu", sofa(xml, 2));
    const MeshFile file = read_mesh_file(with(scratch / "liver0.vtu", "deformed=" + (scratch / "liver1.vtu").string()));
    EXPECT_EQ(file.header.tetrahedra, 2U);
    ASSERT_EQ(file.mesh.displacement.size(), 5U);
    EXPECT_EQ(file.mesh.displacement[0], glm::vec3(0));
    EXPECT_EQ(file.mesh.displacement[4], glm::vec3(20, 0, 0));
  }
}

TEST(VtkMesh, XmlFilesAreRefusedWithoutVtk) {
  const Scratch scratch;
  write_file(scratch / "f.vtu", "<VTKFile></VTKFile>");
  EXPECT_TRUE(says(error_of(scratch / "f.vtu"), {"built without VTK", "f.vtu"}));
}
#endif

}  // namespace
}  // namespace tetwarp
