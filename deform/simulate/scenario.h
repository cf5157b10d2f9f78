// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "deform/simulate/cut.h"
#include "deform/simulate/model.h"
#include "deform/simulate/simulation.h"
#include "deform/simulate/zone.h"

namespace tetwarp::simulate {

enum class Method : std::uint8_t { chainmail, mass_spring };

/// Cells that a tissue fills: those that meet every condition which it has.
struct TissueClass {
  Tissue tissue;
  std::optional<HuRange> hu;
  std::vector<std::int64_t> labels;  ///< empty: whatever the label
};

/// Vertices of a zone stay at rest, in every phase.
struct Held {
  Zone zone;
  std::string entry;  ///< what messages call it: `hold[1] "spine"`
};

/// A hold on some tissue, as of forceps.
struct Handle {
  Place at;
  Length radius;  ///< no vertex within it: the nearest vertex is taken
};
struct Rotation {
  Place about;
  glm::dvec3 axis;  ///< LPS, any length
  double degrees;   ///< by the right hand
};
/// N, LPS, over all that is moved; each vertex takes the same share.
struct Force {
  glm::dvec3 newton;
};

struct Move {
  std::variant<Zone, Handle> what;
  std::variant<Shift, Rotation, Force> how;
  std::string entry;  ///< what messages call it: `phases[0].move[1] "left lip"`
};

struct PlaneCutPlan {
  Place at;
  glm::dvec3 normal;
};
struct DiscCutPlan {
  Place at;
  glm::dvec3 normal;
  Length radius;
};
struct SweptCutPlan {
  std::vector<Place> path;
  glm::dvec3 along;
  Length depth;
  bool is_closed = false;
};
/// A cut before the patient is known.
struct CutPlan {
  std::string name;
  std::variant<PlaneCutPlan, DiscCutPlan, SweptCutPlan> shape;
};

/// A part of a scenario: from wherever the one before led to, moves go to their goals in `frames` steps of one size.
/// What was moved before and is not moved now is let go.
struct Phase {
  std::string name;
  std::vector<Move> moves;
  std::vector<std::string> closed_cuts;  ///< names; all others are open
  int frames = 1;
};

/// What is done to a patient, whoever it is.
struct Scenario {
  std::string name;
  Method method = Method::chainmail;
  std::int64_t cell_size = 8;  ///< voxels
  double body_above_hu = -400;
  std::vector<TissueClass> tissues;  ///< the first that fits a cell is the cell's; the last has no condition
  std::vector<Held> hold;
  std::vector<CutPlan> cuts;
  std::vector<Phase> phases;
  StoppingRule stop;
};

/// Of all phases.
int frame_count(const Scenario& scenario);
bool is_open(const CutPlan& cut, const Phase& phase);

/// Tissue of each cell, as numbers of Scenario::tissues. @throws InputError for labels where there is no label volume
std::vector<std::uint8_t> tissue_of_cells(const Scenario& scenario, const Patient& patient);

/// The cuts that are open in a phase. @throws InputError for parts of a body where there is none
std::vector<Cut> open_cuts(const Scenario& scenario, const Phase& phase, const Patient& patient);

/// What a phase does to which vertices.
///
/// Hold wins: a held vertex is not moved. A vertex in several moves needs the same goal from each of them; forces on it
/// add up, and a move with a goal excludes them.
class PhaseLoads {
 public:
  /// @throws InputError naming the entries: moves that disagree or take no vertex that is free, forces in chainmail,
  /// nothing held or moved in mass-spring
  PhaseLoads(const Scenario& scenario, const Phase& phase, const Patient& patient);

  /// Loads of the nodes of a model when `part` (0 to 1) of the way is gone. Turns follow their arc.
  /// @param start  displacements of the model's nodes when the phase began
  Loads at(double part, const Model& model, std::span<const glm::vec3> start) const;

  /// Whether a vertex goes along an arc: else its way is straight.
  bool turns() const;
  std::size_t held() const { return held_; }                        ///< vertices
  std::size_t moved() const { return moved_; }                      ///< vertices with a goal
  std::size_t pulled() const;                                       ///< vertices with a force and no goal
  const std::vector<std::string>& notes() const { return notes_; }  ///< for people: holds without a vertex

 private:
  void hold(const Scenario& scenario, const Patient& patient);
  void place(const Phase& phase, std::size_t move, const std::vector<std::size_t>& vertices);
  void pull(const glm::dvec3& newton, const std::vector<std::size_t>& vertices);
  std::vector<std::size_t> free_vertices(const Move& move, const Patient& patient) const;
  glm::dvec3 displacement(std::size_t move, const glm::dvec3& point, double part) const;

  /// A move in mm.
  struct Way {
    glm::dvec3 by{0};
    glm::dvec3 about{0}, axis{0};  ///< axis: unit length; null: no turn
    double radians = 0;
  };
  static constexpr std::int32_t kFree = -1, kHeld = -2;

  AffineMap vertex_point_;
  glm::i64vec3 size_;
  std::vector<Way> ways_;             ///< of the phase's moves
  std::vector<std::int32_t> way_of_;  ///< of each vertex, or kFree or kHeld
  std::vector<glm::vec3> force_;      ///< of each vertex; empty: none
  std::size_t held_ = 0, moved_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::simulate
