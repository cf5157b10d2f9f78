// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/points/points_document.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/meshes/slicer_space.h"

namespace tetwarp {

namespace {

template <class Number>
std::string shortest(Number value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value + Number{0});  // -0 + 0 is 0, so no "-0" is written
  return {text, end.ptr};
}

}  // namespace

std::string to_string(PointFrame frame) { return frame == PointFrame::lps ? "LPS" : "RAS"; }

glm::dvec3 turned(const glm::dvec3& point) { return {-point.x, -point.y, point.z}; }

std::string with_outside_text(const std::string& description) {
  if (description.ends_with(kOutsideText)) return description;
  return description + (description.empty() ? "" : "; ") + kOutsideText;
}

void PointsDocument::take_space(std::string_view text, const std::string& name) {
  const std::optional<PointFrame> said = slicer_space(text, name);
  if (said) require_same_space(frame, *said, name);
  frame = said ? said : frame;
}

PointFrame frame_of(const std::string& text, const std::string& name) {
  if (text == "RAS" || text == "0") return PointFrame::ras;
  require(text == "LPS" || text == "1", "the coordinate system \"" + text + "\", " + name + "; expected LPS or RAS");
  return PointFrame::lps;
}

std::string at_line(std::size_t line, const std::string& name) {
  return " in line " + std::to_string(line) + ", " + name;
}

std::string at_byte(std::size_t byte, const std::string& name) {
  return " at byte " + std::to_string(byte) + ", " + name;
}

double number_of(std::string_view text, const std::string& where) {
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::invalid_argument || end != digits.data() + digits.size())
    throw InputError("\"" + std::string(text) + "\" where a number is expected" + where);
  if (error != std::errc{} || !std::isfinite(value))
    throw InputError("the coordinate " + std::string(text) + " is not a finite number" + where);
  return value;
}

std::size_t count_of(std::string_view text, const std::string& where) {
  const auto value = number_from<std::size_t>(text);
  require(value && *value <= std::size_t{1} << 40, "\"" + std::string(text) + "\" where a count is expected" + where);
  return *value;
}

std::string text_of(double value) { return shortest(value); }
std::string text_of(float value) { return shortest(value); }

std::string text_of(const glm::dvec3& point) {
  return text_of(point.x) + " " + text_of(point.y) + " " + text_of(point.z);
}

bool Lines::next() {
  if (next_ >= text_.size()) return false;
  begin = next_;
  const std::size_t end = text_.find('\n', begin);
  next_ = end == std::string_view::npos ? text_.size() : end + 1;
  whole = text_.substr(begin, next_ - begin);
  line = whole;
  if (line.ends_with('\n')) line.remove_suffix(1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  ++number;
  return true;
}

void Patch::replace(std::size_t begin, std::size_t end, std::string_view replacement) {
  result_.append(text_.substr(done_, begin - done_)).append(replacement);
  done_ = end;
}

std::string Patch::take() {
  result_.append(text_.substr(done_));
  return std::move(result_);
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr const char* kBlank = " \t\r\n";
  for (auto begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kBlank, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlank, end);
  }
  return words;
}

}  // namespace tetwarp
