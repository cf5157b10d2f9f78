// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace tetwarp {

/// A closed polygon: its last corner is joined to its first.
using Ring = std::vector<glm::dvec2>;

/// Area of a polygon, positive if its corners go round counterclockwise (from x to y).
double signed_area(std::span<const glm::dvec2> ring);

/// Whether a polygon contains a point, by the parity of the edges that a ray along +x crosses.
bool contains(std::span<const glm::dvec2> ring, const glm::dvec2& point);

/// Area inside an odd number of rings that do not cross each other.
double nested_area(const std::vector<Ring>& rings);

/// Leaves out corners that lie within `tolerance` of what is left (Ramer, Douglas and Peucker).
Ring simplified(const Ring& ring, double tolerance);

/// Turns rings with holes into rings without: each hole is joined to the ring around it by a channel of no width, there
/// and back along the same line ("keyhole", DICOM PS3.3 C.8.8.6.3). Readers that fill each ring alone then give the
/// right result.
/// @param rings  rings that do not cross: counterclockwise ones are borders, clockwise ones are holes
std::vector<Ring> joined_by_keyholes(std::vector<Ring> rings);

}  // namespace tetwarp
