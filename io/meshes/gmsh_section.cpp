// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/gmsh_section.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/points/points_document.h"

namespace tetwarp {
namespace {

constexpr const char* kBlanks = " \t\r\n";

std::size_t after_blanks(std::string_view bytes, std::size_t at) {
  return std::min(bytes.find_first_not_of(kBlanks, at), bytes.size());
}

std::string_view without_end(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  return line;
}

std::string shown(std::string_view text) {
  std::string result(text.substr(0, 24));
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return "\"" + result + "\"";
}

}  // namespace

std::vector<GmshSection> gmsh_sections(std::string_view bytes, const std::string& file) {
  std::vector<GmshSection> sections;
  for (std::size_t at = after_blanks(bytes, 0); at < bytes.size(); at = after_blanks(bytes, at)) {
    const std::size_t line_end = std::min(bytes.find('\n', at), bytes.size());
    const std::string_view line = without_end(bytes.substr(at, line_end - at));
    if (sections.empty() && line != "$MeshFormat") {
      throw InputError((line == "$NOD" ? "MSH 1, " + file : shown(line) + " where $MeshFormat is expected, " + file) +
                       "; save the mesh with Gmsh as MSH 4.1");
    }
    require(line.size() > 1 && line[0] == '$', shown(line) + " where a section is expected" + at_byte(at, file));
    GmshSection section{std::string(line.substr(1)), std::min(line_end + 1, bytes.size()), 0};
    const std::string end = "$End" + section.name;
    section.end = bytes.find(end, section.begin);
    require(section.end != std::string_view::npos,
            shown(line) + at_byte(at, file) + " does not end; is the file whole?");
    at = section.end + end.size();
    sections.push_back(std::move(section));
  }
  require(!sections.empty(), "no $MeshFormat, " + file);
  return sections;
}

GmshForm gmsh_form(std::string_view bytes, const GmshSection& section, const std::string& file) {
  GmshForm form;
  GmshNumbers numbers(bytes, section, form, file);
  form.version = numbers.real();
  if (!(form.version == 4.0 || form.version == 4.1 || (form.version >= 2 && form.version < 3))) {
    throw InputError("version " + text_of(form.version) + " of MSH, " + file +
                     "; expected 4.1, 4.0 or 2: save the mesh with Gmsh as MSH 4.1");
  }
  const std::int64_t kind = numbers.text_integer(), size = numbers.text_integer();
  require(kind == 0 || kind == 1, "the file type " + std::to_string(kind) + ", " + file + "; expected 0 or 1");
  require(size == 8 || (size == 4 && form.version == 4.1),
          "the data size " + std::to_string(size) + ", " + file + "; expected 8");
  form.size_bytes = static_cast<std::size_t>(size);
  form.tags_are_sizes = form.version == 4.1;
  form.binary = kind == 1;
  if (!form.binary) return form;
  GmshSection one = section;  // a binary file has a 1 after the line
  one.begin = std::min(std::min(bytes.find('\n', section.begin), section.end - 1) + 1, section.end);
  const std::int64_t order = GmshNumbers(bytes, one, form, file).integer();
  require(order == 1 || order == 0x01000000,
          "neither byte order, " + file + "; is the file whole, and was it copied as binary?");
  form.swapped = order != 1;
  return form;
}

std::string GmshNumbers::here() const { return " in $" + name_ + at_byte(at_, file_); }

GmshNumbers GmshNumbers::in(const GmshForm& form) const {
  GmshNumbers numbers = *this;
  numbers.form_ = form;
  return numbers;
}

void GmshNumbers::refuse_end() const {
  throw InputError("$" + name_ + " ends too early" + at_byte(at_, file_) + "; is the file whole?");
}

std::string_view GmshNumbers::word() {
  at_ = after_blanks(bytes_, at_);
  if (at_ == bytes_.size()) refuse_end();
  const std::size_t begin = at_;
  at_ = std::min(bytes_.find_first_of(kBlanks, at_), bytes_.size());
  return bytes_.substr(begin, at_ - begin);
}

std::string GmshNumbers::line() {
  const std::size_t begin = at_, end = std::min(bytes_.find('\n', at_), bytes_.size());
  at_ = std::min(end + 1, bytes_.size());
  return std::string(without_end(bytes_.substr(begin, end - begin)));
}

template <class Number>
Number GmshNumbers::raw() {
  if (bytes_.size() - at_ < sizeof(Number)) refuse_end();
  char bytes[sizeof(Number)];
  std::memcpy(bytes, bytes_.data() + at_, sizeof bytes);
  if (form_.swapped) std::reverse(bytes, bytes + sizeof bytes);
  at_ += sizeof bytes;
  return std::bit_cast<Number>(bytes);
}

template <class Number>
Number GmshNumbers::parsed() {
  const std::string_view text = word();
  const auto value = number_from<Number>(text);
  if (!value) throw InputError(shown(text) + " where a number is expected" + here());
  return *value;
}

std::int64_t GmshNumbers::text_integer() { return parsed<std::int64_t>(); }

std::int64_t GmshNumbers::integer() { return form_.binary ? raw<std::int32_t>() : text_integer(); }

std::uint64_t GmshNumbers::size() {
  if (form_.binary) return form_.size_bytes == 4 ? raw<std::uint32_t>() : raw<std::uint64_t>();
  return parsed<std::uint64_t>();
}

double GmshNumbers::real() {
  if (form_.binary) return raw<double>();
  return parsed<double>();
}

std::uint64_t GmshNumbers::tag() {
  if (form_.tags_are_sizes) return size();
  const std::int64_t tag = integer();
  if (tag < 0) throw InputError("the number " + std::to_string(tag) + here() + "; expected at least 0");
  return static_cast<std::uint64_t>(tag);
}

std::size_t GmshNumbers::tag_bytes() const { return form_.tags_are_sizes ? form_.size_bytes : sizeof(std::int32_t); }

void GmshNumbers::skip_tags(std::uint64_t count) {
  require_room(count, 1, 0);
  if (form_.binary) {
    at_ += count * tag_bytes();
  } else {
    for (std::uint64_t n = 0; n < count; ++n) word();
  }
}

void GmshNumbers::require_room(std::uint64_t items, std::uint64_t tags, std::uint64_t reals) const {
  // In text each number takes a digit and a blank; the last blank may be missing.
  const std::uint64_t each = form_.binary ? tags * tag_bytes() + reals * sizeof(double) : 2 * (tags + reals);
  const std::uint64_t left = bytes_.size() - at_ + 1;
  if (each > 0 && items > left / each) {
    throw InputError(std::to_string(items) + " items in the " + std::to_string(left - 1) + " bytes left" + here() +
                     "; is the file whole?");
  }
}

void GmshNumbers::require_end() {
  at_ = after_blanks(bytes_, at_);
  require(at_ == bytes_.size(), "more than its header says" + here());
}

}  // namespace tetwarp
