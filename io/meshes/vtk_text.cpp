// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/vtk_text.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstring>
#include <map>

#include "deform/errors.h"

namespace tetwarp {
namespace {

/// Bits of a value in a binary file. @param type  in capitals  @throws InputError for a type of unknown length
std::size_t bits_of(std::string_view type, const std::string& where) {
  static const std::map<std::string, std::size_t> kBits = {
      {"BIT", 1},           {"CHAR", 8},           {"UNSIGNED_CHAR", 8},
      {"SIGNED_CHAR", 8},   {"SHORT", 16},         {"UNSIGNED_SHORT", 16},
      {"INT", 32},          {"UNSIGNED_INT", 32},  {"VTKIDTYPE", 32},
      {"FLOAT", 32},        {"LONG", 64},          {"UNSIGNED_LONG", 64},
      {"VTKTYPEINT64", 64}, {"VTKTYPEUINT64", 64}, {"DOUBLE", 64}};
  const auto found = kBits.find(upper(type));
  require(found != kBits.end(),
          "values of the type \"" + std::string(type.substr(0, 32)) + "\"" + where + "; expected numbers");
  return found->second;
}

/// Number of values in a tuple, from the word that states it.
std::size_t width_of(std::string_view text, const std::string& where) {
  const std::size_t width = count_of(text, where);
  require(width <= 65536, std::to_string(width) + " values in a tuple" + where);
  return width;
}

std::size_t components_of(const std::string& keyword, const std::string& where) {
  static const std::map<std::string, std::size_t> kComponents = {
      {"VECTORS", 3},    {"NORMALS", 3},      {"TENSORS", 9},   {"TENSORS6", 6},
      {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}, {"EDGE_FLAGS", 1}};
  const auto found = kComponents.find(keyword);
  require(found != kComponents.end(), "\"" + keyword.substr(0, 32) + "\"" + where + "; expected a part of the dataset");
  return found->second;
}

template <class Number, class Bits>
double from_big_endian(const char* bytes) {
  Bits bits = 0;
  for (std::size_t n = 0; n < sizeof bits; ++n)
    bits = static_cast<Bits>(static_cast<std::uint64_t>(bits) << 8 | static_cast<unsigned char>(bytes[n]));
  return static_cast<double>(std::bit_cast<Number>(bits));
}

}  // namespace

std::string upper(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::toupper(c); });
  return result;
}

std::string_view word_of(const std::vector<std::string_view>& words, std::size_t n, const std::string& where) {
  require(n < words.size(),
          upper(words[0].substr(0, 32)) + " of " + std::to_string(words.size() - 1) + " words" + where);
  return words[n];
}

VtkText::VtkText(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {
  require(line().starts_with("# vtk DataFile Version"), "not a legacy VTK file, " + name_);
  title = line();
  const std::string form = upper(next_words("ASCII or BINARY")[0]);
  require(form == "ASCII" || form == "BINARY", "\"" + form + "\"" + here() + "; expected ASCII or BINARY");
  binary = form == "BINARY";
  const auto words = next_words("DATASET");
  require(words.size() == 2 && upper(words[0]) == "DATASET", "no DATASET" + here() + "; expected it behind " + form);
  dataset = upper(words[1]);
}

std::string_view VtkText::line() {
  const std::size_t begin = at_, end = std::min(bytes_.find('\n', at_), bytes_.size());
  at_ = std::min(end + 1, bytes_.size());
  std::string_view text = bytes_.substr(begin, end - begin);
  if (text.ends_with('\r')) text.remove_suffix(1);
  return text;
}

bool VtkText::skip_blanks() {
  at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
  return at_ < bytes_.size();
}

std::vector<std::string_view> VtkText::words() {
  const std::string where = here();
  const std::string_view text = line();
  const bool is_text = std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' && c != '\t'; });
  require(is_text, "bytes that are no text where a keyword is expected" + where);
  return words_of(text);
}

std::vector<std::string_view> VtkText::next_words(const char* what) {
  require(skip_blanks(), std::string("ends where ") + what + " is expected" + here() + "; is the file whole?");
  return words();
}

bool VtkText::next_is(const char* keyword) {
  return skip_blanks() && upper(bytes_.substr(at_, std::strlen(keyword))) == keyword;
}

VtkValues VtkText::skip_values(std::uint64_t count, std::string_view type, const std::string& where) {
  const std::size_t bits = bits_of(type, where);
  VtkValues values{{at_, at_}, upper(type), count};
  if (binary) {
    values.span.end += (count * bits + 7) / 8;
    require(values.span.end <= bytes_.size(), std::to_string(bytes_.size() - at_) + " bytes of " +
                                                  std::to_string(values.span.end - at_) + " left for the values" +
                                                  here() + "; is the file whole?");
    at_ = values.span.end;
    return values;
  }
  for (std::uint64_t n = 0; n < count; ++n) {
    if (!skip_blanks()) {
      throw InputError(std::to_string(n) + " of " + std::to_string(count) + " values" + where + "; is the file whole?");
    }
    if (n == 0) values.span.begin = at_;
    at_ = std::min(bytes_.find_first_of(" \t\r\n", at_), bytes_.size());
  }
  values.span.end = at_;
  return values;
}

std::vector<VtkValues> VtkText::skip_cells(std::uint64_t first, std::uint64_t second, const std::string& where) {
  // In a binary file of version 4 the numbers begin right here, so nothing may be skipped.
  if (!bytes_.substr(at_).starts_with("OFFSETS ")) return {skip_values(second, "int", where)};
  std::vector<VtkValues> lists;
  // First the offsets, then the connectivity, each behind its keyword and type.
  for (const std::uint64_t count : {first, second}) {
    const auto words = next_words("OFFSETS or CONNECTIVITY");
    require(words.size() == 2, "no type of OFFSETS or CONNECTIVITY" + here());
    lists.push_back(skip_values(count, words[1], here()));
  }
  return lists;
}

void VtkText::skip_metadata() {
  while (at_ < bytes_.size() && !words_of(line()).empty()) continue;
}

std::vector<VtkTextArray> VtkText::skip_field(std::size_t count) {
  std::vector<VtkTextArray> arrays;
  for (std::size_t n = 0; n < count; ++n) {
    while (next_is("METADATA")) {
      line();
      skip_metadata();
    }
    const auto words = next_words("an array of a field");
    const std::string where = here();
    require(words.size() == 4, "an array of a field without name, components, tuples and type" + where);
    const std::size_t components = width_of(words[1], where), tuples = count_of(words[2], where);
    arrays.push_back({words[0], components, tuples, skip_values(components * tuples, words[3], where)});
  }
  return arrays;
}

std::vector<VtkTextArray> VtkText::skip_data(const std::vector<std::string_view>& words, std::size_t tuples,
                                             const std::string& where) {
  const std::string keyword = upper(words[0]);
  const auto word = [&](std::size_t n) { return word_of(words, n, where); };
  if (keyword == "LOOKUP_TABLE") {
    skip_values(4 * count_of(word(2), where), "unsigned_char", where);
    return {};
  }
  std::string_view type = "unsigned_char";
  std::size_t components = 1;
  if (keyword == "SCALARS") {
    type = word(2);
    components = words.size() > 3 ? width_of(words[3], where) : 1;
    require(next_is("LOOKUP_TABLE"), "SCALARS without LOOKUP_TABLE" + where);
    line();
  } else if (keyword == "COLOR_SCALARS") {
    components = width_of(word(2), where);
  } else if (keyword == "TEXTURE_COORDINATES") {
    components = width_of(word(2), where);
    type = word(3);
  } else {
    components = components_of(keyword, where);
    type = word(2);
  }
  return {{word(1), components, tuples, skip_values(tuples * components, type, where)}};
}

VtkDecoder big_endian_decoder(const std::string& type, const std::string& where) {
  static const std::map<std::string, VtkDecoder> kDecoders = {
      {"CHAR", from_big_endian<std::int8_t, std::uint8_t>},
      {"SIGNED_CHAR", from_big_endian<std::int8_t, std::uint8_t>},
      {"UNSIGNED_CHAR", from_big_endian<std::uint8_t, std::uint8_t>},
      {"SHORT", from_big_endian<std::int16_t, std::uint16_t>},
      {"UNSIGNED_SHORT", from_big_endian<std::uint16_t, std::uint16_t>},
      {"INT", from_big_endian<std::int32_t, std::uint32_t>},
      {"VTKIDTYPE", from_big_endian<std::int32_t, std::uint32_t>},
      {"UNSIGNED_INT", from_big_endian<std::uint32_t, std::uint32_t>},
      {"LONG", from_big_endian<std::int64_t, std::uint64_t>},
      {"VTKTYPEINT64", from_big_endian<std::int64_t, std::uint64_t>},
      {"UNSIGNED_LONG", from_big_endian<std::uint64_t, std::uint64_t>},
      {"VTKTYPEUINT64", from_big_endian<std::uint64_t, std::uint64_t>},
      {"FLOAT", from_big_endian<float, std::uint32_t>},
      {"DOUBLE", from_big_endian<double, std::uint64_t>}};
  const auto found = kDecoders.find(type);
  require(found != kDecoders.end(), "values of the type " + type + where + "; expected numbers");
  return found->second;
}

std::size_t value_bytes(const std::string& type, const std::string& where) {
  const std::size_t bits = bits_of(type, where);
  require(bits % 8 == 0, "values of the type " + type + where + "; expected numbers");
  return bits / 8;
}

}  // namespace tetwarp
