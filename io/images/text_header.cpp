// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/text_header.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>

#include "deform/errors.h"
#include "io/images/header_words.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 20;

/// The fields of MetaIO (metaObject.cxx, metaImage.cxx): what is left is the user's.
constexpr std::array kMetaFields = std::to_array<std::string_view>({
    "ObjectType",
    "ObjectSubType",
    "TransformType",
    "NDims",
    "Name",
    "ID",
    "ParentID",
    "AcquisitionDate",
    "Color",
    "Comment",
    "CompressedData",
    "CompressedDataSize",
    "CompressionLevel",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "ElementByteOrderMSB",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "Offset",
    "Position",
    "Origin",
    "ImagePosition",
    "CenterOfRotation",
    "AnatomicalOrientation",
    "DistanceUnits",
    "ElementSpacing",
    "ElementSize",
    "DimSize",
    "HeaderSize",
    "Modality",
    "SequenceID",
    "ElementMin",
    "ElementMax",
    "ElementNumberOfChannels",
    "ElementNBits",
    "ElementType",
    "ElementToIntensityFunctionSlope",
    "ElementToIntensityFunctionOffset",
    "ElementDataFile",
});

/// MetaIO tells upper from lower case, and takes a field that is written otherwise for one of the user's. What would
/// change the meaning of the voxels is obeyed in any case.
constexpr std::array kMetaFieldsInAnyCase =
    std::to_array<std::string_view>({"compresseddata", "compresseddatasize", "binarydata", "binarydatabyteordermsb",
                                     "elementbyteordermsb", "headersize", "distanceunits"});

/// Refuses lines that no writer of MHA makes, and that MetaIO, which others will read the file with, cannot take: it
/// copies names and values into buffers without asking for their length, and counts as many numbers as NDims says.
void check_meta_line(const std::string& line, const std::string& file) {
  constexpr std::size_t kLongestLine = 1000, kLongestName = 200, kMostDimensions = 10;
  require(line.size() <= kLongestLine && std::min(line.find_first_of("=:"), line.size()) <= kLongestName,
          "a line of " + std::to_string(line.size()) + " bytes in the header of " + file +
              "; expected a name of at most 200, and 1000 in all");
  for (const char c : line) {
    require(static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\r',
            "a control character in the header of " + file + "; is it text?");
  }
  const auto equals = line.find_first_of("=:");
  require(equals != std::string::npos || trimmed(line).empty(),
          "a line without \"=\" in the header of " + file + ", \"" + line.substr(0, 60) + "\"; expected NAME = VALUE");
  if (equals == std::string::npos || lower(trimmed(line.substr(0, equals))) != "ndims") return;
  const std::string value = trimmed(line.substr(equals + 1));
  const bool is_number =
      !value.empty() && value.size() <= 2 && value.find_first_not_of("0123456789") == std::string::npos;
  require(is_number && std::stoul(value) <= kMostDimensions, "NDims = " + value + ", " + file + "; expected 3");
}

/// Fields of NRRD, definition of the format, sections 4 to 7, and other spellings of them, each with the name that
/// `TextHeader::fields` has.
const std::map<std::string, std::string>& nrrd_fields() {
  static const std::map<std::string, std::string> kFields = [] {
    std::map<std::string, std::string> fields = {{"blocksize", "block size"},     {"axismins", "axis mins"},
                                                 {"axismaxs", "axis maxs"},       {"centers", "centerings"},
                                                 {"oldmin", "old min"},           {"oldmax", "old max"},
                                                 {"lineskip", "line skip"},       {"byteskip", "byte skip"},
                                                 {"sampleunits", "sample units"}, {"datafile", "data file"}};
    for (const char* name : {"content",
                             "number",
                             "type",
                             "block size",
                             "dimension",
                             "space",
                             "sizes",
                             "spacings",
                             "thicknesses",
                             "axis mins",
                             "axis maxs",
                             "centerings",
                             "labels",
                             "units",
                             "kinds",
                             "min",
                             "max",
                             "old min",
                             "old max",
                             "endian",
                             "encoding",
                             "line skip",
                             "byte skip",
                             "data file",
                             "sample units",
                             "space units",
                             "space origin",
                             "space dimension",
                             "space directions",
                             "measurement frame"})
      fields.emplace(name, name);
    return fields;
  }();
  return kFields;
}

/// Fields that are about each axis, before which the number of axes comes, and fields that are about the space around,
/// before which the space comes.
constexpr std::array kNrrdFieldsOfAxes =
    std::to_array<std::string_view>({"sizes", "spacings", "thicknesses", "axis mins", "axis maxs", "centerings",
                                     "kinds", "labels", "units", "space directions"});
constexpr std::array kNrrdFieldsInSpace =
    std::to_array<std::string_view>({"space directions", "space origin", "space units", "measurement frame"});

/// @throws InputError for a line that is no field, a field that comes twice, or before one that it needs
void take_nrrd_field(const std::string& line, const std::string& file, TextHeader& header) {
  constexpr std::size_t kLongestLine = 1000;
  const auto colon = line.find(": ");
  const auto known = nrrd_fields().find(colon == std::string::npos ? "" : lower(line.substr(0, colon)));
  require(known != nrrd_fields().end(), "a line that is no field of NRRD in the header of " + file + ", \"" +
                                            shown(line.substr(0, 60)) + "\"; expected FIELD: VALUE or KEY:=VALUE");
  const std::string& name = known->second;
  require(line.size() <= kLongestLine, "a field of " + std::to_string(line.size()) + " bytes in the header of " + file +
                                           ", \"" + name + "\"; expected at most " + std::to_string(kLongestLine));
  const auto needs = [&](bool there, const char* what) {
    require(there, "unreadable header (the field \"" + name + "\" comes before " + what + "), " + file);
  };
  if (std::ranges::find(kNrrdFieldsOfAxes, name) != kNrrdFieldsOfAxes.end())
    needs(header.fields.contains("dimension"), "the dimension");
  if (std::ranges::find(kNrrdFieldsInSpace, name) != kNrrdFieldsInSpace.end())
    needs(header.fields.contains("space") || header.fields.contains("space dimension"), "the space");
  const auto value = line.find_first_not_of(" \t", colon + 1);
  const bool is_new = header.fields.emplace(name, value == std::string::npos ? "" : line.substr(value)).second;
  require(is_new, "unreadable header (the field \"" + name + "\" comes twice), " + file);
}

/// Takes one line of a header, without its end; true after the last.
bool take_nrrd_line(const std::string& line, const std::string& file, TextHeader& header) {
  if (line.empty()) return true;
  if (line[0] == '#') return false;
  const auto pair = line.find(":="), field = line.find(": ");
  if (pair != std::string::npos && pair < field)
    header.metadata[line.substr(0, pair)] = trimmed(line.substr(pair + 2));
  else
    take_nrrd_field(line, file, header);
  return false;
}

/// Takes one line of an MHA header; true after the last. A name ends at the first of "=" and ":"; of a field that comes
/// twice the last counts.
bool take_meta_line(const std::string& line, TextHeader& header) {
  const auto separator = line.find_first_of("=:");
  if (separator == std::string::npos) return false;
  const std::string name = trimmed(line.substr(0, separator)), key = lower(name);
  const auto* const known =
      std::ranges::find_if(kMetaFields, [&](std::string_view field) { return lower(std::string(field)) == key; });
  if (known != kMetaFields.end()) {
    const auto value = line.find_first_not_of("=: \t", separator);
    if (name == *known || std::ranges::find(kMetaFieldsInAnyCase, key) != kMetaFieldsInAnyCase.end())
      header.fields[key] = value == std::string::npos ? "" : trimmed(line.substr(value));
    return name == "ElementDataFile";
  }
  if (const auto equals = line.find('='); equals != std::string::npos)
    header.metadata[trimmed(line.substr(0, equals))] = trimmed(line.substr(equals + 1));
  return false;
}

void require_nrrd_version(const std::string& line, const std::string& file) {
  require(line.starts_with("NRRD000"), "not an NRRD file (it does not begin with NRRD000), " + file);
  require(line.size() == 8 && line[7] >= '1' && line[7] <= '5',
          "unreadable header (\"" + shown(line.substr(0, 60)) + "\"), " + file + "; expected NRRD0001 to NRRD0005");
}

}  // namespace

std::string TextHeader::operator[](const std::string& name) const {
  const auto found = fields.find(name);
  return found == fields.end() ? "" : found->second;
}

TextHeader read_text_header(const std::filesystem::path& path, ImageFormat format) {
  const std::string file = path.string();
  std::ifstream stream(path, std::ios::binary);
  require(stream.good(), "cannot open, " + file);
  TextHeader header;
  bool ended = false, first = true;
  for (char c; !ended && header.data_offset < kLongestHeader;) {
    std::string line;
    for (; stream.get(c) && c != '\n' && line.size() < kLongestHeader;) line += c;
    if (!stream) break;
    header.data_offset += line.size() + 1;
    if (format == ImageFormat::mha) {
      check_meta_line(line, file);
      ended = take_meta_line(line, header);
    } else {
      if (line.ends_with('\r')) line.pop_back();
      if (first)
        require_nrrd_version(line, file);
      else
        ended = take_nrrd_line(line, file, header);
      first = false;
    }
  }
  const char* name = format == ImageFormat::nrrd ? "NRRD" : "MHA";
  require(ended, std::string("a header that does not end, ") + file + "; is this a whole " + name + " file?");
  const std::string elsewhere = format == ImageFormat::nrrd ? header["data file"] : header["elementdatafile"];
  require(format == ImageFormat::nrrd ? elsewhere.empty() : elsewhere == "LOCAL",
          "voxels in another file (\"" + elsewhere + "\"), " + file + "; expected them after the header");
  if (format == ImageFormat::mha) {
    for (const char* field : {"ndims", "dimsize", "elementtype"})
      require(!header[field].empty(),
              std::string("no ") + field + " in the header of " + file + "; is it an MHA file?");
  }
  const std::string units = format == ImageFormat::nrrd ? header["space units"] : header["distanceunits"];
  for (const std::string& word : words(units)) {
    require(word == "mm" || word == "\"mm\"" || word == "?" || word == "\"\"",
            "lengths in " + units + ", " + file + "; expected mm");
  }
  return header;
}

}  // namespace tetwarp
