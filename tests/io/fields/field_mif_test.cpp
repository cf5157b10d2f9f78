// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Warps of MRtrix: a corner moved by (3, 5, 7) mm, all else at rest, in every order of the values. What MRtrix itself
// wrote is compared in python/tests/test_formats.py.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "io/field_file.h"
#include "tests/support/foreign_field.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

/// How a file has its values.
struct Form {
  std::array<int, 4> layout = {1, 2, 3, 4};  ///< as mrconvert -strides takes it: i, j, k, component; 1 is the fastest
  std::string type = "Float32LE";
  bool positions = false;
};

std::string digits(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

/// The lines of a header before the last two.
std::string header_of(const Geometry& grid, const Form& form) {
  const glm::i64vec3 n = grid.size;
  std::string text = "mrtrix image\ndim: " + std::to_string(n.x) + "," + std::to_string(n.y) + "," +
                     std::to_string(n.z) + ",3\nvox: " + digits(grid.spacing.x) + "," + digits(grid.spacing.y) + "," +
                     digits(grid.spacing.z) + ",nan\nlayout: ";
  for (const int stride : form.layout)
    text += std::string(stride < 0 ? "-" : "+") + std::to_string(std::abs(stride) - 1) + ",";
  text.back() = '\n';
  text += "datatype: " + form.type;
  const glm::dvec3 ras(-1, -1, 1);
  for (int row = 0; row < 3; ++row) {
    text += "\ntransform: ";
    for (int axis = 0; axis < 3; ++axis) text += digits(ras[row] * grid.direction[axis][row]) + ", ";
    text += digits(ras[row] * grid.origin[row]);
  }
  return text + "\ncommand_history: made by a test # and a comment\n";
}

/// A header, its last two lines, and the values.
std::string with_values(const std::string& header, const std::string& values) {
  const std::size_t offset = (header.size() + 40) / 4 * 4;
  std::string bytes = header + "file: . " + std::to_string(offset) + "\nEND\n";
  bytes.resize(offset);
  return bytes + values;
}

std::string number(double value, const std::string& type) {
  std::string bytes;
  if (type.starts_with("Float32")) append_value(bytes, static_cast<float>(value));
  if (type.starts_with("Float64")) append_value(bytes, value);
  if (type.ends_with("BE")) std::ranges::reverse(bytes);
  return bytes;
}

/// The values of `corner_displacement`, each where the layout has it.
std::string values_of(const Geometry& grid, const Form& form) {
  const std::array<std::int64_t, 4> size = {grid.size.x, grid.size.y, grid.size.z, 3};
  const std::size_t bytes = number(0, form.type).size();
  std::string values(3 * bytes * static_cast<std::size_t>(voxel_count(grid)), '\0');
  const std::vector<glm::vec3> displacement = corner_displacement(grid);
  const AffineMap point = point_from_index(grid);
  std::array<std::int64_t, 4> at{};
  for (std::size_t v = 0; v < displacement.size(); ++v) {
    const auto n = static_cast<std::int64_t>(v);
    at = {n % size[0], n / size[0] % size[1], n / (size[0] * size[1]), 0};
    const glm::dvec3 lps =
        glm::dvec3(displacement[v]) + (form.positions ? point(glm::dvec3(at[0], at[1], at[2])) : glm::dvec3(0));
    const glm::dvec3 ras(-lps.x, -lps.y, lps.z);
    for (at[3] = 0; at[3] < 3; ++at[3]) {
      std::int64_t place = 0;
      for (std::size_t axis = 0; axis < 4; ++axis) {
        std::int64_t step = 1;  // the sizes of all axes that are faster
        for (std::size_t other = 0; other < 4; ++other)
          step *= std::abs(form.layout[other]) < std::abs(form.layout[axis]) ? size[other] : 1;
        place += step * (form.layout[axis] < 0 ? size[axis] - 1 - at[axis] : at[axis]);
      }
      values.replace(static_cast<std::size_t>(place) * bytes, bytes, number(ras[static_cast<int>(at[3])], form.type));
    }
  }
  return values;
}

std::string file_of(const Geometry& grid, const Form& form) {
  return with_values(header_of(grid, form), values_of(grid, form));
}

FieldSource with(const std::filesystem::path& path, const std::string& options) {
  return parse_field_source(path.string() + (options.empty() ? "" : ":" + options));
}

FieldSource source_of(const std::filesystem::path& path, const Form& form) {
  return with(path, form.positions ? "values=positions" : "values=displacements");
}

/// The message with which bytes are refused as displacements; empty: they are read.
std::string refused(const std::filesystem::path& path, const std::string& bytes) {
  write_file(path, bytes);
  return error_of(with(path, "values=displacements"));
}

TEST(MifField, EveryOrderOfTheValuesGivesTheSameCorner) {
  const Scratch scratch;
  Form form;
  const Geometry grid = oblique_grid();
  do {
    for (const unsigned signs : {0U, 1U, 2U, 4U, 8U, 15U}) {
      Form signed_form = form;
      for (std::size_t axis = 0; axis < 4; ++axis)
        if (signs >> axis & 1U) signed_form.layout[axis] = -form.layout[axis];
      write_file(scratch / "w.mif", file_of(grid, signed_form));
      expect_corner(read_field_file(source_of(scratch / "w.mif", form)), grid, 0, header_of(grid, signed_form));
    }
  } while (std::next_permutation(form.layout.begin(), form.layout.end()));
}

TEST(MifField, EveryTypeAndBothKindsOfValuesAreReadOnEveryGrid) {
  const Scratch scratch;
  for (const Geometry& grid : grids()) {
    for (const char* type : {"Float32LE", "Float32BE", "Float64LE", "Float64BE"}) {
      for (const bool positions : {false, true}) {
        const Form form{{-2, 4, -1, 3}, type, positions};
        write_file(scratch / "w.mif", file_of(grid, form));
        write_gzipped(scratch / "w.mif.gz", file_of(grid, form));
        for (const char* name : {"w.mif", "w.mif.gz"}) {
          // Positions near 230 mm in float have steps of 1.5e-5 mm; those in double are rounded as displacements.
          const bool rounded = positions && form.type.starts_with("Float32");
          expect_corner(read_field_file(source_of(scratch / name, form)), grid,
                        rounded     ? 2e-5
                        : positions ? 1e-12
                                    : 0,
                        std::string(type) + name);
        }
      }
    }
  }
}

TEST(MifField, ItsHeaderSaysAllButWhatTheValuesAre) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  write_file(scratch / "w.mif", file_of(grid, {}));
  EXPECT_TRUE(is_field_file(with(scratch / "w.mif", "values=positions")));
  const FieldFileHeader header = read_field_header(with(scratch / "w.mif", "values=positions"));
  EXPECT_EQ(header.format, "MIF, MRtrix warp");
  EXPECT_EQ(header.direction, Direction::pull);
  EXPECT_EQ(header.direction_basis, FieldBasis::by_format);
  EXPECT_EQ(header.frame, "RAS");
  EXPECT_EQ(header.frame_basis, FieldBasis::by_format);
  EXPECT_EQ(header.units, "mm");
  EXPECT_EQ(header.units_basis, FieldBasis::by_format);
  EXPECT_TRUE(header.absolute);
  EXPECT_EQ(header.absolute_basis, FieldBasis::by_option);
  EXPECT_TRUE(says(error_of(scratch / "w.mif"), {"does not say", "w.mif:values=displacements|positions"}));
  EXPECT_TRUE(says(error_of(with(scratch / "w.mif", "values=vectors")), {"values=vectors", "w.mif"}));
  EXPECT_TRUE(says(error_of(with(scratch / "w.mif", "values=positions,frame=lps")), {"frame=lps", "RAS", "w.mif"}));
  EXPECT_EQ(error_of(with(scratch / "w.mif", "values=displacements,frame=ras")), "");
  EXPECT_TRUE(says(error_of(with(scratch / "w.mif", "units=mm")), {"the option \"units\"", "w.mif"}));
  EXPECT_TRUE(says(refusal([&] { read_forward_field(with(scratch / "w.mif", "values=displacements")); }),
                   {"a pull field where a forward field is expected", "w.mif"}));
}

TEST(MifField, IsKnownByItsFirstBytesToo) {
  const Scratch scratch;
  write_file(scratch / "warp.dat", file_of(oblique_grid(), {}));
  expect_corner(read_field_file(with(scratch / "warp.dat", "values=displacements")), oblique_grid(), 0, "");
}

TEST(MifField, NaNIsNoSourceAndInfinityIsRefused) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  const Form form{{2, 3, 4, 1}, "Float32LE", true};
  const auto with_number = [&](float value) {
    std::string values = values_of(grid, form);
    for (std::size_t c = 0; c < 3; ++c) values.replace(12 * 5 + 4 * c, 4, number(value, form.type));
    write_file(scratch / "w.mif", with_values(header_of(grid, form), values));
  };
  with_number(NAN);
  const PullField field = read_pull_field(source_of(scratch / "w.mif", form));
  EXPECT_TRUE(std::isnan(field.displacement[5].x) && std::isnan(field.displacement[5].z));
  EXPECT_TRUE(std::isfinite(field.displacement[4].x) && std::isfinite(field.displacement[6].x));
  for (const float bad : {INFINITY, -INFINITY}) {
    with_number(bad);
    EXPECT_TRUE(says(error_of(source_of(scratch / "w.mif", form)), {"not finite", "at vertex (1, 1, 0)", "w.mif"}));
  }
}

TEST(MifField, TruncatedFilesAndMoreBytesAreRefused) {
  const Scratch scratch;
  const std::string plain = file_of(oblique_grid(), {});
  write_gzipped(scratch / "whole.gz", plain);
  const std::string packed = read_bytes(scratch / "whole.gz");
  for (const auto& [name, good] : {std::pair("w.mif", plain), std::pair("w.mif.gz", packed)}) {
    EXPECT_EQ(refused(scratch / name, good), "");
    for (std::size_t size = 0; size < good.size(); size += size < 20 ? 1 : 7)
      EXPECT_TRUE(says(refused(scratch / name, good.substr(0, size)), {"InputError: ", name})) << size;
    EXPECT_TRUE(says(refused(scratch / name, good + "1234"), {"InputError: ", name, "whole?"}));
  }
  write_gzipped(scratch / "w.mif.gz", plain + "1234");
  EXPECT_TRUE(says(error_of(with(scratch / "w.mif.gz", "values=positions")), {"more bytes follow", "w.mif.gz"}));
  for (std::size_t at = 1; at <= 8; ++at) {  // the check sum and the length
    std::string damaged = packed;
    damaged[packed.size() - at] = static_cast<char>(~damaged[packed.size() - at]);
    EXPECT_TRUE(says(refused(scratch / "w.mif.gz", damaged), {"damaged", "w.mif.gz"})) << at;
  }
}

TEST(MifField, DamagedHeadersAreRefusedByName) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  const std::string header = header_of(grid, {}), values = values_of(grid, {});
  const auto expect = [&](const std::string& from, const std::string& to, const std::vector<std::string>& why) {
    std::string changed = header;
    ASSERT_NE(changed.find(from), std::string::npos) << from;
    changed.replace(changed.find(from), from.size(), to);
    const std::string text = refused(scratch / "w.mif", with_values(changed, values));
    EXPECT_TRUE(says(text, {"InputError: ", "w.mif"}) && says(text, why)) << to;
  };
  expect("mrtrix image", "mrtrix tracks", {"not an image of MRtrix"});
  expect("dim: 4,3,5,3", "dim: 4,3,5,3\ndim: 4,3,5,3", {"2 lines of \"dim\""});
  expect("dim: 4,3,5,3", "size: 4,3,5,3", {"a header without \"dim\""});
  expect("dim: 4,3,5,3", "dim: 4,3,5", {"no warp but an image of 4,3,5 values"});
  expect("dim: 4,3,5,3", "dim: 4,3,5,1", {"no warp but an image of 4,3,5,1 values"});
  expect("dim: 4,3,5,3", "dim: 4,3,5,3,4", {"a full warp of mrregister", "warpconvert"});
  expect("dim: 4,3,5,3", "dim: 4,3,-5,3", {"whole numbers from 1 on"});
  expect("dim: 4,3,5,3", "dim: 4,0,5,3", {"whole numbers from 1 on"});
  expect("dim: 4,3,5,3", "dim: 4,3,x,3", {"whole numbers from 1 on"});
  expect("dim: 4,3,5,3", "dim: 99999999999999999999,3,5,3", {"whole numbers from 1 on"});
  expect("dim: 4,3,5,3", "dim: 900000000000000,900000000000000,900000000000000,3", {"promises too much"});
  expect("dim: 4,3,5,3", "dim: 4,3,6,3", {"promises too much (4 x 3 x 6 x 3 x "});
  expect("dim: 4,3,5,3", "dim: 4,3,4,3", {"bytes behind the values"});
  expect("vox: ", "vox: x,", {"expected numbers"});
  expect("vox: ", "vox: 0,", {"spacing"});
  expect("vox: ", "vox: nan,", {"spacing"});
  expect("layout: +0,+1,+2,+3", "layout: +0,+1,+2", {"in any order"});
  expect("layout: +0,+1,+2,+3", "layout: +0,+1,+2,+2", {"in any order"});
  expect("layout: +0,+1,+2,+3", "layout: +0,+1,+2,+4", {"in any order"});
  expect("layout: +0,+1,+2,+3", "layout: +0,+1,+2,+", {"in any order"});
  expect("layout: +0,+1,+2,+3", "layout: +0,+1,+2,+33", {"in any order"});
  expect("Float32LE", "Float32", {"values of the type float32"});
  expect("Float32LE", "CFloat32LE", {"values of the type cfloat32le"});
  expect("Float32LE", "Int32LE", {"values of the type int32le"});
  expect("Float32LE", "Float64LE", {"promises too much"});
  expect("command", "scaling: 5,2\ncommand", {"floats with a scaling", "mrconvert"});
  expect("transform", "transfer", {"2 lines of \"transform\""});
  expect("transform", "transform: 1,0,0,0\ntransform", {"4 lines of \"transform\""});
  expect("transform: ", "transform: 1,0,0,\ntransfer: ", {"expected 4 numbers"});
  expect("transform: ", "transform: nan,", {"w.mif"});
  Geometry longer = grid, sheared = grid;
  longer.direction[0] *= 1.1;
  EXPECT_TRUE(says(refused(scratch / "w.mif", file_of(longer, {})), {"axis 0 with length 1.1", "w.mif"}));
  sheared.direction[0] = glm::normalize(grid.direction[0] + 0.1 * grid.direction[1]);
  EXPECT_TRUE(says(refused(scratch / "w.mif", file_of(sheared, {})), {"a sheared grid", "w.mif"}));
  // What MRtrix takes as well: no scaling, the last row of a matrix, one-digit signs left out, lines that say nothing.
  std::string others = header;
  others.replace(others.find("layout: +0,+1"), 13, "LAYOUT: 0 , +1");
  others += "transform: 0,0,0,1\nscaling: 0,1\n\nno colon\r\n";
  EXPECT_EQ(refused(scratch / "w.mif", with_values(others, values)), "");
}

TEST(MifField, TheValuesLieBehindTheHeaderOfTheSameFile) {
  const Scratch scratch;
  const std::string header = header_of(oblique_grid(), {}), values = values_of(oblique_grid(), {});
  const auto text = [&](const std::string& file) {
    return refused(scratch / "w.mif", header + "file: " + file + "\nEND\n" + values);
  };
  for (const char* file : {".", ". 0", ". 20", ". x", ". 900 7", ". -5"})
    EXPECT_TRUE(says(text(file), {"\"file: ", "w.mif", "expected a dot"})) << file;
  EXPECT_TRUE(says(text(". 900000"), {"promises too much"}));
  EXPECT_TRUE(says(text("w.dat"), {"values in another file (w.dat)", "mrconvert"}));
  EXPECT_TRUE(says(refused(scratch / "w.mih", header + "file: w.dat 0\nEND\n"), {"(w.dat)", "w.mih", "mrconvert"}));
  EXPECT_TRUE(says(refused(scratch / "w.mif", header + "END\n" + values), {"a header without \"file\""}));
  EXPECT_TRUE(says(refused(scratch / "w.mif", header + std::string(2 << 20, 'x')), {"a header that does not end"}));
  // A small packed file cannot hold so much, and nothing is allocated for it.
  const std::string large = "dim: 4000,4000,4000,3";
  std::string much = header;
  much.replace(much.find("dim: 4,3,5,3"), 12, large);
  write_gzipped(scratch / "w.mif.gz", with_values(much, values));
  EXPECT_TRUE(says(error_of(with(scratch / "w.mif.gz", "values=positions")), {"promises too much", "w.mif.gz"}));
}

TEST(MifField, AnyByteOfTheHeaderMayBeDamaged) {
  const Scratch scratch;
  const std::string good = file_of(oblique_grid(), {});
  expect_read_or_refused(good, good.find("END\n") + 8, with(scratch / "w.mif", "values=positions"));
}

}  // namespace
}  // namespace tetwarp
