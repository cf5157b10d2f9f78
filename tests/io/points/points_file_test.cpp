// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Landmarks and surfaces in files: places and frames in every form, and all that must stay as it is.
#include "io/points_file.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "deform/errors.h"
#include "tests/support/point_files.h"
#include "tests/support/random.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

using nlohmann::ordered_json;

constexpr auto kMoved = PointStatus::moved, kOutside = PointStatus::outside;

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What a file becomes when its points are displaced by (0.5, -1.25, 100) LPS mm, those outside excepted.
std::string displaced(const Scratch& scratch, const std::string& name, const std::string& bytes,
                      std::vector<PointStatus> status = {kMoved, kMoved, kMoved}) {
  write_file(scratch / name, bytes);
  const PointsFile file(scratch / name);
  std::vector<glm::dvec3> points = file.points();
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (status.at(n) == kMoved) points[n] += glm::dvec3(0.5, -1.25, 100);
  }
  file.write(scratch / ("out-" + name), points, status);
  return read_text(scratch / ("out-" + name));
}

/// The text with one part of it exchanged.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// The message with which a file is refused.
std::string refusal(const Scratch& scratch, const std::string& name, const std::string& bytes,
                    std::optional<PointFrame> told = {}) {
  write_file(scratch / name, bytes);
  try {
    PointsFile(scratch / name, told);
  } catch (const InputError& error) {
    return error.what();
  }
  return "read without an error";
}

TEST(PointsFile, EveryFormTellsItsPlacesInEitherFrame) {
  const Scratch scratch;
  for (const PointForm& form : point_forms()) {
    SCOPED_TRACE(form.name);
    write_file(scratch / form.name, form.lps);
    const PointsFile lps(scratch / form.name);
    EXPECT_EQ(lps.points(), sample_points());
    EXPECT_EQ(lps.frame(), PointFrame::lps);
    write_file(scratch / form.name, form.ras);
    const PointsFile ras(scratch / form.name);
    EXPECT_EQ(ras.frame(), PointFrame::ras);
    ASSERT_EQ(ras.points().size(), 3u);
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(ras.points()[n], sample_points()[n] * glm::dvec3(-1, -1, 1));
  }
}

TEST(PointsFile, EveryFormIsWrittenInItsOwnFrame) {
  const Scratch scratch;
  for (const PointForm& form : point_forms()) {
    for (const bool in_ras : {false, true}) {
      SCOPED_TRACE(form.name + (in_ras ? " RAS" : " LPS"));
      const std::string bytes = displaced(scratch, form.name, in_ras ? form.ras : form.lps);
      const PointsFile before(scratch / form.name), after(scratch / ("out-" + form.name));
      EXPECT_EQ(after.frame(), before.frame());
      for (std::size_t n = 0; n < 3; ++n)
        EXPECT_LE(glm::length(after.points()[n] - before.points()[n] - glm::dvec3(0.5, -1.25, 100)), 1e-6);
      EXPECT_EQ(after.points()[0], before.points()[0] + glm::dvec3(0.5, -1.25, 100));
    }
  }
}

TEST(PointsFile, NumbersComeBackWithTheirBits) {
  const Scratch scratch;
  const std::vector<glm::dvec3> places = {{0.1, -1.0 / 3, 1e-7}, {123456.789012345, -0.0, 2e6 / 7}, {3e-5, 1e5, -7}};
  for (const PointForm& form : point_forms()) {
    const bool floats = form.name == "binary.stl" || form.name == "float.vtk";
    for (const std::string& bytes : {form.lps, form.ras}) {
      write_file(scratch / form.name, bytes);
      PointsFile(scratch / form.name).write(scratch / ("out-" + form.name), places, std::vector(3, kMoved));
      const PointsFile back(scratch / ("out-" + form.name));
      for (std::size_t n = 0; n < 3; ++n) {
        if (floats) {
          EXPECT_EQ(glm::vec3(back.points()[n]), glm::vec3(places[n])) << form.name;
        } else {
          EXPECT_EQ(back.points()[n], places[n]) << form.name;
        }
      }
      EXPECT_EQ(read_text(scratch / ("out-" + form.name)).find("-0 "), std::string::npos) << form.name;
    }
  }
}

TEST(PointsFile, CsvKeepsOtherColumnsAndAddsTheStatus) {
  const Scratch scratch;
  const std::string text =
      "\xEF\xBB\xBFlabel,z,note,\"y\", x \r\n"
      "\"a, \"\"b\"\"\",3,\"two\r\nlines\",2,1\r\n"
      " c ,30.50,,\"20.0\", 10 \r\n"
      "\r\n"
      "d,0,\xC3\xA9,0,1e1";
  const std::string expected =
      "\xEF\xBB\xBFlabel,z,note,\"y\", x ,status\r\n"
      "\"a, \"\"b\"\"\",103,\"two\r\nlines\",0.75,1.5,moved\r\n"
      " c ,30.50,,\"20.0\", 10 ,outside\r\n"
      "\r\n"
      "d,100,\xC3\xA9,-1.25,10.5,moved";
  EXPECT_EQ(displaced(scratch, "a.csv", text, {kMoved, kOutside, kMoved}), expected);
}

TEST(PointsFile, CsvOfAnEarlierRunGetsItsStatusAnew) {
  const Scratch scratch;
  EXPECT_EQ(displaced(scratch, "a.csv", "x,status,y,z\n1,outside,2,3\n4,moved,5,6\n", {kMoved, kOutside}),
            "x,status,y,z\n1.5,moved,0.75,103\n4,outside,5,6\n");
  EXPECT_TRUE(
      says(refusal(scratch, "a.csv", "x,y,z,status\n1,2,3,moved\n4,5,6,healed\n"), {"healed", "line 3", "a.csv"}));
}

TEST(PointsFile, FcsvKeepsAllElseAndSaysWhatIsOutside) {
  const Scratch scratch;
  const std::string found = displaced(scratch, "a.fcsv", sample_fcsv("RAS"), {kMoved, kOutside, kOutside});
  std::string expected = sample_fcsv("RAS");
  expected = with(expected, "1,1,2,3,", "1,0.5,3.25,103,");
  expected = with(expected, "seen", "\"seen; outside the field, not moved\"");
  expected = with(expected, "F-3,,", "F-3,\"outside the field, not moved\",");
  EXPECT_EQ(found, expected);
}

TEST(PointsFile, MarkupsKeepAllElseAndSayWhatIsOutside) {
  const Scratch scratch;
  const std::string found = displaced(scratch, "a.mrk.json", sample_markups("\"RAS\""), {kMoved, kOutside, kOutside});
  ordered_json expected = ordered_json::parse(sample_markups("\"RAS\""));
  auto& first = expected["markups"][0]["controlPoints"];
  first[0]["position"] = {0.5, 3.25, 103.0};
  first[1]["description"] = "seen; outside the field, not moved";
  expected["markups"][1]["controlPoints"][1]["description"] = "outside the field, not moved";
  EXPECT_EQ(found, expected.dump(4) + "\n");
  // A second run says it once.
  EXPECT_EQ(displaced(scratch, "b.mrk.json", found, {kOutside, kOutside, kOutside}).find("moved; outside"),
            std::string::npos);
}

TEST(PointsFile, MarkupsOfTwoFramesInOneFileKeepTheirs) {
  const Scratch scratch;
  const std::string text = with(sample_markups("\"LPS\""), "\"Curve\", \"coordinateSystem\": \"LPS\"",
                                "\"Curve\", \"coordinateSystem\": \"RAS\"");
  const ordered_json found = ordered_json::parse(displaced(scratch, "a.mrk.json", text));
  EXPECT_EQ(found["markups"][0]["controlPoints"][0]["position"], (std::vector<double>{1.5, 0.75, 103}));
  EXPECT_EQ(found["markups"][1]["controlPoints"][1]["position"], (std::vector<double>{0.5, 23.25, 103.25}));
}

TEST(PointsFile, MarkupsWithAKeyTwiceInOneObjectAreRefused) {
  const Scratch scratch;
  const std::string good = sample_markups("\"LPS\"");
  const std::string twice = with(good, "\"Curve\", ", "\"Curve\", \"coordinateSystem\": \"RAS\", ");
  EXPECT_TRUE(says(refusal(scratch, "a.mrk.json", twice), {"the key \"coordinateSystem\" twice", "a.mrk.json"}));
}

TEST(PointsFile, StlNormalsAreThoseOfTheMovedFacets) {
  const Scratch scratch;
  write_file(scratch / "a.stl", sample_binary_stl(""));
  write_file(scratch / "t.stl", sample_text_stl(""));
  // In the plane y = 4, seen from -y: right, then up.
  const std::vector<glm::dvec3> corners = {{0, 4, 0}, {2, 4, 0}, {0, 4, 3}};
  std::string expected = sample_binary_stl("");
  expected.resize(84);
  for (const float value : {0.0f, -1.0f, 0.0f, 0.0f, 4.0f, 0.0f, 2.0f, 4.0f, 0.0f, 0.0f, 4.0f, 3.0f})
    append_value(expected, value);
  append_value(expected, std::uint16_t{0xBEEF});
  PointsFile(scratch / "a.stl").write(scratch / "b.stl", corners, std::vector(3, kMoved));
  EXPECT_EQ(read_text(scratch / "b.stl"), expected);
  PointsFile(scratch / "t.stl").write(scratch / "u.stl", corners, std::vector(3, kMoved));
  std::string text = with(sample_text_stl(""), "0 0 1", "0 -1 0");
  text = with(with(with(text, "1 2 3", "0 4 0"), "11 2.5 3", "2 4 0"), "1 22 3.25", "0 4 3");
  EXPECT_EQ(read_text(scratch / "u.stl"), text);
  // Taken as RAS, the same corners have the same normal turned by 180 degrees about z; a flat facet has none.
  write_file(scratch / "r.stl", sample_text_stl("SPACE=RAS"));
  PointsFile(scratch / "r.stl").write(scratch / "s.stl", corners, std::vector(3, kMoved));
  EXPECT_NE(read_text(scratch / "s.stl").find("normal 0 1 0\n"), std::string::npos);
  PointsFile(scratch / "t.stl").write(scratch / "u.stl", std::vector(3, glm::dvec3(5)), std::vector(3, kMoved));
  EXPECT_NE(read_text(scratch / "u.stl").find("normal 0 0 0\n"), std::string::npos);
}

TEST(PointsFile, ObjLosesItsVertexNormalsAndNothingElse) {
  const Scratch scratch;
  EXPECT_EQ(
      displaced(scratch, "a.obj", sample_obj("SPACE=LPS")),
      "# SPACE=LPS\nmtllib a.mtl\no part\nv 1.5 0.75 103\nv 11.5 1.25 103 0.5 0.25 1\nv 1.5 20.75 103.25\nvt 0 1\n"
      "usemtl bone\nf 1/1 2/1 3/1\nf 1 2 -1\nf 3 2 1\nf 1/1 3/1 2/1\nl 1 2\n");
  const PointsFile file(scratch / "a.obj");
  ASSERT_EQ(file.notes().size(), 1u);
  EXPECT_TRUE(says(file.notes()[0], {"a.obj", "vertex normals"}));
}

TEST(PointsFile, VtkLosesItsNormalsAndNothingElse) {
  const Scratch scratch;
  for (const std::string type : {"float", "double"}) {
    std::string text = sample_text_vtk("SPACE=LPS", type);
    text = with(text, "NORMALS cells float\n0 0 1\n", "");
    text = with(text, "NORMALS Normals float\n0 0 1 0 0 1\n0 0 1\nMETADATA\nINFORMATION 0\n\n", "");
    text = with(text, "1 2 3 11 2.5 3\n1 22 3.25", "1.5 0.75 103\n11.5 1.25 103\n1.5 20.75 103.25");
    EXPECT_EQ(displaced(scratch, "a.vtk", sample_text_vtk("SPACE=LPS", type)), text);
    std::string bytes = sample_binary_vtk("SPACE=LPS", type == "double"), values;
    for (const double value : {1.5, 0.75, 103.0, 11.5, 1.25, 103.0, 1.5, 20.75, 103.25}) {
      if (type == "double") {
        append_big_endian(values, value);
      } else {
        append_big_endian(values, static_cast<float>(value));
      }
    }
    bytes.replace(bytes.find(type + "\n") + type.size() + 1, values.size(), values);
    const auto normals = bytes.find("NORMALS");
    ASSERT_EQ(bytes.substr(normals + 22 + 37, 5), "FIELD");
    bytes.erase(normals, 22 + 37);
    EXPECT_EQ(displaced(scratch, "b.vtk", sample_binary_vtk("SPACE=LPS", type == "double")), bytes);
  }
  ASSERT_EQ(PointsFile(scratch / "a.vtk").notes().size(), 1u);
  EXPECT_TRUE(says(PointsFile(scratch / "a.vtk").notes()[0], {"a.vtk", "normals"}));
}

TEST(PointsFile, AFrameThatIsNotSaidIsToldAssumedOrRefused) {
  const Scratch scratch;
  const std::string markups = with(with(sample_markups("\"LPS\""), "\"coordinateSystem\": \"LPS\", ", ""),
                                   "\"coordinateSystem\": \"LPS\", ", "");
  const std::pair<std::string, std::string> kFiles[] = {
      {"a.csv", sample_csv()},        {"a.mrk.json", markups},   {"a.stl", sample_binary_stl("")},
      {"t.stl", sample_text_stl("")}, {"a.obj", sample_obj("")}, {"a.vtk", sample_text_vtk("")}};
  for (const auto& [name, bytes] : kFiles) {
    SCOPED_TRACE(name);
    write_file(scratch / name, bytes);
    const PointsFile plain(scratch / name), told(scratch / name, PointFrame::ras);
    EXPECT_EQ(plain.frame(), PointFrame::lps);
    EXPECT_EQ(told.frame(), PointFrame::ras);
    EXPECT_EQ(plain.points()[1], sample_points()[1]);
    EXPECT_EQ(told.points()[1], glm::dvec3(-11, -2.5, 3));
    EXPECT_EQ(plain.notes().size(), told.notes().size() + (name == "a.csv" ? 0 : 1));
    if (name != "a.csv") {
      EXPECT_TRUE(says(plain.notes()[0], {name, "does not say its frame", "LPS"}));
    }
  }
  const std::string fcsv = with(sample_fcsv("LPS"), "# CoordinateSystem = LPS\n", "");
  EXPECT_TRUE(says(refusal(scratch, "a.fcsv", fcsv), {"a.fcsv", ":ras"}));
  EXPECT_EQ(PointsFile(scratch / "a.fcsv", PointFrame::ras).points()[1], glm::dvec3(-11, -2.5, 3));
}

TEST(PointsFile, AFrameThatContradictsTheFileIsRefused) {
  const Scratch scratch;
  for (const PointForm& form : point_forms()) {
    EXPECT_TRUE(says(refusal(scratch, form.name, form.lps, PointFrame::ras), {form.name, "LPS", "RAS"}));
    EXPECT_TRUE(says(refusal(scratch, form.name, form.ras, PointFrame::lps), {form.name, "LPS", "RAS"}));
    EXPECT_EQ(PointsFile(scratch / form.name, PointFrame::ras).frame(), PointFrame::ras);
  }
}

TEST(PointsFile, BrokenFilesAreRefusedWithTheirPlace) {
  const Scratch scratch;
  const std::string stl = sample_text_stl(""), vtk = sample_text_vtk(""), binary = sample_binary_stl("");
  const std::string markups = sample_markups("\"LPS\""), fcsv = sample_fcsv("LPS"), obj = sample_obj("");
  std::string nan = binary;
  const float not_a_number = NAN;
  std::memcpy(nan.data() + 84 + 12 * 2, &not_a_number, 4);
  std::string nan_vtk = sample_binary_vtk("", true);
  nan_vtk.replace(nan_vtk.find("double\n") + 7 + 16, 2, "\x7F\xF8");
  const struct {
    std::string name, bytes;
    std::vector<std::string> words;
  } kCases[] = {
      {"a.csv", "", {"empty"}},
      {"a.csv", "x,y,z\n", {"no points"}},
      {"a.csv", "x;y;z\n1;2;3\n", {"no column x", "line 1"}},
      {"a.csv", "x,y,x\n1,2,3\n", {"more than one column x"}},
      {"a.csv", "x,y\n1,2\n", {"no column z"}},
      {"a.csv", "x,y,z\n1,2,3\n1,2\n", {"2 fields", "line 3", "expected 3"}},
      {"a.csv", "x,y,z\n1,2,3,4\n", {"4 fields", "line 2"}},
      {"a.csv", "x,y,z\n1,2,three\n", {"\"three\"", "line 2"}},
      {"a.csv", "x,y,z\n1,,3\n", {"\"\"", "line 2"}},
      {"a.csv", "x,y,z\n1,2,3 mm\n", {"\"3 mm\"", "line 2"}},
      {"a.csv", "x,y,z\n1,nan,3\n", {"not a finite number", "line 2"}},
      {"a.csv", "x,y,z\n1,2,1e999\n", {"not a finite number", "line 2"}},
      {"a.csv", "n,x,y,z\n\"a\nb\",1,2,3\n\"c,1,2,3\n", {"quote that does not end", "line 4"}},
      {"a.csv", "n,x,y,z\n\"a\"b,1,2,3\n", {"closing quote", "line 2"}},
      {"a.fcsv", with(fcsv, "11,2.5", "eleven,2.5"), {"\"eleven\"", "line 5"}},
      {"a.fcsv", with(fcsv, "# columns", "# colunms"), {"columns", "line 4"}},
      {"a.fcsv", with(fcsv, "LPS", "IJK"), {"IJK", "line 2"}},
      {"a.fcsv", fcsv.substr(0, fcsv.size() - 12), {"fields", "line 6"}},
      {"a.mrk.json", markups.substr(0, markups.size() / 2), {"not a JSON document", "byte"}},
      {"a.mrk.json", "[]", {"no list of markups"}},
      {"a.mrk.json", with(markups, "2.5", "\"2.5\""), {"number", "/markups/0/controlPoints/1"}},
      {"a.mrk.json", with(markups, "2.5", "NaN"), {"not a JSON document", "byte"}},
      {"a.mrk.json", with(markups, "2.5, ", ""), {"3 numbers", "/markups/0/controlPoints/1"}},
      {"a.mrk.json", with(markups, "2.5", "1e999"), {"too large"}},
      {"a.mrk.json", with(markups, "\"mm\"", "\"m\""), {"\"m\"", "/markups/0"}},
      {"a.mrk.json", sample_markups("\"IJK\""), {"IJK", "/markups/0"}},
      {"a.mrk.json", R"({"markups": [{"controlPoints": []}]})", {"no points"}},
      {"a.stl", binary.substr(0, 100), {"100 bytes", "134", "1 facets"}},
      {"a.stl", binary + "x", {"135 bytes"}},
      {"a.stl", "faces", {"5 bytes"}},
      {"a.stl", nan, {"not finite", "byte 108"}},
      {"a.stl", with(stl, "11 2.5 3", "11 inf 3"), {"not a finite number", "line 5"}},
      {"a.stl", with(stl, "11 2.5 3", "11 2.5"), {"2 coordinates", "line 5"}},
      {"a.stl", with(stl, "      vertex 11 2.5 3\n", ""), {"\"endloop\"", "line 6"}},
      {"a.stl", with(stl, "endsolid part\n", ""), {"no endsolid"}},
      {"a.stl", "solid nothing\nendsolid nothing\n", {"no points"}},
      {"a.stl", with(stl, "part", "SPACE=LPS SPACE=RAS"), {"both"}},
      {"a.stl", with(stl, "part", "SPACE=IJK"), {"SPACE=IJK", "expected LPS or RAS"}},
      {"a.obj", "# SPACE=LPI\n" + obj, {"SPACE=LPI", "expected LPS or RAS"}},
      {"a.obj", with(obj, "v 1 22 3.25", "v 1 22"), {"2 coordinates", "line 6"}},
      {"a.obj", with(obj, "v 1 22 3.25", "v 1 22 NaN"), {"not a finite number", "line 6"}},
      {"a.obj", with(obj, "v 1 22 3.25\n", ""), {"vertex 3 of 2"}},
      {"a.obj", with(obj, "f 3 2 1", "f 3 0 1"), {"\"0\"", "line 13"}},
      {"a.obj", "o nothing\n", {"no points"}},
      {"a.vtk", "solid\n", {"not a legacy VTK file"}},
      {"a.vtk", with(vtk, "POLYDATA", "STRUCTURED_GRID"), {"no polydata", "byte"}},
      {"a.vtk", with(vtk, "POINTS 3", "POINTS 4"), {"\"POLYGONS\""}},
      {"a.vtk", with(vtk, "POINTS 3", "POINTS many"), {"\"many\"", "byte"}},
      {"a.vtk", with(vtk, "double", "int"), {"INT", "float or double"}},
      {"a.vtk", with(vtk, "POINT_DATA 3", "POINT_DATA 2"), {"data of 2 points", "3"}},
      {"a.vtk", with(vtk, "ids 1 3 int", "ids 1 3 string"), {"string"}},
      {"a.vtk", with(vtk, "SCALARS", "SCALPELS"), {"SCALPELS", "byte"}},
      {"a.vtk", with(vtk, "7 8 9", "7 8"), {"2 of 3 values", "byte"}},
      {"a.vtk", nan_vtk, {"not finite", "byte"}},
      {"a.vtk", sample_binary_vtk("", false).substr(0, 110), {"bytes of 36", "byte"}},
  };
  for (const auto& test : kCases) {
    std::vector<std::string> words = test.words;
    words.push_back((scratch / test.name).string());
    EXPECT_TRUE(says(refusal(scratch, test.name, test.bytes), words)) << test.bytes;
  }
  EXPECT_TRUE(says(refusal(scratch, "a.ply", "ply\n"), {"a.ply", ".mrk.json"}));
  EXPECT_EQ(points_suffix("folder.csv/A.MRK.json"), ".mrk.json");
  EXPECT_EQ(points_suffix(".csv"), "");
  EXPECT_THROW(PointsFile(scratch / "missing.csv"), InputError);
  std::filesystem::create_directory(scratch / "folder.csv");
  EXPECT_THROW(PointsFile(scratch / "folder.csv"), InputError);
}

/// No prefix and no changed byte of a file does anything but be read or be refused.
TEST(PointsFile, DamagedFilesAreReadOrRefused) {
  const Scratch scratch;
  SCOPED_TRACE(test::seed_text(test::test_seed()));
  test::Random random(test::test_seed());
  std::vector<PointForm> forms = point_forms();
  forms.push_back({"a.csv", sample_csv(), sample_csv()});
  std::size_t refused = 0;
  const auto look = [&](const std::string& name, const std::string& bytes) {
    write_file(scratch / name, bytes);
    try {
      const PointsFile file(scratch / name);
      file.write(scratch / ("out-" + name), file.points(), std::vector(file.points().size(), kOutside));
    } catch (const InputError&) {
      ++refused;
    }
  };
  for (const PointForm& form : forms) {
    SCOPED_TRACE(form.name);
    for (std::size_t size = 0; size < form.lps.size(); ++size)
      EXPECT_NO_THROW(look(form.name, form.lps.substr(0, size)));
    for (std::uint64_t n = 0; n < test::test_cases(300); ++n) {
      std::string bytes = form.ras;
      for (std::int64_t changes = random.integer(1, 4); changes > 0; --changes) {
        const auto at = static_cast<std::size_t>(random.integer(0, static_cast<std::int64_t>(bytes.size()) - 1));
        bytes[at] = random.chance(0.5) ? static_cast<char>(random.integer(-128, 127)) : "0123456789 \n,\"/-"[at % 16];
      }
      EXPECT_NO_THROW(look(form.name, bytes));
    }
  }
  EXPECT_GT(refused, 1000u);
}

TEST(PointsFile, WhatCannotBeWrittenWholeIsAnError) {
  const Scratch scratch;
  write_file(scratch / "a.csv", sample_csv());
  const PointsFile file(scratch / "a.csv");
  EXPECT_THROW(file.write("/dev/full", file.points(), std::vector(3, kMoved)), Error);
  EXPECT_THROW(file.write(scratch / "b.csv", file.points(), std::vector(2, kMoved)), InputError);
}

}  // namespace
}  // namespace tetwarp
