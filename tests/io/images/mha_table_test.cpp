// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// MHA in all its ways, beside ITK's reader: what it reads is read the same, and what is refused is listed.
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/image_table.h"

namespace tetwarp {
namespace {

using Fields = std::vector<std::pair<std::string, std::string>>;
constexpr std::size_t kVoxels = 24;

/// 2 x 3 x 4 voxels, turned, with numbers that are not round.
const Fields kFields = {{"ObjectType", "Image"},
                        {"NDims", "3"},
                        {"BinaryData", "True"},
                        {"BinaryDataByteOrderMSB", "False"},
                        {"CompressedData", "False"},
                        {"TransformMatrix", "0.6 0.8 0 -0.8 0.6 0 0 0 1"},
                        {"Offset", "-17.123456789 0.1 3e2"},
                        {"ElementSpacing", "1.1 0.7333333333333333 2.7"},
                        {"DimSize", "2 3 4"},
                        {"ElementType", "MET_SHORT"},
                        {"ElementDataFile", "LOCAL"}};

/// A file with some fields otherwise, or more of them before the last; without those that are "-".
std::string mha(const Fields& changes, const std::string& data = values_from_1<short>(kVoxels)) {
  Fields fields = kFields;
  for (const auto& [name, value] : changes) {
    const auto found = std::ranges::find(fields, name, &Fields::value_type::first);
    if (found != fields.end())
      found->second = value;
    else
      fields.emplace(fields.end() - 1, name, value);
  }
  std::string text;
  for (const auto& [name, value] : fields) text += value == "-" ? "" : name + " = " + value + "\n";
  return text + data;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string in_zlib(const std::string& bytes) {
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return packed.substr(0, size);
}

class MhaTable : public testing::Test {
 protected:
  void expect(const std::vector<ImageRow>& rows) { expect_rows(scratch_ / "x.mha", rows); }
  Scratch scratch_;
};

template <class V>
void add_types(std::vector<ImageRow>& rows, const std::vector<const char*>& names) {
  const std::string bytes = values_from_1<V>(kVoxels), packed = in_zlib(bytes);
  for (const std::string name : names) {
    rows.push_back({name, mha({{"ElementType", name}}, bytes)});
    rows.push_back({name + ", big endian",
                    mha({{"ElementType", name}, {"BinaryDataByteOrderMSB", "True"}}, values_from_1<V>(kVoxels, true))});
    rows.push_back(
        {name + ", compressed",
         mha({{"ElementType", name}, {"CompressedData", "True"}, {"CompressedDataSize", std::to_string(packed.size())}},
             packed)});
    rows.push_back({name + ", vectors",
                    mha({{"ElementType", name}, {"ElementNumberOfChannels", "3"}}, values_from_1<V>(3 * kVoxels))});
  }
}

TEST_F(MhaTable, EveryTypeIsReadAsItkReadsIt) {
  std::vector<ImageRow> rows;
  add_types<std::int8_t>(rows, {"MET_CHAR", "MET_ASCII_CHAR", "MET_CHAR_ARRAY"});
  add_types<std::uint8_t>(rows, {"MET_UCHAR", "MET_UCHAR_ARRAY"});
  add_types<std::int16_t>(rows, {"MET_SHORT", "MET_SHORT_ARRAY"});
  add_types<std::uint16_t>(rows, {"MET_USHORT", "MET_USHORT_ARRAY"});
  add_types<std::int32_t>(rows, {"MET_INT", "MET_LONG", "MET_INT_ARRAY", "MET_LONG_ARRAY"});
  add_types<std::uint32_t>(rows, {"MET_UINT", "MET_ULONG", "MET_UINT_ARRAY", "MET_ULONG_ARRAY"});
  add_types<float>(rows, {"MET_FLOAT", "MET_FLOAT_ARRAY"});
  add_types<double>(rows, {"MET_DOUBLE", "MET_DOUBLE_ARRAY"});
  for (const char* name : {"MET_LONG_LONG", "MET_ULONG_LONG", "MET_LONG_LONG_ARRAY"})
    rows.push_back({name, mha({{"ElementType", name}}, values_from_1<std::int64_t>(kVoxels)), Reads::neither});
  for (const char* name : {"MET_OTHER", "MET_NONE", "met_short", "short", ""})
    rows.push_back({std::string("type ") + name, mha({{"ElementType", name}}), Reads::neither});
  expect(rows);
}

TEST_F(MhaTable, EncodingsAndSizesAreReadAsItkReadsThem) {
  const std::string raw = values_from_1<short>(kVoxels), packed = in_zlib(raw);
  const std::string plain = mha({});
  const std::size_t header = plain.size() - raw.size() + std::string("HeaderSize = 000\n").size();
  const std::string big = values_from_1<short>(kVoxels, true), size = std::to_string(packed.size());
  expect({
      {"the order of bytes by its other name",
       mha({{"BinaryDataByteOrderMSB", "-"}, {"ElementByteOrderMSB", "True"}}, big)},
      {"no order of bytes", mha({{"BinaryDataByteOrderMSB", "-"}})},
      {"no word on compression", mha({{"CompressedData", "-"}})},
      {"compressed, of unknown size", mha({{"CompressedData", "True"}}, packed), Reads::we},
      {"compressed, of another size", mha({{"CompressedData", "True"}, {"CompressedDataSize", "7"}}, packed),
       Reads::itk},
      {"compressed, big endian",
       mha({{"CompressedData", "True"}, {"BinaryDataByteOrderMSB", "True"}, {"CompressedDataSize", size}},
           in_zlib(big)),
       Reads::itk},
      {"in digits", mha({{"BinaryData", "False"}}, "1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 "),
       Reads::itk},
      {"the size of the header", mha({{"HeaderSize", std::to_string(header)}})},
      {"the size of no header", mha({{"HeaderSize", "0"}})},
      {"a header before the end", mha({{"HeaderSize", "-1"}})},
      {"bytes behind the voxels", mha({}, raw + "x"), Reads::itk},
      {"voxels cut off", mha({}, raw.substr(1)), Reads::itk},
      {"no channels", mha({{"ElementNumberOfChannels", "0"}}), Reads::itk},
      {"one channel", mha({{"ElementNumberOfChannels", "1"}})},
      {"local", mha({{"ElementDataFile", "Local"}}), Reads::itk},
      {"voxels in another file", mha({{"ElementDataFile", "x.raw"}}), Reads::neither},
      {"a list of files", mha({{"ElementDataFile", "LIST"}}), Reads::itk},
      {"a pattern of files", mha({{"ElementDataFile", "x.%03d 1 4 1"}}), Reads::itk},
  });
}

TEST_F(MhaTable, PlacesAreReadAsItkReadsThem) {
  const auto only = [](const Fields& changes) {
    Fields all = {{"Offset", "-"}, {"TransformMatrix", "-"}, {"ElementSpacing", "-"}};
    all.insert(all.end(), changes.begin(), changes.end());
    return mha(all);
  };
  expect({
      {"as usual", mha({})},
      {"nothing", only({})},
      {"Position", only({{"Position", "1.1 2 -0"}})},
      {"Origin", only({{"Origin", "1.1 2 3"}})},
      {"ImagePosition", only({{"ImagePosition", "1.1 2 3"}})},
      {"Origin before Offset", mha({{"Position", "7 8 9"}, {"Origin", "1.1 2 3"}})},
      {"Offset before Position", mha({{"Position", "7 8 9"}})},
      {"ImagePosition before all", mha({{"Origin", "7 8 9"}, {"ImagePosition", "1 1 1"}})},
      {"Rotation", only({{"Rotation", "0 1 0 0 0 1 1 0 0"}})},
      {"Orientation", only({{"Orientation", "0 1 0 0 0 1 1 0 0"}})},
      {"Rotation before Orientation", only({{"Orientation", "0 1 0 0 0 1 1 0 0"}, {"Rotation", "0 0 1 0 1 0 1 0 0"}})},
      {"TransformMatrix before Rotation", mha({{"Rotation", "0 0 1 0 1 0 1 0 0"}})},
      {"ElementSize", only({{"ElementSize", "1.1 2 3"}})},
      {"ElementSpacing before ElementSize", mha({{"ElementSize", "1.1 2 3"}})},
      {"a center that does not count", mha({{"CenterOfRotation", "1 2 3"}, {"AnatomicalOrientation", "LPS"}})},
      {"a direction near 1", mha({{"TransformMatrix", "0.99999999999999989 0 0 0 -1.0000000000000002 0 0 -0 1"}})},
      {"mirrored", mha({{"TransformMatrix", "1 0 0 0 1 0 0 0 -1"}})},
      {"all zero", mha({{"TransformMatrix", "0 0 0 0 0 0 0 0 0"}}), Reads::itk},
      {"sheared", mha({{"TransformMatrix", "1 0 0 .3 1 0 0 0 1"}}), Reads::itk},
      {"spacing of 0", mha({{"ElementSpacing", "0 1 1"}}), Reads::itk},
      {"numbers behind those that count", mha({{"Offset", "1 2 3 4 what"}})},
      {"too few numbers", mha({{"Offset", "1 2"}}), Reads::neither},
      {"a number that is none", mha({{"Offset", "1 2 x"}}), Reads::neither},
      {"a number that is unknown", mha({{"Offset", "1 2 nan"}}), Reads::neither},
      {"an infinite number", mha({{"ElementSpacing", "1 inf 1"}}), Reads::neither},
      {"no number", mha({{"Offset", ""}}), Reads::neither},
      {"units", mha({{"DistanceUnits", "mm"}})},
      {"other units", mha({{"DistanceUnits", "cm"}}), Reads::itk},
      {"2 axes", mha({{"NDims", "2"}, {"DimSize", "2 12"}}), Reads::neither},
      {"4 axes, the last of 1",
       mha({{"NDims", "4"},
            {"DimSize", "2 3 4 1"},
            {"Offset", "-"},
            {"ElementSpacing", "-"},
            {"TransformMatrix", "-"}}),
       Reads::neither},
      {"a size that is missing", mha({{"DimSize", "2 3"}}), Reads::neither},
      {"a size of 0", mha({{"DimSize", "2 3 0"}}), Reads::itk, false},
      {"a negative size", mha({{"DimSize", "2 3 -4"}}), Reads::neither},
      {"a size that is none", mha({{"DimSize", "2 3 four"}}), Reads::neither},
      {"a size with a point", mha({{"DimSize", "2 3.0 4"}})},
      {"a size that is not whole", mha({{"DimSize", "2 3.5 4"}}), Reads::itk},
  });
}

TEST_F(MhaTable, LinesOfTheHeaderAreReadAsItkReadsThem) {
  const std::string plain = mha({}), data = values_from_1<short>(kVoxels);
  const std::string header = plain.substr(0, plain.size() - data.size());
  std::vector<ImageRow> rows = {
      {"fields of the user", mha({{"a key", "a value"}, {"b", "c = d"}})},
      {"lines that end in CR LF", replaced(header, "\n", "\r\n") + data},
      {"no blanks", replaced(header, " = ", "=") + data},
      {"more blanks", replaced(header, " = ", "  = \t") + data},
      {"colons", replaced(header, " = ", ": ") + data},
      {"empty lines", "\n \n" + header + data},
      {"a field twice: the last counts", replaced(header, "DimSize", "Offset = 7 8 9\nDimSize") + data},
      {"another object", replaced(header, "Image", "Tube") + data},
      {"no object", mha({{"ObjectType", "-"}})},
      {"a long comment", mha({{"Comment", std::string(600, 'x')}}), Reads::we},
      {"others", mha({{"Comment", "x"},
                      {"Name", "n"},
                      {"ID", "3"},
                      {"ParentID", "-1"},
                      {"Color", "1 0 0 1"},
                      {"Modality", "MET_MOD_CT"},
                      {"SequenceID", "0 1 2"},
                      {"ElementMin", "1"},
                      {"ElementMax", "24"},
                      {"ElementNBits", "16"},
                      {"ElementToIntensityFunctionSlope", "2"}})},
      {"a field in small letters is the user's", replaced(header, "Offset", "offset") + data},
      {"a line without a sign", "what\n" + plain, Reads::itk},
      {"a control character", replaced(header, "Image", "Ima\x01ge") + data, Reads::itk},
  };
  for (const char* field : {"NDims", "DimSize", "ElementType", "ElementDataFile"}) {
    rows.push_back({std::string("without ") + field, mha({{field, "-"}}), Reads::neither});
    rows.push_back({std::string("in small letters ") + field,
                    replaced(header, field, field == std::string("NDims") ? "ndims" : "x") + data, Reads::neither});
  }
  expect(rows);
}

}  // namespace
}  // namespace tetwarp
