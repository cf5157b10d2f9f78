// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace tetwarp {

/// What the points of a contour are (PS3.3 C.8.8.6.1).
enum class ContourKind : std::uint8_t {
  point,           ///< one place
  open,            ///< a line in a plane
  open_nonplanar,  ///< a line in space
  closed,          ///< the border of an area in a plane; the last point is joined to the first
  closed_xor       ///< the same, said to be combined with the others of its plane by exclusive or
};

inline bool is_closed(ContourKind kind) { return kind == ContourKind::closed || kind == ContourKind::closed_xor; }

struct Contour {
  ContourKind kind = ContourKind::closed;
  std::vector<glm::dvec3> points;          ///< LPS mm
  std::optional<std::int64_t> slice = {};  ///< of the image that it was drawn on, if it lies in the plane of one
};

}  // namespace tetwarp
