// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "deform/points.h"

namespace tetwarp {

/// Coordinates of the points of a file.
enum class PointFrame : std::uint8_t {
  lps,  ///< x grows to the left, y to the back, z upwards
  ras   ///< x grows to the right, y to the front, z upwards
};
/// The word "LPS" or "RAS".
std::string to_string(PointFrame frame);

/// Private to io/: a file of points in one format, as it was parsed.
class PointsDocument;

/// Landmarks or the vertices of a surface, with everything else that their file contains
/// (docs/reference/coordinates.md, "Points").
///
/// Formats, by suffix: `.csv` (whose header has x, y, z), `.mrk.json` and `.fcsv` (3D Slicer), `.stl`, legacy `.vtk`
/// polydata (ASCII or binary), and `.obj`.
class PointsFile {
 public:
  /// Reads a whole file.
  /// @param path  the file
  /// @param told  coordinates of a file that does not state them
  /// @throws InputError, which names the file and its line or byte: damaged or of another format, a number that is not
  ///         finite, no points, lengths that are not mm, coordinates that contradict `told`, or a `.fcsv` that does not
  ///         state its coordinates
  explicit PointsFile(const std::filesystem::path& path, std::optional<PointFrame> told = {});
  /// Frees the document.
  ~PointsFile();
  /// Takes over another document.
  PointsFile(PointsFile&&) noexcept;
  /// Takes over another document.
  PointsFile& operator=(PointsFile&&) noexcept;

  /// All points, LPS mm, in the order of the file. Each corner of each facet of a `.stl` is one.
  const std::vector<glm::dvec3>& points() const { return points_; }
  /// Coordinates of the file.
  PointFrame frame() const { return frame_; }
  /// Remarks for people: what was assumed, or what `write` does not keep.
  const std::vector<std::string>& notes() const { return notes_; }

  /// Writes a file of the same format and coordinates with other points. It states which points are outside, if the
  /// format has a place for that. Numbers keep their precision: float, or double where the format has doubles or text.
  /// @param path    file to write
  /// @param points  LPS mm, as many as were read
  /// @param status  one for each point
  /// @throws Error when the file cannot be completed
  void write(const std::filesystem::path& path, std::span<const glm::dvec3> points,
             std::span<const PointStatus> status) const;

 private:
  std::unique_ptr<PointsDocument> document_;
  std::vector<glm::dvec3> points_;
  std::vector<std::string> notes_;
  PointFrame frame_ = PointFrame::lps;
};

/// The suffix of a known format in lower case, such as ".mrk.json"; empty for any other name.
std::string points_suffix(const std::filesystem::path& path);

}  // namespace tetwarp
