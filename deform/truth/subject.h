// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "deform/simulate/patient.h"

/// Deformations of a patient whose truth is known, and what it takes to test a registration by them.
namespace tetwarp::truth {

/// Which labels of a label map play a role: {"lung": {2}, "bone": {3, 17}}.
using Roles = std::map<std::string, std::vector<std::int64_t>>;

/// The patient whom a deformation moves, as seen at the vertices of its lattice.
class Subject {
 public:
  /// @param patient  of `simulate::examine`; with labels where there are roles
  /// @param roles    labels by the roles that families need
  /// @param volume   grid of the CT
  /// @throws InputError for roles without labels, or a role of which the patient has no vertex
  Subject(simulate::Patient patient, Roles roles, const Geometry& volume);

  /// The lattice that is deformed.
  const Geometry& lattice() const { return patient_.lattice; }
  /// Grid of the CT.
  const Geometry& volume() const { return volume_; }
  /// Index of the last vertex on each axis that lies on a voxel: later ones lie beyond the volume, as the last cells
  /// may.
  const glm::i64vec3& last_inside() const { return last_inside_; }
  /// The patient.
  const simulate::Patient& patient() const { return patient_; }
  /// Whether labels play a role.
  bool has(const std::string& role) const { return roles_.contains(role); }
  /// The labels of a role. @pre it is had
  const std::vector<std::int64_t>& labels(const std::string& role) const { return roles_.at(role); }
  /// For each vertex, i fastest: 1 where its label plays the role, else 0. @pre it is had
  std::vector<std::uint8_t> vertices(const std::string& role) const;
  /// For each vertex: 1 where it is no corner of a cell of the body, yet of a cell with matter in it, above -900 HU:
  /// the table. It does not move.
  std::vector<std::uint8_t> table() const;

 private:
  simulate::Patient patient_;
  Roles roles_;
  Geometry volume_;
  glm::i64vec3 last_inside_{0};
};

}  // namespace tetwarp::truth
