// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// NRRD in all its ways, beside ITK's reader: what it reads is read the same, and what is refused is listed.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/support/image_table.h"

namespace tetwarp {
namespace {

using Fields = std::vector<std::pair<std::string, std::string>>;

/// 2 x 3 x 4 voxels, turned, with numbers that are not round.
const Fields kFields = {{"type", "short"},
                        {"dimension", "3"},
                        {"space", "left-posterior-superior"},
                        {"sizes", "2 3 4"},
                        {"space directions", "(1.1,0.3,0) (-0.2,0.7333333333333333,0) (0,0,2.7)"},
                        {"endian", "little"},
                        {"encoding", "raw"},
                        {"space origin", "(-17.123456789,0.1,3e2)"}};
constexpr std::size_t kVoxels = 24;

/// A file with some fields otherwise, or more of them behind; without those that are "-".
std::string nrrd(const Fields& changes, const std::string& data = values_from_1<short>(kVoxels)) {
  Fields fields = kFields;
  for (const auto& [name, value] : changes) {
    const auto found = std::ranges::find(fields, name, &Fields::value_type::first);
    if (found != fields.end())
      found->second = value;
    else
      fields.emplace_back(name, value);
  }
  std::string text = "NRRD0005\n";
  for (const auto& [name, value] : fields) text += value == "-" ? "" : name + ": " + value + "\n";
  return text + "\n" + data;
}

std::string without_space(const Fields& changes) {
  Fields all = {{"space", "-"}, {"space directions", "-"}, {"space origin", "-"}};
  all.insert(all.end(), changes.begin(), changes.end());
  return nrrd(all);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string in_hex(const std::string& bytes) {
  std::ostringstream digits;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    digits << "0123456789abcdef"[byte >> 4] << "0123456789ABCDEF"[byte & 15] << (byte % 5 == 0 ? "\n" : "");
  }
  return digits.str();
}

std::string in_digits(const std::string& between, const std::string& behind = "") {
  std::string text;
  for (std::size_t n = 1; n <= kVoxels; ++n) text += std::to_string(n) + behind + (n < kVoxels ? between : "\n");
  return text;
}

class NrrdTable : public testing::Test {
 protected:
  void expect(const std::vector<ImageRow>& rows) { expect_rows(scratch_ / "x.nrrd", rows); }
  Scratch scratch_;
};

template <class V>
void add_types(std::vector<ImageRow>& rows, const Scratch& scratch, const std::vector<const char*>& names) {
  const std::string bytes = values_from_1<V>(kVoxels), reversed = values_from_1<V>(kVoxels, true);
  for (const std::string name : names) {
    rows.push_back({name, nrrd({{"type", name}}, bytes)});
    rows.push_back({name + ", big endian", nrrd({{"type", name}, {"endian", "big"}}, reversed)});
  }
  const std::string name = names[0];
  rows.push_back({name + ", gzip", nrrd({{"type", name}, {"encoding", "gzip"}}, in_gzip(scratch, bytes))});
  rows.push_back({name + ", gzip, big",
                  nrrd({{"type", name}, {"encoding", "GZ"}, {"endian", "Big"}}, in_gzip(scratch, reversed))});
  rows.push_back({name + ", hex", nrrd({{"type", name}, {"encoding", "hex"}}, in_hex(bytes))});
  rows.push_back(
      {name + ", hex, big", nrrd({{"type", name}, {"encoding", "hex"}, {"endian", "big"}}, in_hex(reversed))});
  rows.push_back({name + ", text", nrrd({{"type", name}, {"encoding", "text"}}, in_digits(" "))});
  rows.push_back({name + ", text, no order of bytes",
                  nrrd({{"type", name}, {"encoding", "txt"}, {"endian", "-"}}, in_digits("\n"))});
  rows.push_back({name + ", no order of bytes", nrrd({{"type", name}, {"endian", "-"}}, bytes),
                  sizeof(V) == 1 ? Reads::both : Reads::neither});
}

TEST_F(NrrdTable, EveryTypeInEveryEncodingIsReadAsItkReadsIt) {
  std::vector<ImageRow> rows;
  add_types<std::int8_t>(rows, scratch_, {"signed char", "int8", "int8_t", "INT8"});
  add_types<std::uint8_t>(rows, scratch_, {"uchar", "unsigned char", "uint8", "uint8_t"});
  add_types<std::int16_t>(rows, scratch_,
                          {"short", "short int", "signed short", "signed short int", "int16", "int16_t"});
  add_types<std::uint16_t>(rows, scratch_, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"});
  add_types<std::int32_t>(rows, scratch_, {"int", "signed int", "int32", "int32_t"});
  add_types<std::uint32_t>(rows, scratch_, {"uint", "unsigned int", "uint32", "uint32_t"});
  add_types<float>(rows, scratch_, {"float", "Float"});
  add_types<double>(rows, scratch_, {"double"});
  for (const char* name : {"char", "int16 ", "long", "uint12", ""})
    rows.push_back({"type " + std::string(name), nrrd({{"type", name}}), Reads::neither});
  for (const char* name : {"int64", "long long", "uint64_t", "unsigned long long int"})
    rows.push_back({name, nrrd({{"type", name}}, values_from_1<std::int64_t>(kVoxels)), Reads::neither});
  rows.push_back({"blocks", nrrd({{"type", "block"}, {"block size", "2"}}), Reads::neither});
  rows.push_back({"block size of numbers", nrrd({{"block size", "2"}}), Reads::neither});
  expect(rows);
}

TEST_F(NrrdTable, TextHexAndSkipsAreReadAsItkReadsThem) {
  const auto as = [](const char* encoding, const std::string& data, const char* type = "short") {
    return nrrd({{"encoding", encoding}, {"type", type}}, data);
  };
  const std::string hex = in_hex(values_from_1<short>(kVoxels)), raw = values_from_1<short>(kVoxels);
  const std::string gzip = in_gzip(scratch_, raw);
  const auto skip = [&](const char* encoding, const char* lines, const char* bytes, const std::string& data) {
    return nrrd({{"encoding", encoding}, {"line skip", lines}, {"byte skip", bytes}}, data);
  };
  expect({
      {"ascii", as("ASCII", in_digits(" \t\r\n"))},
      {"commas", as("ascii", in_digits(", "))},
      {"commas before", as("ascii", "," + in_digits(" ,"))},
      {"commas alone", as("ascii", in_digits(" , "))},
      {"commas without blanks", as("ascii", in_digits(",")), Reads::neither},
      {"fractions of integers", as("text", in_digits(" ", ".9"))},
      {"fractions", as("text", in_digits(" ", ".25"), "float"), Reads::both, false},
      {"signs", as("text", "+" + in_digits(" +"))},
      {"special numbers", as("text", "nan -nan NaN(0) inf -inf +INF " + in_digits(" ", "e-40"), "float"), Reads::both,
       false},
      {"special numbers in double", as("text", "nan -inf 1e999 -1e-999 " + in_digits(" "), "double"), Reads::both,
       false},
      {"float out of range", as("text", "1e50 -1e50 1e-60 " + in_digits(" "), "float"), Reads::both, false},
      {"bytes cut out of 300 and -1", as("text", "300 -1 " + in_digits(" "), "uint8"), Reads::both, false},
      {"more numbers", as("text", in_digits(" ") + "25 what else")},
      {"fewer numbers", as("text", in_digits(" ").substr(0, 60)), Reads::neither},
      {"no number", as("text", "one " + in_digits(" ")), Reads::neither},
      {"hex in upper case", as("HEX", replaced(hex, "a", "A"))},
      {"hex with blanks", as("hex", replaced(hex, "0", " \t0\r\n"))},
      {"hex with more behind", as("hex", hex + "xyz")},
      {"hex cut off", as("hex", hex.substr(0, hex.size() - 3)), Reads::neither},
      {"hex with another letter", as("hex", "g" + hex), Reads::neither},
      {"bzip2", as("bzip2", raw), Reads::neither},
      {"bz2", as("bz2", raw), Reads::neither},
      {"an unknown encoding", as("zip", raw), Reads::neither},
      {"skips of raw", skip("raw", "2", "3", "one\ntwo\nabc" + raw)},
      {"skips of raw, CRLF", skip("raw", "2", "0", "one\r\n\r\n" + raw)},
      {"from the end", skip("raw", "0", "-1", "whatever" + raw)},
      {"before the end", skip("raw", "0", "-3", "whatever" + raw + "ab"), Reads::itk},
      {"skips of gzip", skip("gzip", "1", "5", "one\n" + in_gzip(scratch_, "12345" + raw))},
      {"gzip from the end", skip("gzip", "0", "-1", gzip), Reads::itk},
      {"skips of text", skip("text", "1", "4", "one\n99 1" + in_digits(" ")), Reads::both, false},
      {"skips of hex", skip("hex", "1", "4", "one\nffff" + hex)},
      {"hex from the end", skip("hex", "0", "-1", hex), Reads::neither},
      {"more lines skipped than there are", skip("text", "99", "0", in_digits(" ")), Reads::neither},
      {"more bytes skipped than there are", skip("hex", "0", "9999", hex), Reads::neither},
      {"a skip that is none", skip("raw", "x", "0", raw), Reads::neither},
      {"bytes behind raw voxels", as("raw", raw + "x"), Reads::itk},
      {"voxels in another file", nrrd({{"data file", "z.gz"}, {"encoding", "gzip"}}, ""), Reads::itk},
  });
}

TEST_F(NrrdTable, LinesOfTheHeaderAreReadAsItkReadsThem) {
  const std::string plain = nrrd({});
  const std::string header = plain.substr(0, plain.find("\n\n") + 1), data = "\n" + values_from_1<short>(kVoxels);
  std::vector<ImageRow> rows = {
      {"comments", header + "# a comment\n#\n" + data},
      {"keys and values", header + "key:=value\nb c:=d: e\nempty:=\nkey:=again\n" + data},
      {"a key that is a field", header + "type:=int\n" + data},
      {"lines that end in CR LF", replaced(header, "\n", "\r\n") + "\r" + data},
      {"fields in capitals", replaced(replaced(header, "sizes", "SIZES"), "space o", "Space O") + data},
      {"blanks before values", replaced(header, ": ", ": \t ") + data},
      {"a line of blanks", header + "  \n" + data, Reads::neither},
      {"a line that is no field", header + "what: ever\n" + data, Reads::neither},
      {"a field without a blank", header + "content:x\n" + data, Reads::neither},
      {"no empty line", header, Reads::neither},
      {"a field twice", header + "type: short\n" + data, Reads::neither},
      {"a field twice, spelled otherwise", header + "line skip: 0\nlineskip: 0\n" + data, Reads::neither},
      {"sizes before the dimension", replaced(replaced(plain, "dimension: 3\n", ""), "endian", "dimension: 3\nendian"),
       Reads::neither},
      {"other fields", header +
                           "content: a\tb\nnumber: x\nmin: 0\nmax: x\nold min: 1\noldmax: nan\nsample units: HU\n"
                           "blocksize: 0\nlineskip: 0\nbyteskip: 0\n" +
                           data},
      {"a minimum of old that is none", header + "old min: x\n" + data, Reads::neither},
      {"an infinite minimum of old", header + "old min: inf\n" + data, Reads::neither},
  };
  for (const char* version : {"NRRD0001", "NRRD0002", "NRRD0003", "NRRD0004"})
    rows.push_back({version, replaced(plain, "NRRD0005", version)});
  for (const char* version : {"NRRD0006", "NRRD000", "NRRD00055", "NRRD0005 ", "nrrd0005"})
    rows.push_back({version, replaced(plain, "NRRD0005", version), Reads::neither});
  for (const char* field : {"type", "dimension", "sizes", "encoding"})
    rows.push_back({std::string("without ") + field, nrrd({{field, "-"}}), Reads::neither});
  for (const char* order : {"little ", "middle", ""})
    rows.push_back({std::string("endian ") + order, nrrd({{"endian", order}}), Reads::neither});
  for (const char* sizes : {"2 3", "2 3 4 1", "2 3 0", "2 3 x", "-2 3 4", "4 3 2 ", "99999999999 99999999999 4"})
    rows.push_back({std::string("sizes ") + sizes, nrrd({{"sizes", sizes}}),
                    std::string(sizes) == "4 3 2 " ? Reads::both : Reads::neither});
  rows.push_back({"whole numbers with a point", nrrd({{"dimension", "3.0"}, {"sizes", "2.0 3.0 4.0"}})});
  rows.push_back({"sizes that are not whole", nrrd({{"sizes", "2.5 3 4"}}), Reads::itk});
  for (const char* axes : {"2", "4", "0", "17", "x"})
    rows.push_back({std::string("dimension ") + axes, nrrd({{"dimension", axes}}), Reads::neither});
  expect(rows);
}

TEST_F(NrrdTable, SpacesAndDirectionsAreReadAsItkReadsThem) {
  std::vector<ImageRow> rows = {
      {"turned by a third", nrrd({{"space directions",
                                   "(0.5,0.5,0.7071067811865476) (-0.5,-0.5,0.7071067811865476) "
                                   "(0.7071067811865476,-0.7071067811865476,0)"}})},
      {"vectors without blanks between", nrrd({{"space directions", "(1,0,0)(0,2,0)(0,0,3)"}})},
      {"vectors with blanks inside", nrrd({{"space directions", "( 1 , 0,\t0) (0,2,0) (0,0,3) "}})},
      {"directions that are none", nrrd({{"space directions", "none none none"}}), Reads::itk},
      {"a direction that is unknown", nrrd({{"space directions", "(1,0,0) (nan,nan,nan) (0,0,3)"}}), Reads::itk},
      {"a direction half unknown", nrrd({{"space directions", "(1,0,0) (nan,0,0) (0,0,3)"}}), Reads::neither},
      {"an infinite direction", nrrd({{"space directions", "(1,0,0) (inf,0,0) (0,0,3)"}}), Reads::neither},
      {"no directions", nrrd({{"space directions", "-"}})},
      {"no origin", nrrd({{"space origin", "-"}})},
      {"an origin that is none", nrrd({{"space origin", "none"}})},
      {"an origin of two", nrrd({{"space origin", "(1,2)"}}), Reads::neither},
      {"an origin of four", nrrd({{"space origin", "(1,2,3,4)"}}), Reads::neither},
      {"an origin without brackets", nrrd({{"space origin", "1 2 3"}}), Reads::neither},
      {"an origin with more behind", nrrd({{"space origin", "(1,2,3) mm"}})},
      {"two directions", nrrd({{"space directions", "(1,0,0) (0,2,0)"}}), Reads::neither},
      {"four directions", nrrd({{"space directions", "(1,0,0) (0,2,0) (0,0,3) (0,0,1)"}}), Reads::neither},
      {"commas between vectors", nrrd({{"space directions", "(1,0,0),(0,2,0),(0,0,3)"}}), Reads::neither},
      {"a step of 0", nrrd({{"space directions", "(0,0,0) (0,2,0) (0,0,3)"}}), Reads::itk},
      {"units of mm", nrrd({{"space units", "\"mm\" \"mm\" \"mm\""}})},
      {"two units", nrrd({{"space units", "\"mm\" \"mm\""}}), Reads::neither},
      {"units of cm", nrrd({{"space units", "\"cm\" \"cm\" \"cm\""}}), Reads::itk},
      {"a measurement frame", nrrd({{"measurement frame", "(1,0,0) (0,1,0) (0,0,1)"}})},
      {"a measurement frame of two", nrrd({{"measurement frame", "(1,0,0) (0,1,0)"}}), Reads::neither},
      {"half a measurement frame", nrrd({{"measurement frame", "(1,0,0) none (0,0,1)"}}), Reads::neither},
      {"a spacing in a space", nrrd({{"space directions", "-"}, {"spacings", "1 2 3"}}), Reads::neither},
      {"a spacing beside a direction", nrrd({{"spacings", "1 2 3"}}), Reads::neither},
      {"a least place beside a direction", nrrd({{"axis mins", "1 2 3"}}), Reads::neither},
      {"units beside directions", nrrd({{"units", "\"mm\" \"mm\" \"mm\""}}), Reads::neither},
      {"empty units beside directions", nrrd({{"units", R"("" "" "")"}})},
      {"a space and its dimension", nrrd({{"space dimension", "3"}}), Reads::neither},
      {"directions before the space",
       replaced(replaced(nrrd({}), "space: left-posterior-superior\n", ""), "\n\n", "\nspace: LPS\n\n"),
       Reads::neither},
  };
  for (const char* space : {"LPS", "lps", "left posterior superior", "leftposteriorsuperior", "right-anterior-superior",
                            "RAS", "right anterior superior", "RightAnteriorSuperior", "scanner-xyz", "3D-right-handed",
                            "3D left handed", "3drighthanded"})
    rows.push_back({std::string("space ") + space, nrrd({{"space", space}})});
  for (const char* space : {"LPS ", "patient", "right-anterior-superior-time", "LPST", "scanner-xyzt", ""})
    rows.push_back({std::string("space ") + space, nrrd({{"space", space}}), Reads::neither});
  const auto of_dimension = [](const char* dimension) {
    return replaced(nrrd({}), "space: left-posterior-superior", std::string("space dimension: ") + dimension);
  };
  rows.push_back({"a space of 3 axes", of_dimension("3")});
  for (const char* dimension : {"2", "4", "0", "x"})
    rows.push_back({std::string("a space of axes ") + dimension, of_dimension(dimension), Reads::neither});
  expect(rows);
}

TEST_F(NrrdTable, PlacesWithoutASpaceAreReadAsItkReadsThem) {
  expect({
      {"nothing", without_space({})},
      {"spacings", without_space({{"spacings", "1.1 0.7333333333333333 2.7"}})},
      {"spacings unknown", without_space({{"spacings", "1.1 nan NaN"}})},
      {"a spacing of 0", without_space({{"spacings", "1 0 1"}}), Reads::neither},
      {"two spacings", without_space({{"spacings", "1 1"}}), Reads::neither},
      {"four spacings", without_space({{"spacings", "1 1 1 1"}}), Reads::neither},
      {"a spacing that is none", without_space({{"spacings", "1 x 1"}}), Reads::neither},
      {"spacings and least places", without_space({{"spacings", "1.1 2 3"}, {"axis mins", "-5 0.1 7"}})},
      {"least and largest places", without_space({{"axis mins", "-5 0.1 7"}, {"axis maxs", "5 3 15"}})},
      {"at nodes", without_space({{"axis mins", "-5 0.1 7"}, {"axismaxs", "5 3 15"}, {"centers", "node cell Node"}})},
      {"centers unknown",
       without_space({{"axismins", "-5 0 7"}, {"spacings", "1 1 1"}, {"centerings", "??? none cell"}})},
      {"centers that are none", without_space({{"centerings", "node cell edge"}}), Reads::neither},
      {"least places alone", without_space({{"axis mins", "-5 0.1 7"}})},
      {"the first least place unknown", without_space({{"spacings", "1 1 1"}, {"axis mins", "nan 1 2"}})},
      {"an infinite place", without_space({{"axis mins", "inf 1 2"}}), Reads::neither},
      {"thicknesses", without_space({{"thicknesses", "1 nan 0"}})},
      {"a negative thickness", without_space({{"thicknesses", "1 -1 0"}}), Reads::neither},
      {"labels", without_space({{"labels", R"("x" "a \"y\" b" "")"}})},
      {"two labels", without_space({{"labels", R"("x" "y")"}}), Reads::neither},
      {"a label without an end", without_space({{"labels", R"("x" "y" "z)"}}), Reads::neither},
      {"labels without quotes", without_space({{"labels", "x y z"}}), Reads::neither},
      {"units", without_space({{"units", R"("mm" "mm" "cm")"}})},
      {"an origin in no space", without_space({{"space origin", "(1,2,3)"}}), Reads::neither},
  });
}

/// 3 components a voxel, in an axis before others or behind them. ITK writes them first.
std::string vectors(std::size_t axis, const std::string& kind, std::size_t count = 3) {
  std::vector<std::string> sizes = {"2", "3", "4"}, steps = {"(1,0,0)", "(0,2,0)", "(0,0,3)"},
                           kinds = {"domain", "space", "???"};
  const auto put = [&](std::vector<std::string>& words, const std::string& word) {
    words.insert(words.begin() + static_cast<std::ptrdiff_t>(axis), word);
    std::string text;
    for (const std::string& each : words) text += (text.empty() ? "" : " ") + each;
    return text;
  };
  return nrrd({{"dimension", "4"},
               {"sizes", put(sizes, std::to_string(count))},
               {"space directions", put(steps, "none")},
               {"kinds", put(kinds, kind)}},
              values_from_1<short>(kVoxels * count));
}

TEST_F(NrrdTable, AxesOfComponentsAreReadAsItkReadsThem) {
  std::vector<ImageRow> rows;
  for (std::size_t axis = 0; axis < 4; ++axis)
    rows.push_back({"vectors in axis " + std::to_string(axis), vectors(axis, "vector"), Reads::both, axis == 0});
  for (const char* kind : {"list", "point", "contravariant-vector", "covariant-vector", "normal", "3-vector",
                           "3-normal", "HSV-color", "hsv", "XYZ-color", "2D-symmetric-matrix", "2D-sym-tensor"})
    rows.push_back({kind, vectors(0, kind)});
  for (const char* kind : {"4-vector", "quaternion", "2D-matrix", "2D-tensor", "2D-masked-symmetric-tensor"})
    rows.push_back({kind, vectors(0, kind, 4)});
  rows.push_back({"2-vector", vectors(0, "2-vector", 2)});
  rows.push_back({"2D-masked-matrix", vectors(0, "2D-masked-matrix", 5)});
  rows.push_back({"3D-matrix", vectors(0, "3D-matrix", 9)});
  for (const char* kind : {"stub", "scalar", "vector", "list"}) rows.push_back({kind, vectors(3, kind, 1)});
  rows.push_back({"3-gradient", vectors(0, "3-gradient"), Reads::we});
  for (const char* kind : {"RGB-color", "rgb", "3-color", "2-vector", "stub", "matrix", "time"})
    rows.push_back({kind, vectors(0, kind), Reads::neither});
  for (const char* kind : {"RGBA-color", "4-color", "3-vector"})
    rows.push_back({kind, vectors(0, kind, 4), Reads::neither});
  rows.push_back({"complex", vectors(0, "complex", 2), Reads::neither});
  rows.push_back({"3D-symmetric-matrix", vectors(0, "3D-symmetric-matrix", 6), Reads::neither});
  rows.push_back({"3D-masked-symmetric-matrix", vectors(0, "3D-masked-symmetric-matrix", 7), Reads::neither});
  rows.push_back({"3D-masked-matrix", vectors(0, "3D-masked-matrix", 10), Reads::neither});
  rows.push_back({"a fourth axis of no kind", vectors(3, "none", 1), Reads::neither});
  rows.push_back({"four kinds for three axes", nrrd({{"kinds", "domain domain domain domain"}}), Reads::neither});
  rows.push_back({"two kinds for three axes", nrrd({{"kinds", "domain domain"}}), Reads::neither});
  rows.push_back(
      {"vectors of vectors", replaced(vectors(0, "vector"), "domain space", "vector space"), Reads::neither});
  expect(rows);
}

}  // namespace
}  // namespace tetwarp
