// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "deform/simulate/phase_player.h"
#include "view/session/snapshot.h"

/// What stands behind the viewer: it knows no HTTP, and no page.
namespace tetwarp::viewer {

/// A hand at work on a patient: it grips, pins, cuts, sutures and pushes, and tissue follows step by step. All that was
/// done is a scenario, `recorded`, that `simulate`, `deform --scenario` and `batch` repeat to the same bits, on any
/// backend. Times in it are steps, as they were done, never a clock's.
///
/// Actions take effect with the next `step`. Each of them begins a phase, of which each step is a frame. One object
/// serves one thread at a time.
class Session {
 public:
  /// Memory for the states from which `undo` goes on. Where they need more, every other one is let go of, and what lies
  /// between is played again.
  static constexpr std::size_t kMostSnapshotBytes = std::size_t{1} << 30;

  /// @param scenario  tissues, method, what is held, cuts, which are open, and how many steps a frame may take. Its
  ///                  phases are left out (see `play`), and its `deadband_mm` is taken as 0
  /// @param patient   must outlive this object
  /// @throws InputError for a scenario that does not suit the patient
  Session(simulate::Scenario scenario, const simulate::Patient& patient, simulate::MakeSimulation make,
          std::size_t most_snapshot_bytes = kMostSnapshotBytes);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Takes hold of tissue, where the hand has none yet, or of other tissue.
  /// @param at_mm      a place of the undeformed patient, LPS mm
  /// @param radius_mm  of the grip
  /// @throws InputError where there is nothing to grip, or all of it is held or pinned; nothing has changed then
  void grip(const glm::dvec3& at_mm, double radius_mm);
  /// Moves the hand. @param by_mm  LPS mm, from where it took hold
  /// @throws InputError if it holds nothing
  void move(const glm::dvec3& by_mm);
  /// Lets go.
  void release();
  /// Keeps tissue where it is from now on, beside what is kept already.
  void pin(const simulate::Zone& zone);
  /// Frees all that was pinned.
  void unpin();
  /// Makes a cut, which is open from now on. @throws InputError for a name that a cut has, or for a cut that is none
  void cut(simulate::CutPlan plan);
  /// Closes an open cut, or opens one that is closed. @throws InputError for a name that no cut has
  void suture(const std::string& name);
  void reopen(const std::string& name);
  /// Puts a ball somewhere, or moves it. @param at_mm  its centre, LPS mm
  /// @throws InputError for a patient without a body
  void ball(const glm::dvec3& at_mm, double radius_mm);
  void lift_ball();
  /// Plays phases of a scenario, frame by frame with each `step`, from where tissue is. What the hand held it holds no
  /// more; its pins and ball are not there meanwhile. Until the last frame nothing else can be done but `undo`.
  /// @throws InputError for phases that cannot be played
  void play(std::vector<simulate::Phase> phases);
  /// Whether phases are being played.
  bool plays() const { return !to_play_.empty(); }

  /// Simulates the next frame with all that was done.
  /// @throws InputError for mass-spring where nothing is held, pinned or gripped
  /// @throws Cancelled after a request to stop; all is as it was before the step then
  simulate::Convergence step(const Control& control = {});

  /// Takes back the last action, and all steps since; or does it again. @return false if there is none
  bool undo();
  bool redo();

  /// All that was done, as a scenario that repeats it. It has no phase before the first step.
  const simulate::Scenario& recorded() const { return scenario_; }
  /// Whether there is an action to take back, or one to do again.
  bool can_undo() const { return !marks_.empty(); }
  bool can_redo() const { return !undone_.empty(); }
  /// Whether the hand holds tissue.
  bool holds() const { return hand_.handle.has_value(); }
  /// Whether something was asked for that no step has done yet.
  bool is_behind() const;
  /// What is pinned, as it lay before anything was deformed.
  const std::vector<simulate::HeldZone>& pins() const { return hand_.pins; }
  /// The centre of the ball, LPS mm, and its radius, mm; empty where there is none.
  std::optional<glm::dvec4> ball_now() const;
  /// Whether a cut of `recorded` is open now.
  bool is_open(const std::string& cut) const;
  /// Number of frames that were simulated and not taken back.
  int frames() const { return simulate::frame_count(scenario_); }
  /// What is simulated: model, displacements and field.
  const simulate::PhasePlayer& player() const { return player_; }
  /// Bytes of the states from which `undo` goes on.
  std::size_t snapshot_bytes() const { return snapshot_bytes_; }

 private:
  /// What the hand does.
  struct Hand {
    std::optional<simulate::Handle> handle;
    glm::dvec3 by_mm{0};    ///< how far it has gone since it took hold
    glm::dvec3 done_mm{0};  ///< and how far tissue has followed
    std::vector<simulate::HeldZone> pins;
    std::optional<double> ball_radius_mm;
    glm::dvec3 ball_mm{0};
    std::vector<std::string> closed_cuts;
  };
  /// Where an action begins: how much there was before it, and the state in which it found the tissue.
  struct Mark {
    std::size_t phases, cuts;
    Hand hand;
    std::optional<Snapshot> state;  ///< empty where it was let go of
  };
  /// What was taken back, and the hand after it.
  struct Undone {
    std::vector<simulate::Phase> phases;
    std::vector<simulate::CutPlan> cuts;
    Hand hand;
  };

  simulate::Phase phase_of(const Hand& hand) const;
  void require_hand() const;
  void act(Hand hand, bool checks);
  void mark();
  void add_cuts(const std::vector<simulate::CutPlan>& plans);
  void drop_cuts(std::size_t keep);
  void drop_mark();
  void find_cut(const std::string& name) const;
  simulate::Convergence played_frame(const Control& control);
  simulate::Convergence first_frame(const Control& control);
  simulate::Convergence further_frame(const Control& control);
  void replay(std::size_t begin, std::size_t end);
  void go_to(std::size_t marks, std::size_t phases);
  void thin_out();

  simulate::Scenario scenario_;
  const simulate::Patient& patient_;
  simulate::PhasePlayer player_;
  Hand hand_;
  bool begins_ = true;                   ///< whether the next step begins a phase
  glm::dvec3 phase_from_mm_{0};          ///< how far tissue had followed the hand when the phase began
  std::deque<simulate::Phase> to_play_;  ///< the first one is being played
  std::size_t most_snapshot_bytes_, snapshot_bytes_ = 0;
  std::vector<Mark> marks_;
  std::vector<Undone> undone_;
};

}  // namespace tetwarp::viewer
