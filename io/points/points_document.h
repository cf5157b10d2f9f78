// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what the readers of all formats of points share.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/points_file.h"
#include "io/text_span.h"

namespace tetwarp {

/// How a file that does not state its frame is read: in LPS as its format has it, in LPS with a note, or not at all.
enum class Unsaid : std::uint8_t { lps_by_form, lps_with_note, refused };

class PointsDocument {
 public:
  virtual ~PointsDocument() = default;

  /// The file with other points, given in its own frame, and with the status of each.
  virtual std::string rewritten(std::span<const glm::dvec3> points, std::span<const PointStatus> status) const = 0;

  std::vector<glm::dvec3> points;   ///< in the file's frame
  std::optional<PointFrame> frame;  ///< the frame that the file states, if any
  Unsaid unsaid = Unsaid::lps_with_note;
  std::vector<std::string> notes;  ///< what `rewritten` does not keep

 protected:
  /// Takes the frame that Slicer writes into headers and comments of surfaces, SPACE=RAS or SPACE=LPS, if the text has
  /// it. @throws InputError where it contradicts what the file stated before
  void take_space(std::string_view text, const std::string& name);
};

/// The readers, one for each format. @param name  of the file, for messages
std::unique_ptr<PointsDocument> parse_csv_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_fcsv_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_markups(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_stl_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_obj_points(std::string bytes, const std::string& name);
std::unique_ptr<PointsDocument> parse_vtk_points(std::string bytes, const std::string& name);

/// A point of LPS in RAS, or of RAS in LPS.
glm::dvec3 turned(const glm::dvec3& point);

constexpr const char* kOutsideText = "outside the field, not moved";
/// A description of a landmark, with a remark that its point lies outside the field.
std::string with_outside_text(const std::string& description);

/// The frame that a word of Slicer's markups means: "LPS", "RAS", "0" (RAS) or "1" (LPS). @throws InputError for
/// another word
PointFrame frame_of(const std::string& text, const std::string& name);

/// The end of a message that names a line: " in line 12, FILE".
std::string at_line(std::size_t line, const std::string& name);
std::string at_byte(std::size_t byte, const std::string& name);

/// A finite number from a text. @param where  end of the message, from `at_line`  @throws InputError
double number_of(std::string_view text, const std::string& where);
/// A whole number, 0 or more, from a text. @param where  end of the message, from `at_line`  @throws InputError
std::size_t count_of(std::string_view text, const std::string& where);
/// The shortest text from which the same number is read again; never "-0".
std::string text_of(double value);
std::string text_of(float value);
/// A point as text, three numbers with a blank between them.
std::string text_of(const glm::dvec3& point);

/// Goes through the lines of a text, one after the other.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// Goes to the next line. @return false at the end of the text
  bool next();

  std::string_view line;   ///< the line without its end
  std::string_view whole;  ///< the line with its end: "\n" or "\r\n"
  std::size_t number = 0;  ///< number of the line, from 1
  std::size_t begin = 0;   ///< byte at which the line begins

 private:
  std::string_view text_;
  std::size_t next_ = 0;
};

/// Copies a text and replaces parts of it, from front to back.
class Patch {
 public:
  explicit Patch(std::string_view text) : text_(text) {}
  /// Replaces the bytes from `begin` to `end`, which must not lie before a part that was replaced earlier.
  void replace(std::size_t begin, std::size_t end, std::string_view replacement);
  std::string take();

 private:
  std::string_view text_;
  std::size_t done_ = 0;
  std::string result_;
};

/// The words of a line, which blanks, tabs and line ends separate.
std::vector<std::string_view> words_of(std::string_view line);

}  // namespace tetwarp
