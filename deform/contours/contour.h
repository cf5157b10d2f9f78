// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace tetwarp {

/// What the points of a contour are (Contour Geometric Type, DICOM PS3.3 C.8.8.6.1).
enum class ContourKind : std::uint8_t {
  point,           ///< one place
  open,            ///< a line in a plane
  open_nonplanar,  ///< a line in space
  closed,          ///< the border of an area in a plane; the last point is joined to the first
  closed_xor       ///< like `closed`, in a file which says that areas of one plane are combined by exclusive or
};

/// Whether the last point is joined to the first.
inline bool is_closed(ContourKind kind) { return kind == ContourKind::closed || kind == ContourKind::closed_xor; }

/// Points that describe a place, a line, or the border of an area.
struct Contour {
  ContourKind kind = ContourKind::closed;  ///< what the points are
  std::vector<glm::dvec3> points;          ///< LPS mm
  /// Index k of the image slice in whose plane it lies, if it was drawn on one.
  std::optional<std::int64_t> slice = {};
};

}  // namespace tetwarp
