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

/// Which way x and y of a file's points grow: LPS to the left and back, RAS to the right and front.
enum class PointFrame : std::uint8_t { lps, ras };
std::string to_string(PointFrame frame);  // "LPS", "RAS"

/// Private to io/: a file of points of one form, as parsed.
class PointsDocument;

/// Landmarks or the vertices of a surface, with all else that their file holds (docs/reference/coordinates.md,
/// "Points").
///
/// Forms, by suffix: `.csv` (header with x, y, z), `.mrk.json` and `.fcsv` (3D Slicer), `.stl` and legacy `.vtk`
/// polydata (ASCII or binary), `.obj`.
class PointsFile {
 public:
  /// Reads the file whole.
  /// @param told  the frame of a file that does not say
  /// @throws InputError naming the file and its line or byte: not of its form, cut off, a number that is none or not
  /// finite, no points, lengths that are not mm; a frame that contradicts `told`; a `.fcsv` without a frame
  explicit PointsFile(const std::filesystem::path& path, std::optional<PointFrame> told = {});
  ~PointsFile();
  PointsFile(PointsFile&&) noexcept;
  PointsFile& operator=(PointsFile&&) noexcept;

  /// LPS mm, in the file's order; each corner of each facet of a `.stl` is one.
  const std::vector<glm::dvec3>& points() const { return points_; }
  PointFrame frame() const { return frame_; }
  /// For people: what was assumed, or what the written file does not keep. Empty where there is nothing to say.
  const std::vector<std::string>& notes() const { return notes_; }

  /// Writes the same form in the same frame with the points moved, and says which stay outside where the form has a
  /// place for it. Numbers come back as the same float, or double where the form has doubles or text.
  /// @param points  LPS mm, and their status, as many as were read  @throws Error when it cannot be written whole
  void write(const std::filesystem::path& path, std::span<const glm::dvec3> points,
             std::span<const PointStatus> status) const;

 private:
  std::unique_ptr<PointsDocument> document_;
  std::vector<glm::dvec3> points_;
  std::vector<std::string> notes_;
  PointFrame frame_ = PointFrame::lps;
};

/// The suffix of a form that is known, in small letters (".mrk.json" for one); empty for any other name.
std::string points_suffix(const std::filesystem::path& path);

}  // namespace tetwarp
