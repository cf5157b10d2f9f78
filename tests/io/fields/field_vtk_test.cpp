// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Grids that VTK writes, as fields: a corner moved by (3, 5, 7), all else at rest.
#include <gtest/gtest.h>

#include <cmath>

#include "deform/errors.h"
#include "io/field_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/vtk_maker.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

constexpr double kFloat = 4e-5;  // mm: of points near 230 mm as floats
constexpr double kText = 1e-3;   // mm: of six digits, which is what VTK writes

/// Straight, with axes exchanged and turned, at no right angle to anything, and that left-handed.
std::vector<Geometry> grids() {
  Geometry flipped = oblique_grid();
  flipped.direction[1] = -flipped.direction[1];
  return {all_orientations()[0], all_orientations()[29], oblique_grid(), flipped};
}

Geometry small_grid() {
  Geometry grid;
  grid.size = {2, 3, 2};
  grid.spacing = {1.5, 2, 2.5};
  grid.origin = {-10, 20, 30};
  return grid;
}

FieldSource with(const std::filesystem::path& path, const std::string& options) {
  return parse_field_source(path.string() + (options.empty() ? "" : ":" + options));
}

std::string error_of(const FieldSource& source) {
  return refusal([&] { read_pull_field(source); });
}

void expect_corner(const FieldSource& source, const Geometry& grid, double tolerance_mm,
                   const glm::vec3& corner = {3, 5, 7}) {
  const FieldFile field = read_field_file(source);
  EXPECT_TRUE(same_grid(field.grid, grid, tolerance_mm)) << source.path;
  std::vector<glm::vec3> expected = corner_displacement(grid);
  for (glm::vec3& d : expected) d = d == glm::vec3(0) ? d : corner;
  EXPECT_EQ(field.displacement, expected) << source.path;
}

/// The bytes with the first of one text made another.
std::string replaced(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t at = bytes.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? bytes : bytes.replace(at, from.size(), to);
}

/// Each kind of file that a reader here takes, with its encodings.
struct Kind {
  const char *kind, *name;
  std::vector<const char*> encodings;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all = {{"StructuredGrid", "f.vtk", {"ascii", "binary", "ascii-4", "binary-4", "binary:double"}},
                           {"ImageData", "f.vtk", {"ascii", "binary"}},
                           {"RectilinearGrid", "f.vtk", {"ascii", "binary"}}};
#ifdef TETWARP_WITH_VTK
  all.push_back({"StructuredGrid",
                 "f.vts",
                 {"ascii", "binary", "raw", "base64", "zlib", "lz4", "inline-zlib", "big", "wide", "zlib:double"}});
  all.push_back({"ImageData", "f.vti", {"ascii", "raw", "zlib"}});
  all.push_back({"RectilinearGrid", "f.vtr", {"ascii", "raw", "zlib"}});
#endif
  return all;
}

bool is_legacy(const Kind& kind) { return kind.name == std::string("f.vtk"); }

TEST(VtkField, EveryEncodingGivesTheSameCorner) {
  const Scratch scratch;
  const Geometry grid = grids()[0];
  for (const Kind& kind : kinds()) {
    for (const std::string encoding : kind.encodings) {
      SCOPED_TRACE(std::string(kind.kind) + " " + encoding);
      if (!make_vtk(kind.kind, encoding, scratch / kind.name, grid)) GTEST_SKIP() << "python3-vtk9";
      EXPECT_TRUE(is_field_file(scratch / kind.name));
      const bool floats = kind.kind == std::string("StructuredGrid") && !encoding.ends_with("double");
      const bool text = encoding.starts_with("ascii") || (kind.kind == std::string("ImageData") && is_legacy(kind));
      expect_corner(scratch / kind.name, grid, text ? kText : floats ? kFloat : 1e-9);
      const FieldFileHeader header = read_field_header(scratch / kind.name);
      EXPECT_NE(header.format.find("vectors \"how far\""), std::string::npos) << header.format;
      EXPECT_EQ(header.direction, std::nullopt);
      EXPECT_EQ(header.frame_basis, FieldBasis::assumed);
      EXPECT_EQ(header.units_basis, FieldBasis::assumed);
    }
  }
}

TEST(VtkField, GridsAtAllAnglesKeepTheirPlace) {
  const Scratch scratch;
  for (const Geometry& grid : grids()) {
    if (!make_vtk("StructuredGrid", "binary", scratch / "f.vtk", grid)) GTEST_SKIP() << "python3-vtk9";
    expect_corner(scratch / "f.vtk", grid, kFloat);
    expect_corner(with(scratch / "f.vtk", "displacement=how far"), grid, kFloat);
#ifdef TETWARP_WITH_VTK
    ASSERT_TRUE(make_vtk("StructuredGrid", "zlib:double", scratch / "f.vts", grid));
    expect_corner(scratch / "f.vts", grid, 1e-9);
    ASSERT_TRUE(make_vtk("ImageData", "raw", scratch / "f.vti", grid));
    expect_corner(scratch / "f.vti", grid, 1e-9);
    ASSERT_TRUE(make_vtk("ImageData", "raw:extent", scratch / "f.vti", grid));
    expect_corner(scratch / "f.vti", grid, 1e-9);
#endif
  }
}

#ifdef TETWARP_WITH_VTK
TEST(VtkField, AnExtentMayBeginAnywhere) {
  const Scratch scratch;
  const Geometry grid = small_grid();
  for (const std::string encoding : {"ascii:extent", "zlib:extent"}) {
    if (!make_vtk("StructuredGrid", encoding, scratch / "f.vts", grid)) GTEST_SKIP() << "python3-vtk9";
    EXPECT_NE(read_bytes(scratch / "f.vts").find("WholeExtent=\"-2 -1 3 5 5 6\""), std::string::npos);
    expect_corner(scratch / "f.vts", grid, kFloat);
    ASSERT_TRUE(make_vtk("ImageData", encoding, scratch / "f.vti", grid));
    expect_corner(scratch / "f.vti", grid, 1e-9);
    ASSERT_TRUE(make_vtk("RectilinearGrid", encoding, scratch / "f.vtr", grid));
    expect_corner(scratch / "f.vtr", grid, 1e-9);
  }
}

TEST(VtkField, LargeFilesAreReadInParts) {
  const Scratch scratch;
  Geometry grid = small_grid();
  grid.size = {61, 47, 13};  // 111813 numbers: more than are read at once, in blocks that end in the middle of a vector
  for (const std::string encoding : {"ascii", "zlib", "base64", "inline-zlib"}) {
    if (!make_vtk("StructuredGrid", encoding, scratch / "f.vts", grid)) GTEST_SKIP() << "python3-vtk9";
    expect_corner(scratch / "f.vts", grid, kFloat);
  }
  for (const std::string encoding : {"ascii", "binary"}) {
    ASSERT_TRUE(make_vtk("StructuredGrid", encoding, scratch / "f.vtk", grid));
    expect_corner(scratch / "f.vtk", grid, kFloat);
  }
}
#endif

TEST(VtkField, TheVectorsAreChosenOrRefused) {
  const Scratch scratch;
  const Geometry grid = small_grid();
  const auto file = scratch / "f.vtk";
  if (!make_vtk("StructuredGrid", "ascii:two", file, grid)) GTEST_SKIP() << "python3-vtk9";
  expect_corner(file, grid, kFloat);  // "displacement" beside "velocity"
  expect_corner(with(file, "displacement=velocity"), grid, kFloat, {30, 50, 70});
  EXPECT_TRUE(
      says(error_of(with(file, "displacement=label")), {"no vectors \"label\"", "\"displacement\", \"velocity\""}));
  EXPECT_TRUE(says(error_of(with(file, "order=zyx")), {"the option \"order\""}));
  write_file(file, replaced(read_bytes(file), "displacement", "d%20sum"));
  EXPECT_TRUE(says(error_of(file), {"2 arrays of vectors", "\"d sum\", \"velocity\"", "displacement=NAME"}));
  expect_corner(with(file, "displacement=d sum"), grid, kFloat);
  ASSERT_TRUE(make_vtk("StructuredGrid", "ascii:none", file, grid));
  EXPECT_TRUE(says(error_of(file), {"no vectors at the points", file.string()}));
}

TEST(VtkField, FrameAndUnitsAreTakenFromOptionsOrTheTitle) {
  const Scratch scratch;
  const Geometry grid = small_grid();
  const auto file = scratch / "f.vtk";
  if (!make_vtk("StructuredGrid", "ascii", file, grid)) GTEST_SKIP() << "python3-vtk9";
  Geometry turned = grid;
  turned.origin = {10, -20, 30};
  turned.direction = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1);
  expect_corner(with(file, "frame=ras"), turned, kFloat, {-3, -5, 7});
  EXPECT_EQ(read_field_header(with(file, "frame=ras")).frame_basis, FieldBasis::by_option);
  EXPECT_EQ(read_field_header(with(file, "frame=lps")).frame, "LPS");
  Geometry metres = grid;
  metres.origin *= 1000;
  metres.spacing *= 1000;
  expect_corner(with(file, "units=m"), metres, kFloat, {3000, 5000, 7000});
  EXPECT_EQ(read_field_header(with(file, "units=m")).units, "m");
  EXPECT_TRUE(says(error_of(with(file, "frame=xyz")), {"frame=xyz", "expected lps or ras"}));
  EXPECT_TRUE(says(error_of(with(file, "units=cm")), {"units=cm", "expected mm or m"}));
  write_file(file, replaced(read_bytes(file), "vtk output", "3D Slicer output. SPACE=RAS"));
  expect_corner(file, turned, kFloat, {-3, -5, 7});
  EXPECT_EQ(read_field_header(file).frame_basis, FieldBasis::stated);
  EXPECT_TRUE(says(error_of(with(file, "frame=lps")), {"the file says RAS, the option LPS"}));
  write_file(file, replaced(read_bytes(file), "SPACE=RAS", "SPACE=IJK"));
  EXPECT_TRUE(says(error_of(file), {"SPACE=IJK", "expected LPS or RAS"}));
}

TEST(VtkField, IrregularGridsAreRefusedByTheirFirstVertex) {
  const Scratch scratch;
  if (!make_vtk("StructuredGrid", "ascii:off", scratch / "f.vtk", small_grid())) GTEST_SKIP() << "python3-vtk9";
  EXPECT_TRUE(says(error_of(scratch / "f.vtk"), {"do not form a regular lattice", "vertex (1, 2, 0) lies 0.3"}));
  ASSERT_TRUE(make_vtk("RectilinearGrid", "ascii:off", scratch / "f.vtk", grids()[0]));
  EXPECT_TRUE(says(error_of(scratch / "f.vtk"), {"do not form a regular lattice", "vertex (1, 0, 0) lies 0.3"}));
  Geometry sheared = small_grid();
  sheared.direction[1] = {0.6, 0.8, 0};
  ASSERT_TRUE(make_vtk("StructuredGrid", "ascii", scratch / "f.vtk", sheared));
  EXPECT_TRUE(says(error_of(scratch / "f.vtk"), {"axes that are not at right angles"}));
  Geometry flat = small_grid();
  flat.size.z = 1;
  ASSERT_TRUE(make_vtk("StructuredGrid", "ascii", scratch / "f.vtk", flat));
  EXPECT_TRUE(says(error_of(scratch / "f.vtk"), {"2 x 3 x 1 points", "at least 2 on every axis"}));
}

TEST(VtkField, TruncatedAtAnyByteIsRefused) {
  const Scratch scratch;
  for (const Kind& kind : kinds()) {
    for (const std::string encoding : kind.encodings) {
      if (encoding.ends_with("double") || encoding == "big" || encoding == "wide") continue;
      const auto file = scratch / kind.name;
      if (!make_vtk(kind.kind, encoding, file, small_grid())) GTEST_SKIP() << "python3-vtk9";
      const std::string good = read_bytes(file);
      EXPECT_EQ(error_of(file), "");
      const std::size_t blanks = good.size() - good.find_last_not_of(" \n") - 1;
      const std::size_t end = good.size() - (encoding == "binary" && file.extension() == ".vtk" ? 1 : blanks);
      const bool every = kind.kind == std::string("StructuredGrid") && (is_legacy(kind) || encoding == "raw");
      for (std::size_t n = 0; n < end; n += every || n + 100 > end ? 1 : 13) {
        write_file(file, good.substr(0, n));
        const std::string text = error_of(file);
        ASSERT_TRUE(text.starts_with("InputError: ")) << kind.name << " " << encoding << " byte " << n << ": " << text;
        ASSERT_TRUE(says(text, {file.string()})) << n;
      }
    }
  }
}

TEST(VtkField, LegacyHeadersThatPromiseTooMuchAreRefused) {
  const Scratch scratch;
  for (const std::string encoding : {"ascii", "binary"}) {
    if (!make_vtk("StructuredGrid", encoding, scratch / "g.vtk", small_grid())) GTEST_SKIP() << "python3-vtk9";
    const std::string good = read_bytes(scratch / "g.vtk");
    const auto refused = [&](const std::string& from, const std::string& to, const std::string& why) {
      write_file(scratch / "f.vtk", replaced(good, from, to));
      const std::string text = error_of(scratch / "f.vtk");
      EXPECT_TRUE(text.starts_with("InputError: ")) << text;
      EXPECT_TRUE(says(text, {why, (scratch / "f.vtk").string()})) << to;
    };
    refused("# vtk", "# vtc", "not a legacy VTK file");
    refused("STRUCTURED_GRID", "STRUCTURED_GRIT", "expected STRUCTURED_GRID");
    refused("STRUCTURED_GRID", "POLYDATA", "expected STRUCTURED_GRID");
    refused("DIMENSIONS 2 3 2", "DIMENSIONS 0 3 2", "at least 1 on every axis");
    refused("DIMENSIONS 2 3 2", "DIMENSIONS -2 3 2", "where a count is expected");
    refused("DIMENSIONS 2 3 2", "DIMENSIONS 2 3 3", "the file has 18");
    refused("DIMENSIONS 2 3 2", "DIMENSIONS 1000000000000 1000000000000 1000000000000", "a grid of");
    refused("POINTS 12", "POINTS 1000000000000", "is the file whole?");
    refused("POINTS 12", "POINTS 99999999999999999999", "where a count is expected");
    refused("POINT_DATA 12", "POINT_DATA 1000000000000", "data of 1000000000000 points");
    refused("VECTORS how%20far float", "VECTORS how%20far string", "values of the type");
    refused("VECTORS how%20far float", "VECTORS how%20far bit", encoding == "ascii" ? "no vectors" : "no text");
    refused("FIELD FieldData 1", "FIELD FieldData 99999999999", "");
  }
}

TEST(VtkField, NumbersThatAreNotFiniteAreRefusedByTheirVertex) {
  const Scratch scratch;
  const Geometry grid = small_grid();
  const auto file = scratch / "f.vtk";
  for (const std::string bad : {"nan", "inf", "-inf"}) {
    if (!make_vtk("StructuredGrid", "ascii", file, grid)) GTEST_SKIP() << "python3-vtk9";
    write_file(file, replaced(read_bytes(file), "3 5 7", "3 " + bad + " 7"));
    EXPECT_TRUE(says(refusal([&] { read_forward_field(file); }), {"not finite", "at vertex (1, 0, 1)"}));
    if (bad == "nan") {
      EXPECT_TRUE(std::isnan(read_pull_field(file).displacement[7].y));
    } else {
      EXPECT_TRUE(says(error_of(file), {"not finite", "at vertex (1, 0, 1)"}));
    }
    ASSERT_TRUE(make_vtk("StructuredGrid", "ascii", file, grid));
    write_file(file, replaced(read_bytes(file), "-8.5 24", bad + " 24"));
    EXPECT_TRUE(says(error_of(file), {"lattice"}));
  }
}

#ifdef TETWARP_WITH_VTK
TEST(VtkField, XmlHeadersThatPromiseTooMuchAreRefused) {
  const Scratch scratch;
  for (const std::string encoding : {"ascii", "binary", "raw", "zlib", "inline-zlib", "wide"}) {
    if (!make_vtk("StructuredGrid", encoding, scratch / "g.vts", small_grid())) GTEST_SKIP() << "python3-vtk9";
    const std::string good = read_bytes(scratch / "g.vts");
    const auto refused = [&](const std::string& bytes, const std::string& why) {
      write_file(scratch / "f.vts", bytes);
      const std::string text = error_of(scratch / "f.vts");
      EXPECT_TRUE(text.starts_with("InputError: ")) << text;
      EXPECT_TRUE(says(text, {why, (scratch / "f.vts").string()})) << encoding;
    };
    const auto both = [&](const std::string& extent) {
      return replaced(replaced(good, "Extent=\"0 1 0 2 0 1\"", "Extent=\"" + extent + "\""), "Extent=\"0 1 0 2 0 1\"",
                      "Extent=\"" + extent + "\"");
    };
    refused(replaced(good, "<VTKFile", "<VTKFil"), "no XML that VTK can read");
    refused(replaced(good, "type=\"StructuredGrid\"", "type=\"PolyData\""), "a dataset of the type \"PolyData\"");
    refused(both("0 1 0 2 0 2"), encoding == "ascii" ? "is the file whole?" : "promises too much");
    refused(both("0 999999 0 999999 0 0"), "promises too much");
    refused(both("0 999999 0 999999 0 999999"), "expected at least 1 on every axis, and fewer");
    refused(both("0 -5 0 2 0 1"), "expected at least 1 on every axis");
    refused(both("0 1 0 2 0"), "5 numbers");
    refused(both("0 1 0 2 0 x"), "where a number is expected");
    refused(replaced(good, "Extent=\"0 1 0 2 0 1\"", "Extent=\"0 3 0 2 0 1\""), "a part of a grid");
    if (encoding != "ascii") {
      refused(replaced(good, "type=\"Float32\" Name=\"Points\"", "type=\"Float64\" Name=\"Points\""),
              "promises too much");
    }
    refused(replaced(good, "type=\"Float32\" Name=\"Points\"", "type=\"String\" Name=\"Points\""), "no Points");
    refused(replaced(good, "<Piece", "<Piece></Piece><Piece"), "2 pieces");
    refused(good.substr(0, good.size() - 12), "does not end with </VTKFile>");
    std::string deep;
    for (int n = 0; n < 100000; ++n) deep += "<a>";
    deep = replaced(good, "<Piece", deep + "<Piece");
    write_file(scratch / "f.vts", deep);
    EXPECT_TRUE(error_of(scratch / "f.vts").starts_with("InputError: "));
  }
}

TEST(VtkField, DamagedBlocksAndLengthsAreRefused) {
  const Scratch scratch;
  const auto file = scratch / "f.vts";
  for (const std::string encoding : {"raw", "zlib", "wide"}) {
    if (!make_vtk("StructuredGrid", encoding, file, small_grid())) GTEST_SKIP() << "python3-vtk9";
    const std::string good = read_bytes(file);
    const std::size_t begin = good.find('_', good.find("<AppendedData")) + 1, end = good.find("\n  </AppendedData>");
    std::size_t refused = 0;
    for (std::size_t at = begin; at < end; ++at) {
      for (const char byte : {'\x7f', '\xff', '\x00'}) {
        std::string bytes = good;
        bytes[at] = byte;
        write_file(file, bytes);
        const std::string text = error_of(file);
        ASSERT_TRUE(text.empty() || text.starts_with("InputError: ")) << encoding << " byte " << at << ": " << text;
        if (!text.empty()) ++refused;
      }
    }
    EXPECT_GT(refused, 30U) << encoding;
  }
}

TEST(VtkField, AnyFlippedBitOfZlibValuesIsRefusedOrHarmless) {
  const Scratch scratch;
  const auto file = scratch / "f.vts";
  for (const std::string encoding : {"zlib", "inline-zlib"}) {
    if (!make_vtk("StructuredGrid", encoding, file, small_grid())) GTEST_SKIP() << "python3-vtk9";
    const std::string good = read_bytes(file);
    const FieldFile expected = read_field_file(file);
    const bool inside = encoding == "inline-zlib";
    const std::size_t first = inside ? good.find("<PointData") : good.find('_', good.find("<AppendedData")) + 1,
                      last = good.find(inside ? "</Piece>" : "\n  </AppendedData>");
    std::size_t refused = 0;
    for (std::size_t bit = 8 * first; bit < 8 * last; bit += inside ? 3 : 1) {
      std::string bytes = good;
      bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
      write_file(file, bytes);
      try {
        const FieldFile field = read_field_file(file);
        ASSERT_TRUE(field.displacement == expected.displacement && field.grid == expected.grid)
            << encoding << ", bit " << bit % 8 << " of byte " << bit / 8 - first;
      } catch (const InputError& error) {
        ASSERT_TRUE(says(error.what(), {file.string()}));
        ++refused;
      }
    }
    EXPECT_GT(refused, last - first) << encoding;
  }
}
#else
TEST(VtkField, XmlFilesAreRefusedWithoutVtk) {
  const Scratch scratch;
  for (const std::string name : {"f.vts", "f.vti", "f.vtr"}) {
    write_file(scratch / name, "<VTKFile></VTKFile>");
    EXPECT_TRUE(is_field_file(scratch / name));
    EXPECT_TRUE(says(refusal([&] { read_field_header(scratch / name); }), {"built without VTK", name}));
  }
}
#endif

TEST(VtkField, OtherDatasetsAreNoFields) {
  const Scratch scratch;
  if (!make_vtk("UnstructuredGrid", "ascii", scratch / "f.vtk", small_grid())) GTEST_SKIP() << "python3-vtk9";
  EXPECT_FALSE(is_field_file(scratch / "f.vtk"));
  write_file(scratch / "p.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n");
  EXPECT_FALSE(is_field_file(scratch / "p.vtk"));
  EXPECT_TRUE(says(error_of(scratch / "p.vtk"), {"DATASET POLYDATA", "expected STRUCTURED_GRID"}));
}

}  // namespace
}  // namespace tetwarp
