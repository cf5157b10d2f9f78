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

/// How a scenario is simulated.
enum class Method : std::uint8_t {
  chainmail,   ///< links within limits (`make_cpu_chainmail`)
  mass_spring  ///< springs in equilibrium (`make_cpu_mass_spring`)
};

/// The state of a method's arithmetic: it rises whenever the same scenario gives a field of other bits.
constexpr int version_of(Method method) { return method == Method::mass_spring ? 2 : 1; }

/// A tissue and the cells that it fills: those that meet all of its conditions.
struct TissueClass {
  Tissue tissue;                     ///< its properties
  std::optional<HuRange> hu;         ///< mean HU of a cell; empty: any
  std::vector<std::int64_t> labels;  ///< labels of a cell; empty: any
};

/// Vertices that do not move in any phase.
struct HeldZone {
  Zone zone;          ///< which vertices
  std::string entry;  ///< name of the entry in messages: `hold[1] "spine"`
};

/// A grip on some tissue, as of forceps.
struct Handle {
  ScenarioPoint at;  ///< middle of the grip
  Length radius;     ///< vertices up to this far away are gripped; if there are none, the nearest vertex
};
/// A rotation about an axis through a place.
struct Rotation {
  ScenarioPoint about;  ///< a place on the axis
  glm::dvec3 axis;      ///< direction of the axis in LPS, of any length
  double degrees;       ///< angle in degrees, by the right-hand rule
};
/// A force that all moved vertices share equally.
struct Force {
  glm::dvec3 newton;  ///< total force, N, in LPS
};

/// One motion or force in a phase.
struct Move {
  std::variant<Zone, Handle> what;           ///< the vertices that are moved
  std::variant<Shift, Rotation, Force> how;  ///< what moves them
  std::string entry;                         ///< name of the entry in messages: `phases[0].move[1] "left lip"`
};

/// A plane cut before the patient is known.
struct PlaneCutPlan {
  ScenarioPoint at;   ///< a place on the plane
  glm::dvec3 normal;  ///< in LPS, of any length
};
/// A disc cut before the patient is known.
struct DiscCutPlan {
  ScenarioPoint at;   ///< centre of the disc
  glm::dvec3 normal;  ///< in LPS, of any length
  Length radius;      ///< radius of the disc
};
/// A swept cut before the patient is known.
struct SweptCutPlan {
  std::vector<ScenarioPoint> path;  ///< at least two places that the blade follows
  glm::dvec3 along;                 ///< direction in which the blade cuts, in LPS, of any length
  Length depth;                     ///< how deep it cuts
  bool is_closed = false;           ///< whether the last place is joined to the first
};
/// A cut before the patient is known.
struct CutPlan {
  std::string name;  ///< name that phases and messages use
  /// The surface.
  std::variant<PlaneCutPlan, DiscCutPlan, SweptCutPlan> shape;
};

/// A part of a scenario. From the state in which the phase before ended, moves go to their goals in `frames` equal
/// steps. Vertices that an earlier phase moved and this one does not are free again.
struct Phase {
  std::string name;                      ///< name that messages use
  std::vector<Move> moves;               ///< what is moved
  std::vector<std::string> closed_cuts;  ///< names of the cuts that are closed in this phase; all others are open
  int frames = 1;                        ///< number of steps
};

/// What is done to a patient, described so that it fits any patient.
struct Scenario {
  std::string name;                   ///< name that messages use
  Method method = Method::chainmail;  ///< how it is simulated
  std::int64_t cell_size = 8;         ///< distance of lattice vertices, voxels
  double body_above_hu = -400;        ///< cells of higher mean HU can belong to the body
  std::vector<TissueClass> tissues;   ///< a cell gets the first whose conditions it meets; the last has no condition
  std::vector<HeldZone> hold;         ///< what does not move
  std::vector<CutPlan> cuts;          ///< all cuts of the scenario
  std::vector<Phase> phases;          ///< what is done, in this order
  StoppingRule stop;                  ///< when a frame has converged
  /// Between the frames of a phase, vertices that are not farther than this from where they were shown last stay there,
  /// mm; the last frame of a phase shows all where they are.
  double deadband_mm = 0;
};

/// Number of frames of all phases.
int frame_count(const Scenario& scenario);
/// Whether a cut is open in a phase.
bool is_open(const CutPlan& cut, const Phase& phase);

/// For each cell, i fastest, the index of its tissue in `Scenario::tissues`.
/// @throws InputError for conditions on labels where the patient has no label volume
std::vector<std::uint8_t> tissue_of_cells(const Scenario& scenario, const Patient& patient);

/// The cuts that are open in a phase, in mm.
/// @throws InputError for lengths in parts of the body where the patient has no body
std::vector<Cut> open_cuts(const Scenario& scenario, const Phase& phase, const Patient& patient);

/// What a phase does to which vertices.
///
/// A held vertex is never moved. A vertex in several moves needs the same goal from each of them. Forces on a vertex
/// add up, and a move with a goal excludes them.
class PhaseLoads {
 public:
  /// @throws InputError, which names the entries, for moves that disagree or move no free vertex; for forces in
  ///         ChainMail; for a mass-spring phase in which nothing is held or moved
  PhaseLoads(const Scenario& scenario, const Phase& phase, const Patient& patient);

  /// Loads of the nodes of a model when `part` (0 to 1) of the way is done. Rotations follow their arc.
  /// @param part   0 to 1
  /// @param model  model of the phase
  /// @param start  displacement of each node when the phase began, LPS mm
  Loads at(double part, const Model& model, std::span<const glm::vec3> start) const;

  /// Whether some vertex moves along an arc; otherwise all move along straight lines.
  bool turns() const;
  /// Number of held vertices.
  std::size_t held() const { return held_; }
  /// Number of vertices with a goal.
  std::size_t moved() const { return moved_; }
  /// Number of vertices with a force and no goal.
  std::size_t with_force() const;
  /// Remarks for people, such as a hold that holds no vertex.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void hold(const Scenario& scenario, const Patient& patient);
  void place(const Phase& phase, std::size_t move, const std::vector<std::size_t>& vertices);
  void add_force(const glm::dvec3& newton, const std::vector<std::size_t>& vertices);
  std::vector<std::size_t> free_vertices(const Move& move, const Patient& patient) const;
  glm::dvec3 displacement(std::size_t move, const glm::dvec3& point, double part) const;

  /// A move of vertices, in mm.
  struct Way {
    glm::dvec3 by{0};  ///< shift, LPS mm
    /// A point on the axis of rotation, LPS mm, and the unit vector of the axis; 0: no rotation.
    glm::dvec3 about{0}, axis{0};
    double radians = 0;  ///< angle of the rotation
  };
  static constexpr std::int32_t kFree = -1, kHeld = -2;

  AffineMap vertex_point_;
  glm::i64vec3 size_;
  std::vector<Way> ways_;             ///< one for each move of the phase
  std::vector<std::int32_t> way_of_;  ///< for each vertex an index into `ways_`, or kFree or kHeld
  std::vector<glm::vec3> force_;      ///< force on each vertex, N; empty: none
  std::size_t held_ = 0, moved_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::simulate
