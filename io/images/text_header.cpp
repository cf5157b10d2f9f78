// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/text_header.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <set>
#include <sstream>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 20;

/// The fields of MetaIO (metaObject.cxx, metaImage.cxx), in lower case: what is left is the user's.
const std::set<std::string>& meta_fields() {
  static const std::set<std::string> kFields = {"objecttype",
                                                "objectsubtype",
                                                "transformtype",
                                                "ndims",
                                                "name",
                                                "id",
                                                "parentid",
                                                "acquisitiondate",
                                                "color",
                                                "comment",
                                                "compresseddata",
                                                "compresseddatasize",
                                                "compressionlevel",
                                                "binarydata",
                                                "binarydatabyteordermsb",
                                                "elementbyteordermsb",
                                                "transformmatrix",
                                                "rotation",
                                                "orientation",
                                                "offset",
                                                "position",
                                                "origin",
                                                "centerofrotation",
                                                "anatomicalorientation",
                                                "distanceunits",
                                                "elementspacing",
                                                "elementsize",
                                                "dimsize",
                                                "headersize",
                                                "modality",
                                                "sequenceid",
                                                "elementmin",
                                                "elementmax",
                                                "elementnumberofchannels",
                                                "elementnbits",
                                                "elementtype",
                                                "elementtointensityfunctionslope",
                                                "elementtointensityfunctionoffset",
                                                "elementdatafile"};
  return kFields;
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\r"), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

/// Refuses what MetaIO cannot take: it copies names and values into buffers without asking for their length, counts
/// as many numbers as NDims says, and loses memory where a header is not what it expects.
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

/// Fields of NRRD, definition of the format, sections 4 to 7, each as NrrdIO takes it.
const std::set<std::string>& nrrd_fields() {
  static const std::set<std::string> kFields = {"content",
                                                "number",
                                                "type",
                                                "block size",
                                                "blocksize",
                                                "dimension",
                                                "space",
                                                "sizes",
                                                "spacings",
                                                "thicknesses",
                                                "space dimension",
                                                "axis mins",
                                                "axismins",
                                                "axis maxs",
                                                "axismaxs",
                                                "centers",
                                                "centerings",
                                                "labels",
                                                "units",
                                                "kinds",
                                                "min",
                                                "max",
                                                "old min",
                                                "oldmin",
                                                "old max",
                                                "oldmax",
                                                "endian",
                                                "encoding",
                                                "line skip",
                                                "lineskip",
                                                "byte skip",
                                                "byteskip",
                                                "sample units",
                                                "sampleunits",
                                                "data file",
                                                "datafile",
                                                "space origin",
                                                "space units",
                                                "space directions",
                                                "measurement frame"};
  return kFields;
}

/// Refuses what NrrdIO cannot take: it writes lines that it does not know into a buffer without asking for their
/// length.
void check_nrrd_field(const std::string& line, const std::string& name, const std::string& file) {
  constexpr std::size_t kLongestLine = 1000;
  require(nrrd_fields().contains(name), "a line that is no field of NRRD in the header of " + file + ", \"" +
                                            shown(line.substr(0, 60)) + "\"; expected FIELD: VALUE or KEY:=VALUE");
  require(line.size() <= kLongestLine, "a field of " + std::to_string(line.size()) + " bytes in the header of " + file +
                                           ", \"" + name + "\"; expected at most " + std::to_string(kLongestLine));
}

/// Takes one line of a header; true after the last.
bool take_line(const std::string& line, ImageFormat format, const std::string& file, TextHeader& header) {
  if (format == ImageFormat::nrrd) {
    if (trimmed(line).empty()) return true;
    if (line[0] == '#') return false;
    const auto pair = line.find(":="), field = line.find(": ");
    if (pair != std::string::npos && pair < field) {
      header.metadata[line.substr(0, pair)] = trimmed(line.substr(pair + 2));
    } else {
      const std::string name = lower(line.substr(0, std::min(field, line.size())));
      check_nrrd_field(line, field == std::string::npos ? "" : name, file);
      header.fields[name] = trimmed(line.substr(field + 2));
    }
    return false;
  }
  const auto equals = line.find('=');
  if (equals == std::string::npos) return false;
  const std::string name = trimmed(line.substr(0, equals)), value = trimmed(line.substr(equals + 1));
  if (meta_fields().contains(lower(name)))
    header.fields[lower(name)] = value;
  else
    header.metadata[name] = value;
  return lower(name) == "elementdatafile";
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
    if (format == ImageFormat::mha) check_meta_line(line, file);
    if (first && format == ImageFormat::nrrd)
      require(line.starts_with("NRRD000"), "not an NRRD file (it does not begin with NRRD000), " + file);
    else
      ended = take_line(line, format, file, header);
    first = false;
  }
  const char* name = format == ImageFormat::nrrd ? "NRRD" : "MHA";
  require(ended, std::string("a header that does not end, ") + file + "; is this a whole " + name + " file?");
  const std::string elsewhere =
      format == ImageFormat::nrrd ? header["data file"] + header["datafile"] : header["elementdatafile"];
  require(format == ImageFormat::nrrd ? elsewhere.empty() : elsewhere == "LOCAL",
          "voxels in another file (\"" + elsewhere + "\"), " + file + "; expected them after the header");
  if (format == ImageFormat::mha) {
    for (const char* field : {"ndims", "dimsize", "elementtype"})
      require(!header[field].empty(),
              std::string("no ") + field + " in the header of " + file + "; is it an MHA file?");
  }
  const std::string units = format == ImageFormat::nrrd ? header["space units"] : header["distanceunits"];
  std::istringstream words(units);
  for (std::string word; words >> word;) {
    require(word == "mm" || word == "\"mm\"" || word == "?" || word == "\"\"",
            "lengths in " + units + ", " + file + "; expected mm");
  }
  return header;
}

bool is_encoded(const TextHeader& header, ImageFormat format) {
  if (format == ImageFormat::nrrd) return header["encoding"] != "raw";
  return lower(header["compresseddata"]) == "true" || lower(header["binarydata"]) == "false";
}

bool is_big_endian(const TextHeader& header) {
  return lower(header["binarydatabyteordermsb"]) == "true" || lower(header["elementbyteordermsb"]) == "true";
}

void require_stated_sizes(const std::filesystem::path& path, const TextHeader& header) {
  const auto require_size = [&](const char* name, std::initializer_list<std::string> expected) {
    const std::string stated = header[name];
    require(stated.empty() || std::ranges::find(expected, stated) != expected.end(),
            std::string(name) + " is " + stated.substr(0, 60) + ", " + path.string() + "; the file has " +
                *expected.begin() + ", is it whole?");
  };
  require_size("headersize", {std::to_string(header.data_offset), "0", "-1"});
  if (!is_zlib(header, ImageFormat::mha)) return;
  require_size("compresseddatasize", {std::to_string(std::filesystem::file_size(path) - header.data_offset)});
}

bool is_zlib(const TextHeader& header, ImageFormat format) {
  return format == ImageFormat::mha && lower(header["compresseddata"]) == "true" &&
         lower(header["binarydata"]) != "false" && !is_big_endian(header);
}

}  // namespace tetwarp
