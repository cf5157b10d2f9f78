// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/text_values.h"

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

/// The number at the beginning of a word. @return  whether there is one
template <class V>
bool parse(std::string word, V& value) {
  if constexpr (std::is_floating_point_v<V>) {
    word = lower(word);
    const bool is_nan = word.find("nan") != std::string::npos, is_inf = word.find("inf") != std::string::npos;
    if (is_nan) value = static_cast<V>(std::bit_cast<float>(0x7fffffffu));  // teem's, of all the bits that NaN may have
    if (is_inf && !is_nan) {
      value = std::numeric_limits<V>::infinity();
      if (word.find("-inf") != std::string::npos) value = -value;
    }
    if (is_nan || is_inf) return true;
  }
  // A number of 8 or 16 bits is cut out of one of 32.
  using Parsed = std::conditional_t<(sizeof(V) < 4), std::int32_t, V>;
  Parsed parsed{};
  const std::size_t begin = word.starts_with('+') ? 1 : 0;
  const auto [end, error] = std::from_chars(word.data() + begin, word.data() + word.size(), parsed);
  if constexpr (std::is_floating_point_v<V>) {
    // Beyond all numbers of the type, or nearer to 0 than any.
    if (error == std::errc::result_out_of_range) value = static_cast<V>(std::strtod(word.c_str(), nullptr));
    if (error == std::errc::result_out_of_range) return true;
  }
  value = static_cast<V>(parsed);
  return error == std::errc();
}

int digit(int c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

bool is_blank(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace

void read_decimal_values(std::istream& stream, VoxelType type, std::span<std::byte> values, const std::string& file) {
  dispatch(type, [&](auto v) {
    using V = decltype(v);
    const std::size_t count = values.size() / sizeof(V);
    std::string word;
    for (std::size_t n = 0; n < count; ++n) {
      do {
        require(static_cast<bool>(stream >> word), [&] {
          return "unreadable voxels (" + std::to_string(n) + " of " + std::to_string(count) + " numbers), " + file +
                 "; is the file whole?";
        });
      } while (word == ",");
      word.erase(0, word.find_first_not_of(','));
      V value{};
      require(parse(word, value), [&] {
        return "unreadable voxels (\"" + shown(word.substr(0, 60)) + "\" for number " + std::to_string(n + 1) + "), " +
               file + "; is the file whole?";
      });
      std::memcpy(values.data() + n * sizeof(V), &value, sizeof(V));
    }
  });
}

void read_hexadecimal_bytes(std::istream& stream, std::span<std::byte> bytes, const std::string& file) {
  std::streambuf& text = *stream.rdbuf();
  const auto next = [&] {
    int c = text.sbumpc();
    while (is_blank(c)) c = text.sbumpc();
    return digit(c);
  };
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const int high = next(), low = high < 0 ? -1 : next();
    require(low >= 0, [&] {
      return "unreadable voxels (digits of " + std::to_string(n) + " of " + std::to_string(bytes.size()) + " bytes), " +
             file + "; is the file whole?";
    });
    bytes[n] = static_cast<std::byte>(high * 16 + low);
  }
}

}  // namespace tetwarp
