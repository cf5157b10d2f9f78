// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/parameter_file.h"

#include <toml++/toml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "deform/errors.h"
#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {
namespace {

bool has_toml_suffix(const std::filesystem::path& path) {
  const std::string suffix = path.extension().string();
  return suffix == ".toml" || suffix == ".TOML";
}

/// A line without its comment, which begins with `//` outside quotes.
std::string_view content_of(std::string_view line) {
  bool quoted = false;
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] == '"') quoted = !quoted;
    if (!quoted && line.substr(at).starts_with("//")) return trimmed(line.substr(0, at));
  }
  return trimmed(line);
}

/// The numbers of an array of TOML; none where it has anything else.
std::optional<std::vector<double>> numbers_of(const toml::array& array) {
  std::vector<double> numbers;
  numbers.reserve(array.size());
  for (const toml::node& node : array) {
    const auto number = node.value<double>();  // none also of a whole number that no double is
    if (!node.is_number() || !number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// What stands in messages for a node that no reader of transforms takes: "an array", "a table". toml++ could write the
/// node, but converts what it cannot on the way: the logarithm of a number below 1 to a size.
std::string text_of(const toml::node& node) {
  std::ostringstream text;
  text << (node.is_array() ? "an " : "a ") << node.type();
  return text.str();
}

constexpr std::string_view kHexDigits = "0123456789ABCDEF";

/// A text in which `~` and two hexadecimal digits stand for each byte beyond ASCII, and for `~` itself. toml++ 3.3 has
/// no defined behaviour where it looks for blanks among characters beyond ASCII, so it is given none; lines stay as
/// they are.
std::string ascii_of(std::string_view text) {
  std::string ascii;
  ascii.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80 && c != '~') {
      ascii += c;
    } else {
      ascii += {'~', kHexDigits[byte >> 4], kHexDigits[byte & 15]};
    }
  }
  return ascii;
}

/// The text of which `ascii` was made.
std::string text_of_ascii(std::string_view ascii) {
  std::string text;
  text.reserve(ascii.size());
  for (std::size_t at = 0; at < ascii.size(); ++at) {
    if (ascii[at] == '~' && at + 2 < ascii.size()) {
      text += static_cast<char>(16 * kHexDigits.find(ascii[at + 1]) + kHexDigits.find(ascii[at + 2]));
      at += 2;
    } else {
      text += ascii[at];
    }
  }
  return text;
}

/// Whether a text has the escape of TOML for `~`, which would be taken for one of `ascii_of`.
bool escapes_a_tilde(std::string_view text) {
  for (const std::string_view escape : {"\\u007e", "\\u007E", "\\U0000007e", "\\U0000007E"})
    if (text.find(escape) != std::string_view::npos) return true;
  return false;
}

}  // namespace

bool is_elastix_file(const std::filesystem::path& path) {
  if (has_toml_suffix(path)) return true;
  std::ifstream stream(path, std::ios::binary);
  for (std::string line; std::getline(stream, line);) {
    if (const std::string_view text = content_of(line); !text.empty()) return text.front() == '(';
  }
  return false;
}

ParameterFile::ParameterFile(const std::filesystem::path& path) : file_(path.string()) {
  has_toml_suffix(path) ? read_toml(path) : read_text(path);
}

void ParameterFile::read_text(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::int64_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::string_view text = content_of(line);
    if (text.empty()) continue;
    const std::string where = "line " + std::to_string(number) + " of " + file_;
    require(text.front() == '(' && text.back() == ')',
            "no (Key value ...) in " + where + "; the file may be truncated");
    const std::string_view inner = trimmed(text.substr(1, text.size() - 2));
    const auto end = std::min(inner.find_first_of(kBlank), inner.size());
    const bool added =
        values_.emplace(std::string(inner.substr(0, end)), Value{std::string(trimmed(inner.substr(end)))}).second;
    require(added, "the key " + std::string(inner.substr(0, end).substr(0, 60)) + " a second time in " + where);
  }
}

void ParameterFile::read_toml(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  require(!escapes_a_tilde(bytes), "an escaped ~ in " + file_);
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  const std::string_view all(bytes);
  toml::table table;
  try {
    table = toml::parse(ascii_of(all.substr(all.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0)), file_);
  } catch (const toml::parse_error& error) {
    throw InputError("line " + std::to_string(error.source().begin.line) + " of " + file_ +
                     " is no TOML: " + std::string(error.description()) + "; the file may be truncated");
  }
  for (const auto& [key, node] : table) {
    Value value;
    if (const auto* array = node.as_array()) {
      value.numbers = numbers_of(*array);
      if (!value.numbers) value.text = text_of(node);
    } else if (const auto number = node.value<double>(); node.is_number() && number) {
      value.numbers = std::vector<double>{*number};
      value.text = node.is_integer() ? std::to_string(*node.value<std::int64_t>()) : std::to_string(*number);
    } else if (const auto* boolean = node.as_boolean()) {
      value.text = boolean->get() ? "true" : "false";
    } else if (const auto* text = node.as_string()) {
      value.text = '"' + text_of_ascii(text->get()) + '"';
    } else {
      value.text = text_of(node);
    }
    values_.emplace(text_of_ascii(key.str()), std::move(value));
  }
}

std::string ParameterFile::word(const std::string& key, const std::string& missing) const {
  const auto found = values_.find(key);
  if (found == values_.end()) return missing;
  std::string text = found->second.text;
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  return text;
}

std::vector<double> ParameterFile::numbers(const std::string& key) const {
  const auto found = values_.find(key);
  require(found != values_.end(), "no " + key + " in " + file_);
  if (found->second.numbers) return *found->second.numbers;
  return parse_numbers(found->second.text, key + " in " + file_);
}

std::vector<double> ParameterFile::numbers(const std::string& key, std::size_t count) const {
  std::vector<double> values = numbers(key);
  require(values.size() == count,
          std::to_string(values.size()) + " values of " + key + " in " + file_ + "; expected " + std::to_string(count));
  return values;
}

void ParameterFile::require_word(const std::string& key, const std::string& expected) const {
  const std::string found = word(key, expected);
  require(found == expected, "(" + key + " " + found + ") in " + file_ + "; expected " + expected);
}

}  // namespace tetwarp
