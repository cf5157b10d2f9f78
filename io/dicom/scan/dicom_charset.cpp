// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_charset.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/ofstd/ofchrenc.h>

#include <algorithm>
#include <array>
#include <optional>

#include "io/shown_text.h"

namespace tetwarp {
namespace {

constexpr char kEscape = 0x1b;

bool is_japanese(const std::string& character_set) {
  return character_set.find("IR 87") != std::string::npos || character_set.find("IR 159") != std::string::npos;
}

/// Converts text of the character sets ISO 2022 IR 6, 13, 87 and 159 (PS3.5 6.1.2.5.3, table C.12-4 of PS3.3) to
/// EUC-JP; none if it has other escape sequences. DCMTK leaves these sets to the C library, which does not know them
/// one by one but knows EUC-JP.
std::optional<std::string> euc_jp(std::string_view bytes) {
  struct Charset {
    const char* escape;
    std::size_t width;   ///< bytes of a character
    const char* before;  ///< what EUC-JP puts before each character, whose bytes have the high bit there
  };
  constexpr std::array<Charset, 5> kCharsets = {
      {{"(B", 1, ""}, {"(J", 1, ""}, {")I", 1, ""}, {"$B", 2, ""}, {"$(D", 2, "\x8f"}}};
  std::string text;
  Charset set = kCharsets[0];
  while (!bytes.empty()) {
    if (bytes.front() == kEscape) {
      bytes.remove_prefix(1);
      const auto next = std::find_if(kCharsets.begin(), kCharsets.end(),
                                     [&](const Charset& s) { return bytes.starts_with(s.escape); });
      if (next == kCharsets.end()) return std::nullopt;
      bytes.remove_prefix(std::string_view(next->escape).size());
      set = *next;
    } else if (set.width == 1 || bytes.size() < set.width) {
      if (bytes.front() < 0) text += '\x8e';  // EUC-JP marks a half-width katakana by this byte
      text += bytes.front();
      bytes.remove_prefix(1);
    } else {
      text += set.before;
      for (const char c : bytes.substr(0, set.width)) text += static_cast<char>(c | 0x80);
      bytes.remove_prefix(set.width);
    }
  }
  return text;
}

bool is_plain(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) { return c >= 0 && c != kEscape; });
}

std::optional<std::string> utf8_of(std::string_view bytes, const std::string& character_set) {
  OFString utf8;
  if (const auto japanese = is_japanese(character_set) ? euc_jp(bytes) : std::nullopt) {
    OFCharacterEncoding converter;
    const bool done = converter.selectEncoding("EUC-JP", "UTF-8").good() &&
                      converter.convertString(japanese->data(), japanese->size(), utf8).good();
    if (done) return std::string(utf8.data(), utf8.size());
  }
  DcmSpecificCharacterSet converter;
  const bool done = converter.selectCharacterSet(character_set.c_str()).good() &&
                    converter.convertString(bytes.data(), bytes.size(), utf8).good();
  return done ? std::optional(std::string(utf8.data(), utf8.size())) : std::nullopt;
}

}  // namespace

std::string shown_text(std::string_view bytes, const std::string& character_set) {
  const std::optional<std::string> utf8 = decoded_text(bytes, character_set);
  return utf8 ? shown(*utf8) : shown(bytes);
}

std::optional<std::string> decoded_text(std::string_view bytes, const std::string& character_set) {
  return is_plain(bytes) ? std::string(bytes) : utf8_of(bytes, character_set);
}

std::optional<std::string> coded_text(const std::string& utf8, const std::string& character_set) {
  if (std::all_of(utf8.begin(), utf8.end(), [](char c) { return c >= 0; })) return utf8;
  const std::string first = character_set.substr(0, character_set.find('\\'));
  DcmSpecificCharacterSet converter;
  OFString coded;
  if (first.empty() || converter.selectCharacterSet("ISO_IR 192", first.c_str()).bad()) return std::nullopt;
  if (converter.convertString(utf8.data(), utf8.size(), coded).bad()) return std::nullopt;
  return std::string(coded.data(), coded.size());
}

std::size_t length_of(std::string_view utf8) {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

}  // namespace tetwarp
