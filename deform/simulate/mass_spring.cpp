// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/mass_spring.h"

#include <algorithm>
#include <cmath>

#include "deform/errors.h"
#include "deform/simulate/spring_engine.h"

namespace tetwarp::simulate {

namespace {

/// Local/global steps go on while each lowers the energy by this share.
constexpr double kWorthwhile = 0.2;
/// Newton's own matrix is tried below this residual; above it is indefinite more often than not.
constexpr double kNearResidual = 0.1;
/// The least share of the descent that the slope promises which a step must bring (Armijo).
constexpr double kArmijo = 1e-4;
/// Differences of energies below this share of them are rounding; then slopes decide.
constexpr double kEnergyRounding = 1e-11;
constexpr double kShortest = 1e-6, kLongest = 4;

/// Effort of ordinary steps, and of those after which a simulation may count as converged.
constexpr SolveEffort kUsual{.share = 0.1, .least = 3}, kThorough{.share = 0.1, .least = 50};
constexpr SolveEffort kFollow{.share = 0.02, .least = 10, .most = 500};

/// Chooses the matrix with which the next step is solved.
class Schedule {
 public:
  Stiffness kind(double residual) const {
    if (is_local_global_) return Stiffness::laplacian;
    return residual < kNearResidual && wait_ == 0 ? Stiffness::full : Stiffness::projected;
  }
  /// Takes note that Newton's matrix was indefinite: it is not tried for some steps, more each time.
  void refuse_full() {
    pause_ = std::min(2 * pause_ + 1, 7);
    wait_ = pause_;
  }
  void took(Stiffness kind, double before, double after) {
    if (kind == Stiffness::laplacian && !(before - after > kWorthwhile * std::abs(before))) is_local_global_ = false;
    if (kind == Stiffness::projected && wait_ > 0) --wait_;
    if (kind == Stiffness::full) pause_ = 0;
  }

 private:
  bool is_local_global_ = true;
  int wait_ = 0, pause_ = 0;
};

class MassSpring final : public Simulation {
 public:
  MassSpring(const Model& model, std::unique_ptr<SpringEngine> engine) : model_(model), engine_(std::move(engine)) {}

  void set_loads(const Loads& loads) override {
    require_loads(model_, loads);
    if (!has_loads_ || loads.constraint != constraint_) {
      constraint_ = loads.constraint;
      roles_ = roles(model_, constraint_);
      least_force_ = rounding();
    }
    engine_->set_loads(loads, roles_);
    has_loads_ = true;
  }

  void set_displacement(std::span<const glm::vec3> displacement) override {
    require_displacement(model_, displacement);
    engine_->set_displacement(displacement);
    engine_->show(0);
  }

  std::vector<std::byte> state() const override { return engine_->state(); }
  void set_state(std::span<const std::byte> state) override {
    engine_->set_state(state);
    has_loads_ = false;
  }

  std::span<const glm::vec3> displacement() const override { return engine_->shown(); }
  std::vector<glm::vec3> displacement_on_host() const override { return engine_->shown_on_host(); }
  Memory memory() const override { return engine_->memory(); }

  Convergence advance(double part, const StoppingRule& rule, const Control& control) override {
    require(part >= 0 && part <= 1, "a part of the way is " + std::to_string(part) + "; expected 0 to 1");
    require(rule.steps > 0, "a rule allows " + std::to_string(rule.steps) + " steps; expected 1 or more");
    if (!has_loads_) return {.reached = true};
    engine_->set_stream(control.stream);
    const Convergence convergence = converge(part, rule, control);
    engine_->show(deadband_square());
    if (control.stop.stop_requested() && !convergence.reached) throw Cancelled();
    if (control.progress) control.progress(1);
    return convergence;
  }

 private:
  /// The force, N, below which net forces are rounding, not loads.
  double rounding() const {
    constexpr double kSoftMm = 1e-4, kHardMm = 1e-9;
    double least = 0, most = 0;
    for (std::size_t n = 0; n < model_.nodes(); ++n) {
      if (roles_[n] != SpringRole::free) continue;
      double sum = 0;
      for (int d = 0; d < kDirections; ++d) sum += double{model_.stiffness[model_.link(d, n)]};
      least = least > 0 ? std::min(least, sum) : sum;
      most = std::max(most, sum);
    }
    return std::max(kSoftMm * least, kHardMm * most);
  }

  double residual(const Strain& strain) const {
    const double scale = std::max(strain.placed_force, least_force_);
    return scale > 0 ? strain.free_force / scale : 0;
  }

  Convergence converge(double part, const StoppingRule& rule, const Control& control) {
    const Ways ways = engine_->aim(part);
    if (const std::optional<RigidMotion> motion = rigid_motion(ways)) engine_->carry(*motion);
    Strain now = ways.squares > 0 ? engine_->follow(kFollow, control.stop) : engine_->try_step(0);
    engine_->accept();
    Convergence convergence{.residual = residual(now), .reached = now.free_force == 0};
    Schedule schedule;
    while (!convergence.reached && convergence.steps < rule.steps && !control.stop.stop_requested()) {
      const bool is_near = convergence.steps > 0 && convergence.motion_mm <= 10 * rule.motion_mm &&
                           convergence.residual <= 10 * rule.residual;
      const SolveEffort& effort = is_near ? kThorough : kUsual;
      Stiffness kind = schedule.kind(convergence.residual);
      Solved solved = engine_->solve(kind, effort, control.stop);
      if (solved.is_indefinite) {
        schedule.refuse_full();
        kind = Stiffness::projected;
        solved = engine_->solve(kind, effort, control.stop);
      }
      if (control.stop.stop_requested()) break;
      const double before = now.energy, length = step(now, solved, kind);
      schedule.took(kind, before, now.energy);
      ++convergence.steps;
      convergence.motion_mm = length * solved.longest_mm;
      convergence.residual = residual(now);
      const bool is_trusted = is_near && kind != Stiffness::laplacian && length >= 1;
      const bool is_still = now.free_force == 0 || (solved.longest_mm > 0 && length == 0);
      convergence.reached =
          convergence.motion_mm <= rule.motion_mm && convergence.residual <= rule.residual && (is_trusted || is_still);
      if (control.progress) control.progress(static_cast<double>(convergence.steps) / rule.steps);
    }
    return convergence;
  }

  static bool is_lower(const Strain& from, const Strain& to, double slope, double length) {
    if (to.energy <= from.energy + kArmijo * length * slope) return true;
    return -slope * length <= kEnergyRounding * std::abs(from.energy) && std::abs(to.slope) <= std::abs(slope);
  }

  /// Line search along a direction: halves the step until the energy falls enough; where the matrix is stiffer than the
  /// springs, doubles it as long as the energy keeps falling.
  /// @return the length of the step in units of the direction; 0 where no length lowers the energy
  double step(Strain& now, const Solved& solved, Stiffness kind) {
    double length = 1;
    Strain there = solved.there;
    while (!is_lower(now, there, solved.slope, length)) {
      length /= 2;
      if (length < kShortest) return 0;
      there = engine_->try_step(length);
    }
    if (length == 1 && kind == Stiffness::projected) {
      while (length < kLongest && there.slope < 0) {
        const Strain further = engine_->try_step(2 * length);
        if (!(further.energy < there.energy)) {
          engine_->try_step(length);
          break;
        }
        length *= 2;
        there = further;
      }
    }
    engine_->accept();
    now = there;
    return length;
  }

  const Model& model_;
  std::unique_ptr<SpringEngine> engine_;
  std::vector<Constraint> constraint_;
  std::vector<SpringRole> roles_;
  double least_force_ = 0;
  bool has_loads_ = false;
};

}  // namespace

std::unique_ptr<Simulation> make_mass_spring(const Model& model, std::unique_ptr<SpringEngine> engine) {
  return std::make_unique<MassSpring>(model, std::move(engine));
}

std::unique_ptr<Simulation> make_cpu_mass_spring(const Model& model, Limits limits) {
  require_springs(model);
  return make_mass_spring(model, make_cpu_springs(model, limits));
}

}  // namespace tetwarp::simulate
