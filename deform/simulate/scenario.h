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
constexpr int version_of(Method method) { return method == Method::mass_spring ? 3 : 1; }

/// A tissue and the cells that it fills: those that meet all of its conditions.
struct TissueClass {
  Tissue tissue;                     ///< its properties
  std::optional<HuRange> hu;         ///< mean HU of a cell; empty: any
  std::vector<std::int64_t> labels;  ///< labels of a cell; empty: any
};

/// Vertices that do not move: in any phase (`Scenario::hold`), or in one (`Phase::pins`).
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

/// The way of a hand that holds some tissue, frame by frame.
struct Drag {
  /// Where the tissue is after each frame of the phase, LPS mm, from where it was when the phase began.
  std::vector<glm::dvec3> by_mm;
};

/// One motion or force in a phase.
struct Move {
  std::variant<Zone, Handle> what;                 ///< the vertices that are moved
  std::variant<Shift, Rotation, Force, Drag> how;  ///< what moves them
  std::string entry;                               ///< name of the entry in messages: `phases[0].move[1] "left lip"`
  std::string name{};                              ///< its own name; may be empty
};

/// A rigid ball that the body gives way to. In each frame, vertices of the body's cells that it meets where the frame
/// before left them are placed on its surface, along the line from its centre; those that it only touches, up to a
/// hundredth of its radius away, stay in place. All others are free.
struct Push {
  double radius_mm = 0;           ///< radius, mm
  std::vector<glm::dvec3> at_mm;  ///< centre in each frame of the phase, LPS mm
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
/// steps, or where a drag takes them. Vertices that an earlier phase moved and this one does not are free again.
struct Phase {
  std::string name;                      ///< name that messages use
  std::vector<Move> moves;               ///< what is moved
  std::vector<HeldZone> pins{};          ///< what stays where it was when the phase began
  std::optional<Push> push{};            ///< a ball that tissue gives way to
  std::vector<std::string> closed_cuts;  ///< names of the cuts that are closed in this phase; all others are open
  int frames = 1;                        ///< number of steps
};

/// What is done to a patient, described so that it fits any patient.
struct Scenario {
  std::string name;                   ///< name that messages use
  std::string description{};          ///< what people are told of it
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

/// How many vertices a phase does something to.
struct PhaseCounts {
  std::size_t held = 0,  ///< that never move
      pinned = 0,        ///< that stay where they were when the phase began
      moved = 0,         ///< that have a goal
      with_force = 0;    ///< that are pulled without one
};

/// What a phase does to which vertices.
///
/// A held vertex is never moved, nor is a pinned one that is not held. A vertex in several moves needs the same goal
/// from each of them. Forces on a vertex add up, and a move with a goal excludes them. A ball meets only vertices that
/// are not held, pinned or moved to a goal.
class PhaseLoads {
 public:
  /// @throws InputError, which names the entries, for moves that disagree or move no free vertex; for drags and balls
  ///         whose ways have another length than the phase has frames, and balls where there is no body; for forces in
  ///         ChainMail; for a mass-spring phase in which nothing is held, pinned or moved
  PhaseLoads(const Scenario& scenario, const Phase& phase, const Patient& patient);

  /// Loads of the nodes of a model when `part` (0 to 1) of the way is done. Rotations follow their arc, drags and balls
  /// are where the last frame up to there takes them.
  /// @param part   0 to 1
  /// @param model  model of the phase
  /// @param start  displacement of each node when the phase began, LPS mm
  /// @param now    displacement of each node after the frame before, LPS mm; read only where `pushes`
  Loads at(double part, const Model& model, std::span<const glm::vec3> start,
           std::span<const glm::vec3> now = {}) const;

  /// Gives the phase one more frame: the next place of each drag, in the order of the moves, and of the ball.
  void extend(std::span<const glm::dvec3> drags, const std::optional<glm::dvec3>& ball);

  /// Whether loads must be set anew for each frame; otherwise all vertices move along straight lines, at one speed.
  bool changes_by_frame() const;
  /// Whether a frame of such a phase has other loads than the frame before. The first frame has.
  /// @param frame  from 0
  bool changes_in(int frame) const;
  /// Whether nothing is on its way anywhere: what is held or pinned stays, and no force is new.
  bool is_still() const { return ways_.empty() && !pushes(); }
  /// Whether there is a ball, so that loads depend on where nodes are.
  bool pushes() const { return push_.has_value(); }
  /// How many vertices it does something to.
  PhaseCounts counts() const;
  /// Remarks for people, such as a hold that holds no vertex.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void hold(std::span<const HeldZone> zones, const Patient& patient, std::int32_t as);
  void check_ways(const Phase& phase) const;
  void push(int frame, const Model& model, std::span<const glm::vec3> now, Loads& loads) const;
  bool is_same_way(std::size_t move, std::size_t other, const glm::dvec3& point) const;
  /// Index of the frame that ends when so much of the way is done.
  int frame_at(double part) const;
  glm::dvec3 rest_of(std::size_t vertex) const;
  void place(const Phase& phase, std::size_t move, const std::vector<std::size_t>& vertices);
  void add_force(const glm::dvec3& newton, const std::vector<std::size_t>& vertices);
  std::vector<std::size_t> free_vertices(const Move& move, const Patient& patient) const;
  glm::dvec3 displacement(std::size_t move, const glm::dvec3& point, double part) const;

  /// A move of vertices, in mm.
  struct Way {
    glm::dvec3 by{0};  ///< shift, LPS mm
    /// A point on the axis of rotation, LPS mm, and the unit vector of the axis; 0: no rotation.
    glm::dvec3 about{0}, axis{0};
    double radians = 0;             ///< angle of the rotation
    std::vector<glm::dvec3> along;  ///< of a drag, after each frame, LPS mm
  };
  static constexpr std::int32_t kFree = -1, kHeld = -2, kPinned = -3;

  AffineMap vertex_point_;
  glm::i64vec3 size_;
  std::vector<Way> ways_;             ///< one for each move of the phase
  std::vector<std::int32_t> way_of_;  ///< for each vertex an index into `ways_`, or kFree, kHeld or kPinned
  std::vector<glm::vec3> force_;      ///< force on each vertex, N; empty: none
  std::optional<Push> push_;
  std::vector<std::uint8_t> body_;  ///< for each vertex: 1 if a ball may meet it
  int frames_ = 1;
  std::size_t held_ = 0, pinned_ = 0, moved_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::simulate
