// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <vector>

#include "deform/truth/subject.h"

namespace tetwarp::truth {

/// LPS mm of the marked vertices of a lattice, i fastest.
std::vector<glm::dvec3> places_of(const Geometry& lattice, const std::vector<std::uint8_t>& marked);

/// A field whose displacements may depend on the number of the vertex, too.
/// @param displacement  called once a vertex, from several threads: number (i fastest), LPS mm
VertexField on_vertices(const Geometry& lattice, const Limits& limits, const Control& control,
                        const std::function<glm::dvec3(std::size_t, const glm::dvec3&)>& displacement);

/// How far tissue goes with a breath at each height, from where the lungs lie.
///
/// It goes farthest at the diaphragm: the height of the middle one of the lowest lung vertices of all columns of the
/// lattice, weighted alike. From there the hill falls to 0 over 0.9 of the height of the lungs above it, and over as
/// much below it.
class BreathingLevels {
 public:
  /// @param subject  with the roles lung and bone
  explicit BreathingLevels(const Subject& subject);

  /// 1 at the diaphragm, 0 far from it.
  double hill_at(double z) const;
  /// 1 at the front of the body's box, 0 at its back.
  double front_at(double y) const;
  /// For each vertex whether it stays: bones and the table.
  const std::vector<std::uint8_t>& held() const { return held_; }

 private:
  double diaphragm_ = 0, reach_ = 1, front_ = 0, depth_ = 1;
  std::vector<std::uint8_t> held_;
};

}  // namespace tetwarp::truth
