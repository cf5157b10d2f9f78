// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Fields as other tools write them: a corner moved by (3, 5, 7) mm, all else at rest, whichever way it is stored.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/foreign_field.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

/// A volume's grid that is none of `grids()`.
Geometry volume_grid() {
  Geometry grid;
  grid.size = {6, 5, 7};
  grid.spacing = {1.5, 2, 2.5};
  return grid;
}

TEST(FieldFormats, OwnFilesHaveTheCornerInBothDirections) {
  const Scratch scratch;
  for (const Geometry& grid : grids()) {
    for (const std::string name : {"f.mha", "f.nrrd"}) {
      write_field_file(scratch / name, VertexField{grid, corner_displacement(grid)});
      expect_corner(read_field_file(scratch / name), grid, 0, name);
      EXPECT_EQ(read_forward_field(scratch / name).displacement, corner_displacement(grid));
      write_field_file(scratch / name, PullField{grid, corner_displacement(grid)});
      EXPECT_EQ(read_pull_field(scratch / name).displacement, corner_displacement(grid));
      EXPECT_EQ(read_field_header(scratch / name).direction_basis, FieldBasis::stated);
      EXPECT_EQ(read_field_header(scratch / name).absolute_basis, FieldBasis::by_format);
    }
  }
}

TEST(FieldFormats, WhatAFileDoesNotSayIsAssumed) {
  const Scratch scratch;
  write_image(scratch / "f.mha", numbered(volume_grid(), VoxelType::f32, 3).view());
  const FieldFileHeader header = read_field_header(scratch / "f.mha");
  EXPECT_EQ(header.format, "MHA");
  EXPECT_EQ(header.direction, std::nullopt);
  EXPECT_EQ(header.frame, "LPS");
  EXPECT_EQ(header.frame_basis, FieldBasis::assumed);
  EXPECT_EQ(header.units_basis, FieldBasis::assumed);
  EXPECT_EQ(header.absolute_basis, FieldBasis::assumed);
  write_image(scratch / "f.nrrd", numbered(volume_grid(), VoxelType::f32, 3).view());
  EXPECT_EQ(read_field_header(scratch / "f.nrrd").frame_basis, FieldBasis::assumed);
  std::string bytes = read_bytes(scratch / "f.nrrd");
  bytes.insert(bytes.find("encoding:"), "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n");
  write_file(scratch / "f.nrrd", bytes);
  EXPECT_EQ(read_field_header(scratch / "f.nrrd").frame_basis, FieldBasis::stated);
}

TEST(FieldFormats, OptionsAreForFilesThatNeedThem) {
  const Scratch scratch;
  write_image(scratch / "f.mha", numbered(volume_grid(), VoxelType::f32, 3).view());
  FieldSource source(scratch / "f.mha");
  source.options["order"] = "zyx";
  EXPECT_NE(error_of(source).find("the option \"order\" for "), std::string::npos) << error_of(source);
  write_file(scratch / "f.xyz", "no field");
  EXPECT_NE(error_of(scratch / "f.xyz").find("InputError: not a field file, "), std::string::npos);
  EXPECT_NE(error_of(scratch / "none.xyz").find("InputError: no such file, "), std::string::npos);
}

TEST(FieldFormats, TextsAreAPathAndOptions) {
  const Scratch scratch;
  const FieldSource plain = parse_field_source("a/b.npy");
  EXPECT_EQ(plain.path, "a/b.npy");
  EXPECT_TRUE(plain.options.empty());
  const FieldSource source = parse_field_source("C:/b.npy:order=zyx,units=mm");
  EXPECT_EQ(source.path, "C:/b.npy");
  EXPECT_EQ(source.options, (std::map<std::string, std::string>{{"order", "zyx"}, {"units", "mm"}}));
  write_file(scratch / "odd:a=b", "x");
  EXPECT_EQ(parse_field_source((scratch / "odd:a=b").string()).path, scratch / "odd:a=b");
  const std::string long_name(300, 'x');  // no file system holds it
  EXPECT_EQ(parse_field_source(long_name + ":order=zyx").path, long_name);
  EXPECT_NE(error_of(scratch / long_name).find("InputError: "), std::string::npos);
  EXPECT_NE(refusal([] { parse_field_source("b.npy:order=,units=mm"); }).find("expected KEY=VALUE"), std::string::npos);
  EXPECT_NE(refusal([] { parse_field_source("b.npy:order=zyx,mm"); }).find("expected KEY=VALUE"), std::string::npos);
  EXPECT_NE(refusal([] { parse_field_source("b.npy:order=zyx,order=xyz"); }).find("is given twice"), std::string::npos);
}

// --- NumPy arrays

FieldSource npy(const std::filesystem::path& path, const std::string& options, const Geometry& grid) {
  FieldSource source = parse_field_source(path.string() + ":" + options);
  source.grid = grid;
  return source;
}

TEST(NpyField, EveryOrderLayoutAndTypeGivesTheSameCorner) {
  const Scratch scratch;
  const Geometry grid = grids().back();
  write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
  const std::string zyx = "order=zyx,units=mm", xyz = "order=xyz,units=mm";
  const std::vector<std::pair<std::string, std::string>> kinds = {{"npy:<f4:zyx:C", zyx},
                                                                  {"npy:<f4:zyx:F", zyx},
                                                                  {"npy:>f4:zyx:C", zyx},
                                                                  {"npy:<f8:zyx:F", zyx},
                                                                  {"npy:>f8:zyx:C", zyx},
                                                                  {"npy:<f4:xyz:C", xyz},
                                                                  {"npy:<f4:xyz:F", xyz},
                                                                  {"npy:<f4:zyx:C:reversed", zyx + ",components=zyx"},
                                                                  {"npy:<f8:xyz:F:reversed", xyz + ",components=zyx"}};
  for (const auto& [kind, options] : kinds) {
    if (!make_foreign_field(kind, scratch / "f.mha", scratch / "f.npy")) GTEST_SKIP() << "python3-numpy";
    expect_corner(read_field_file(npy(scratch / "f.npy", options, grid)), grid, 0, kind);
  }
}

/// The array's bytes, little endian floats, C order. @param shape  as text: "(7, 5, 6, 3)"
std::string npy_bytes(const std::string& shape, const std::vector<float>& values, const std::string& type = "<f4",
                      int version = 1) {
  std::string text = "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  text.resize((text.size() / 64 + 1) * 64, ' ');
  std::string bytes = std::string("\x93NUMPY") + static_cast<char>(version) + '\0';
  for (int i = 0; i < (version == 1 ? 2 : 4); ++i) bytes += static_cast<char>(text.size() >> 8 * i & 255);
  bytes += text;
  return bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

/// The corner of `volume_grid()` in zyx order, each vector as `value(LPS mm)`.
std::vector<float> corner_values(const std::function<glm::vec3(const glm::vec3&)>& value) {
  std::vector<float> values;
  for (const glm::vec3& mm : corner_displacement(volume_grid())) {
    for (int c = 0; c < 3; ++c) values.push_back(value(mm)[c]);
  }
  return values;
}

std::vector<float> plain_values() {
  return corner_values([](const glm::vec3& mm) { return mm; });
}

TEST(NpyField, VoxelsAreAlongTheGridAndRasIsTurned) {
  const Scratch scratch;
  Geometry grid = volume_grid();
  write_file(scratch / "ras.npy",
             npy_bytes("(7, 5, 6, 3)", corner_values([](const glm::vec3& mm) { return mm * glm::vec3(-1, -1, 1); })));
  expect_corner(read_field_file(npy(scratch / "ras.npy", "order=zyx,units=mm,frame=ras", grid)), grid, 0, "ras");
  // i along -y, j along z, k along x: (3, 5, 7) mm are (-5 / 1.5, 7 / 2, 3 / 2.5) voxels.
  grid.direction = glm::dmat3(0, -1, 0, 0, 0, 1, 1, 0, 0);
  write_file(scratch / "voxel.npy", npy_bytes("(7, 5, 6, 3)", corner_values([](const glm::vec3& mm) {
                                                return glm::vec3(-mm.y / 1.5F, mm.z / 2, mm.x / 2.5F);
                                              })));
  expect_corner(read_field_file(npy(scratch / "voxel.npy", "order=zyx,units=voxel", grid)), grid, 1e-6, "voxel");
  const FieldFileHeader header = read_field_header(npy(scratch / "voxel.npy", "order=zyx,units=voxel", grid));
  EXPECT_EQ(header.frame, "index");
  EXPECT_EQ(header.units, "voxel");
  EXPECT_EQ(header.units_basis, FieldBasis::by_option);
  EXPECT_EQ(header.direction, std::nullopt);
  EXPECT_FALSE(header.has_own_grid);
}

TEST(NpyField, VersionsOneToThreeAreReadAndNoOther) {
  const Scratch scratch;
  for (const int version : {1, 2, 3}) {
    write_file(scratch / "f.npy", npy_bytes("(7, 5, 6, 3)", plain_values(), "<f4", version));
    expect_corner(read_field_file(npy(scratch / "f.npy", "order=zyx,units=mm", volume_grid())), volume_grid(), 0,
                  std::to_string(version));
  }
  write_file(scratch / "f.npy", npy_bytes("(7, 5, 6, 3)", plain_values(), "<f4", 4));
  EXPECT_NE(error_of(npy(scratch / "f.npy", "order=zyx,units=mm", volume_grid())).find("version 4 of .npy"),
            std::string::npos);
}

TEST(NpyField, OrderAndUnitsMustBeGiven) {
  const Scratch scratch;
  write_file(scratch / "f.npy", npy_bytes("(7, 5, 6, 3)", plain_values()));
  const auto refused = [&](const std::string& options, const std::string& why) {
    FieldSource source = options.empty() ? FieldSource(scratch / "f.npy") : npy(scratch / "f.npy", options, {});
    source.grid = volume_grid();
    const std::string text = error_of(source);
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << options << ": " << text;
    EXPECT_NE(text.find((scratch / "f.npy").string()), std::string::npos) << text;
  };
  refused("", ":order=zyx|xyz,units=mm|voxel");
  refused("order=zyx", ":order=zyx|xyz,units=mm|voxel");
  refused("units=mm", ":order=zyx|xyz,units=mm|voxel");
  refused("order=yxz,units=mm", "order=yxz, ");
  refused("order=zyx,units=cm", "units=cm, ");
  refused("order=zyx,units=mm,colour=red", "the option \"colour\"");
  refused("order=zyx,units=voxel,frame=ras", "a frame for voxels");
  refused("order=xyz,units=mm", "with order=zyx it fits");
  Geometry other = volume_grid();
  other.size.y = 4;
  EXPECT_NE(error_of(npy(scratch / "f.npy", "order=zyx,units=mm", other))
                .find("a field of 6 x 5 x 7 vertices for a volume of 6 x 4 x 7 voxels"),
            std::string::npos);
  FieldSource nowhere = npy(scratch / "f.npy", "order=zyx,units=mm", {});
  nowhere.grid.reset();
  EXPECT_NE(error_of(nowhere).find("a field without a grid"), std::string::npos);
}

TEST(NpyField, DamagedFilesAreRefusedByName) {
  const Scratch scratch;
  const auto refused = [&](const std::string& bytes, const std::string& why) {
    write_file(scratch / "f.npy", bytes);
    const std::string text = error_of(npy(scratch / "f.npy", "order=zyx,units=mm", volume_grid()));
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << why << " | " << text;
    EXPECT_NE(text.find((scratch / "f.npy").string()), std::string::npos) << text;
  };
  const std::string good = npy_bytes("(7, 5, 6, 3)", plain_values());
  for (std::size_t n = 0; n < good.size(); n += n < 200 ? 1 : 97) refused(good.substr(0, n), "");
  refused("", "an empty file");
  refused("\x93NUMPX" + good.substr(6), "not a .npy file");
  refused(good + "x", "bytes behind the array");
  refused(good.substr(0, good.size() - 1), "truncated, or a header that promises too much");
  const std::vector<float> few(3);
  expect_read_or_refused(good, 128, npy(scratch / "f.npy", "order=zyx,units=mm", volume_grid()));
  refused(npy_bytes("(7, 5, 6)", few), "an array of shape (7, 5, 6)");
  refused(npy_bytes("(3, 7, 5, 6)", few), "numpy.moveaxis");
  refused(npy_bytes("()", few), "an array of shape ()");
  refused(npy_bytes("(7, 5, 6, 3", few), "'shape'");
  refused(npy_bytes("(7, -5, 6, 3)", few), "expected at least 1 on every axis");
  refused(npy_bytes("(7, 0, 6, 3)", few), "expected at least 1 on every axis");
  refused(npy_bytes("(99999999999999999999, 5, 6, 3)", few), "expected at least 1 on every axis");
  refused(npy_bytes("(9000000000000000000, 9000000000000000000, 9000000000000000000, 3)", few), "promises too much");
  refused(npy_bytes("(100000, 100000, 100000, 3)", few), "promises too much");
  refused(npy_bytes("(7, 5, 6, 3)", plain_values(), "<i4"), "an array of type '<i4'");
  refused(npy_bytes("(7, 5, 6, 3)", plain_values(), "|O"), "an array of type '|O'");
  std::string key = good;
  refused(key.replace(key.find("shape"), 5, "shope"), "a header without 'shape'");
  std::string fortran = good;
  refused(fortran.replace(fortran.find("False"), 5, "Maybe"), "neither True nor False");
  std::string longer = npy_bytes("(7, 5, 6, 3)", plain_values(), "<f4", 2);
  longer[11] = '\x7f';
  refused(longer, "expected at most 10000");
  for (const float bad : {INFINITY, -INFINITY}) {
    std::vector<float> values = plain_values();
    values[3 * 7 + 1] = bad;
    refused(npy_bytes("(7, 5, 6, 3)", values), "at vertex (1, 1, 0)");
    write_file(scratch / "f.npy", npy_bytes("(7, 5, 6, 3)", values));
    for (const std::string options : {"order=zyx,units=voxel", "order=zyx,units=mm,frame=ras"}) {
      EXPECT_NE(error_of(npy(scratch / "f.npy", options, volume_grid())).find("at vertex (1, 1, 0)"),
                std::string::npos);
    }
  }
  std::vector<float> values = plain_values();
  values[3 * 7 + 1] = NAN;
  write_file(scratch / "f.npy", npy_bytes("(7, 5, 6, 3)", values));
  EXPECT_NE(refusal([&] {
              read_forward_field(npy(scratch / "f.npy", "order=zyx,units=mm", volume_grid()));
            }).find("at vertex (1, 1, 0)"),
            std::string::npos);
}

TEST(NpyField, IsKnownByItsFirstBytesToo) {
  const Scratch scratch;
  write_file(scratch / "field.dat", npy_bytes("(7, 5, 6, 3)", plain_values()));
  EXPECT_TRUE(is_field_file(scratch / "field.dat"));
  expect_corner(read_field_file(npy(scratch / "field.dat", "order=zyx,units=mm", volume_grid())), volume_grid(), 0, "");
}

// --- NIfTI

TEST(NiftiField, EveryKindGivesTheSameCornerOnEveryGrid) {
  struct Kind {
    const char *name, *format, *frame;
    bool absolute;
    std::optional<FieldDirection> direction;
  };
  constexpr auto kPull = FieldDirection::pull;
  const std::vector<Kind> kinds = {{"1006", "NIfTI, intent 1006 (DISPVECT)", "RAS", false, {}},
                                   {"1007", "NIfTI, intent 1007 (VECTOR)", "LPS", false, {}},
                                   {"nreg-0", "NIfTI, NiftyReg deformation field", "RAS", true, kPull},
                                   {"nreg-1", "NIfTI, NiftyReg displacement field", "RAS", false, kPull}};
  const Scratch scratch;
  for (const Geometry& grid : grids()) {
    write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
    for (const Kind& kind : kinds) {
      for (const std::string name : {"f.nii", "f.nii.gz"}) {
        if (name == "f.nii.gz" && !same_grid(grid, oblique_grid(), 0)) continue;
        if (!make_foreign_field(kind.name, scratch / "f.mha", scratch / name)) GTEST_SKIP() << "python3-nibabel";
        const FieldFileHeader header = read_field_header(scratch / name);
        EXPECT_EQ(header.format, kind.format);
        EXPECT_EQ(header.frame, kind.frame) << kind.name;
        EXPECT_EQ(header.absolute, kind.absolute) << kind.name;
        EXPECT_EQ(header.direction, kind.direction) << kind.name;
        EXPECT_TRUE(is_field_file(scratch / name)) << kind.name;
        // Positions near 230 mm in float have steps of 1.5e-5 mm, and so has the grid's origin.
        expect_corner(read_field_file(scratch / name), grid, kind.absolute ? 6e-5 : 0, kind.name);
        EXPECT_EQ(read_pull_field(scratch / name).displacement.size(), 60U);
        const std::string text = refusal([&] { read_forward_field(scratch / name); });
        EXPECT_EQ(text.find("a pull field where a forward field is expected") != std::string::npos,
                  kind.direction == kPull)
            << text;
      }
    }
  }
}

TEST(NiftiField, OtherFilesOfNiftyRegAreRefusedByName) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
  const auto refused = [&](const std::string& why) {
    const std::string text = error_of(scratch / "f.nii");
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << why << " | " << text;
    EXPECT_NE(text.find((scratch / "f.nii").string()), std::string::npos) << text;
  };
  const std::vector<std::pair<const char*, const char*>> kinds = {
      {"nreg-2", "a cubic B-spline control point grid"},  {"nreg-3", "a velocity field of positions"},
      {"nreg-4", "a velocity field of displacements"},    {"nreg-5", "a velocity control point grid"},
      {"nreg-6", "a linear B-spline control point grid"}, {"nreg-7", "a NiftyReg file of unknown kind"},
      {"nreg--1", "a NiftyReg file of unknown kind"},     {"nreg-0.5", "a NiftyReg file of unknown kind"},
      {"nreg-nan", "a NiftyReg file of unknown kind"}};
  for (const auto& [kind, why] : kinds) {
    if (!make_foreign_field(kind, scratch / "f.mha", scratch / "f.nii")) GTEST_SKIP() << "python3-nibabel";
    refused(why);
  }
  ASSERT_TRUE(make_foreign_field("nreg-0", scratch / "f.mha", scratch / "f.nii"));
  const std::string good = read_bytes(scratch / "f.nii");
  std::string name = good;
  name.replace(328, 10, "NREG_WHAT\0", 10);
  write_file(scratch / "f.nii", name);
  refused("(intent_name \"NREG_WHAT\"");
}

TEST(NiftiField, NiftyRegsGoesByTheSformWhateverIsAskedFor) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
  if (!make_foreign_field("nreg-1", scratch / "f.mha", scratch / "f.nii")) GTEST_SKIP() << "python3-nibabel";
  std::string bytes = read_bytes(scratch / "f.nii");
  put(bytes, 252, std::int16_t{1});
  put(bytes, 254, std::int16_t{2});                 // the sform is not the scanner's: ITK takes the qform
  put(bytes, 292, get<float>(bytes, 292) + 10.0F);  // srow_x[3]: to the right
  write_file(scratch / "f.nii", bytes);
  for (const NiftiFrame frame : {NiftiFrame::sform, NiftiFrame::qform}) {
    FieldSource source(scratch / "f.nii");
    source.nifti_frame = frame;
    EXPECT_NEAR(read_field_header(source).grid.origin.x, grid.origin.x - 10, 1e-4);
    EXPECT_EQ(read_field_header(source).notes.size(), 1u);
  }
}

TEST(NiftiField, DamagedFilesAreRefusedByName) {
  const Scratch scratch;
  const Geometry grid = oblique_grid();
  write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
  for (const std::string kind : {"1006", "nreg-0"}) {
    if (!make_foreign_field(kind, scratch / "f.mha", scratch / "g.nii")) GTEST_SKIP() << "python3-nibabel";
    const std::string good = read_bytes(scratch / "g.nii");
    const auto refused = [&](const std::string& bytes, const std::string& why) {
      write_file(scratch / "f.nii", bytes);
      const std::string text = error_of(scratch / "f.nii");
      EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << why << " | " << text;
      EXPECT_NE(text.find((scratch / "f.nii").string()), std::string::npos) << text;
    };
    const auto with = [&](std::size_t at, auto value) {
      std::string bytes = good;
      put(bytes, at, value);
      return bytes;
    };
    for (std::size_t n = 0; n < good.size(); n += n < 352 ? 11 : 97) refused(good.substr(0, n), "");
    refused("", "an empty file");
    expect_read_or_refused(good, 352, scratch / "f.nii");
    refused(with(344, 'x'), "not NIfTI-1 in one file");
    refused(with(42, std::int16_t{32767}), "promises too much");
    refused(with(42, std::int16_t{-4}), "expected at least 1 on every axis");
    refused(with(50, std::int16_t{2}), "2");  // two components
    refused(with(70, std::int16_t{32}), "complex64");
    for (const float bad : {INFINITY, -INFINITY}) refused(with(352 + 4 * 7, bad), "at vertex (3, 1, 0)");
    write_file(scratch / "f.nii", with(352 + 4 * 7, NAN));
    EXPECT_TRUE(std::isnan(read_pull_field(scratch / "f.nii").displacement[7].x));
    EXPECT_NE(refusal([&] {
                read_forward_field(scratch / "f.nii");
              }).find(kind == "1006" ? "at vertex (3, 1, 0)" : "a pull field"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace tetwarp
