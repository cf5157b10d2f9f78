// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what the readers of the forms of points share.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/points_file.h"
#include "io/text_span.h"

namespace tetwarp {

/// How a file that does not say its frame is read.
enum class Unsaid : std::uint8_t { lps_by_form, lps_with_note, refused };

class PointsDocument {
 public:
  virtual ~PointsDocument() = default;

  /// The file with other points, in its own frame, and their status.
  virtual std::string rewritten(std::span<const glm::dvec3> points, std::span<const PointStatus> status) const = 0;

  std::vector<glm::dvec3> points;   ///< in the file's frame
  std::optional<PointFrame> frame;  ///< as the file states it
  Unsaid unsaid = Unsaid::lps_with_note;
  std::vector<std::string> notes;  ///< on what `rewritten` does not keep

 protected:
  /// Takes the frame that Slicer writes into headers and comments of surfaces, SPACE=RAS or SPACE=LPS, where the text
  /// has it. @throws InputError where it contradicts what was said before
  void take_space(std::string_view text, const std::string& name);
};

/// Readers of one form each. @param name  of the file, for messages
std::unique_ptr<PointsDocument> parse_csv_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_fcsv_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_markups(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_stl_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_obj_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_vtk_points(std::string bytes, const std::string& name);

/// LPS to RAS and back.
glm::dvec3 turned(const glm::dvec3& point);

constexpr const char* kOutsideText = "outside the field, not moved";
/// A description with what is said of a point outside.
std::string with_outside_text(const std::string& description);

/// "LPS", "RAS", "0" (RAS) or "1" (LPS), as in Slicer's markups. @throws InputError for another
PointFrame frame_of(const std::string& text, const std::string& name);

/// " in line 12, FILE", the end of a message.
std::string at_line(std::size_t line, const std::string& name);
std::string at_byte(std::size_t byte, const std::string& name);

/// A finite number. @param where  as of `at_line`  @throws InputError
double number_of(std::string_view text, const std::string& where);
/// A whole number, 0 or more.
std::size_t count_of(std::string_view text, const std::string& where);
/// The shortest text that gives the same number again; never "-0".
std::string text_of(double value);
std::string text_of(float value);
/// `x y z` so.
std::string text_of(const glm::dvec3& point);

/// Lines of a text, one after the other, with where they begin.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// @return false at the end of the text
  bool next();

  std::string_view line;   ///< without its end
  std::string_view whole;  ///< with its end: "\n" or "\r\n"
  std::size_t number = 0;  ///< from 1
  std::size_t begin = 0;   ///< of the line, in bytes

 private:
  std::string_view text_;
  std::size_t next_ = 0;
};

/// A text with parts of it replaced, from front to back.
class Patch {
 public:
  explicit Patch(std::string_view text) : text_(text) {}
  /// Bytes from `begin` to `end` become `replacement`; not before what was replaced last.
  void replace(std::size_t begin, std::size_t end, std::string_view replacement);
  std::string take();

 private:
  std::string_view text_;
  std::size_t done_ = 0;
  std::string result_;
};

/// Words between blanks, tabs and line ends.
std::vector<std::string_view> words_of(std::string_view line);

}  // namespace tetwarp
