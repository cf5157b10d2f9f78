// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/chainmail.h"

#include <algorithm>
#include <atomic>

#include "deform/cpu/tiles.h"
#include "deform/errors.h"
#include "deform/simulate/chain_plan.h"

namespace tetwarp::simulate {

namespace {

class CpuChainmail final : public Simulation {
 public:
  CpuChainmail(const Model& model, const Limits& limits) : plan_(model), arena_(limits), active_(plan_.blocks.size()) {
    const auto count = static_cast<std::size_t>(plan_.nodes());
    for (std::vector<Units>* state : {&now_, &before_, &shown_, &upper_, &lower_}) state->resize(count);
    ranges_.resize(count);
    moves_.resize(count);
    displacement_.resize(count);
    for (std::size_t n = 0; n < plan_.blocks.size(); ++n) of_colour_[plan_.blocks[n].colour].push_back(n);
  }

  void set_loads(const Loads& loads) override {
    std::vector<PlacedNode> placed = plan_.read(loads);
    for (PlacedNode& one : placed) one.start = shown_[at(one.node)];
    moves_ = plan_.moving(placed);
    placed_ = std::move(placed);
    advances_ = 0;
    paths_ = {};
    has_loads_ = true;
  }

  Convergence advance(double part, const StoppingRule& rule, const Control& control) override {
    require(has_loads_, "advance needs loads: call set_loads first");
    require_valid(part, rule);
    Convergence convergence;
    arena_.execute([&] { convergence = run(part, rule, control); });
    return convergence;
  }

  std::span<const glm::vec3> displacement() const override { return displacement_; }

  void set_displacement(std::span<const glm::vec3> displacement) override {
    upper_ = plan_.to_units(displacement);
    lower_ = upper_;
    arena_.execute([&] {
      activate_all();
      tighten_all({});
      for_nodes([&](std::size_t n) { now_[n] = shown_[n] = halfway(upper_[n], lower_[n]); });
      convert(0);
    });
  }

  std::vector<std::byte> state() const override { return state_of_chain(now_, shown_, displacement_); }
  void set_state(std::span<const std::byte> state) override {
    read_chain_state(state, now_, shown_, displacement_);
    placed_.clear();
    has_loads_ = false;
  }

 private:
  static std::size_t at(std::int32_t n) { return static_cast<std::size_t>(n); }

  /// Calls `work(block)` for all blocks, each by one thread.
  template <class Work>
  void for_blocks(Work&& work) {
    tbb::parallel_for(std::size_t{0}, plan_.blocks.size(), work);
  }
  template <class Work>
  void for_nodes(Work&& work) {
    for_blocks([&](std::size_t block) {
      for (std::int32_t n = plan_.blocks[block].begin; n < plan_.blocks[block].end; ++n) work(at(n));
    });
  }

  Convergence run(double part, const StoppingRule& rule, const Control& control) {
    Convergence convergence;
    std::uint64_t motion = follow(part, control);
    Pacer pacer(plan_.momentum, plan_.patience);
    try {
      while (convergence.steps < rule.steps && !convergence.reached) {
        motion = relax(pacer.pace, control);
        ++convergence.steps;
        convergence.reached = motion_mm(motion) <= rule.motion_mm;
        pacer.follow(motion);
        if (control.progress) control.progress(static_cast<double>(convergence.steps) / rule.steps);
      }
    } catch (const Cancelled&) {
      show(part);
      throw;
    }
    convergence.motion_mm = motion_mm(motion);
    show(part);
    return convergence;
  }

  static Units same(std::int32_t units) { return {{units, units, units}}; }

  /// Makes the first step of ChainMail, the chain: nodes move as far as placed ones force them to. Where it is made
  /// again for the same loads, the paths of their sets are followed once.
  std::uint64_t follow(double part, const Control& control) {
    if (++advances_ == 2) find_paths(control);
    const bool has_paths = paths_.count > 0;
    if (has_paths) {
      for (std::size_t set = 0; set < sets_.size(); ++set) paths_.at[set] = placed_[sets_[set].begin].at(part);
    } else {
      spread(kFarthest, {0, placed_.size()}, control, [&](const PlacedNode& one) { return one.at(part); });
    }
    return finish([&](std::size_t n) {
      ranges_[n] = has_paths ? paths_.range(static_cast<std::int32_t>(n)) : range_between(upper_[n], lower_[n]);
      return clamped(now_[n], ranges_[n]);
    });
  }

  /// Tightens all from the placed nodes of a set. @param farthest  where nothing holds a node
  /// @param where  `where(one)` is the displacement of a placed node
  template <class Where>
  void spread(std::int32_t farthest, const PlacedSet& set, const Control& control, const Where& where) {
    for_nodes([&](std::size_t n) {
      upper_[n] = same(farthest);
      lower_[n] = same(-farthest);
    });
    for (std::size_t n = set.begin; n < set.end; ++n)
      upper_[at(placed_[n].node)] = lower_[at(placed_[n].node)] = where(placed_[n]);
    activate_all();
    tighten_all(control);
  }

  void find_paths(const Control& control) {
    sets_ = plan_.sets_of(placed_);
    const auto nodes = static_cast<std::size_t>(plan_.nodes());
    path_upper_.resize(sets_.size() * nodes);
    path_lower_.resize(sets_.size() * nodes);
    for (std::size_t set = 0; set < sets_.size(); ++set) {
      spread(kNoPath, sets_[set], control, [](const PlacedNode&) { return same(0); });
      std::copy(upper_.begin(), upper_.end(), path_upper_.begin() + static_cast<std::ptrdiff_t>(set * nodes));
      std::copy(lower_.begin(), lower_.end(), path_lower_.begin() + static_cast<std::ptrdiff_t>(set * nodes));
    }
    paths_.nodes = plan_.nodes();
    paths_.upper = path_upper_.data();
    paths_.lower = path_lower_.data();
    paths_.count = static_cast<int>(sets_.size());
  }

  /// Makes one step of relaxation.
  std::uint64_t relax(const Pace& pace, const Control& control) {
    const ChainView chain = plan_.view(moves_.data());
    for_nodes([&](std::size_t n) {
      upper_[n] = lower_[n] =
          relaxed(chain, now_.data(), before_.data(), ranges_[n], pace, static_cast<std::int32_t>(n));
    });
    activate_all();
    tighten_all(control);
    return finish([&](std::size_t n) { return halfway(upper_[n], lower_[n]); });
  }

  /// Moves each node to where `place` says. @return square of the largest motion
  template <class PlaceNodes>
  std::uint64_t finish(PlaceNodes&& place) {
    std::vector<std::uint64_t> motion(plan_.blocks.size());
    for_blocks([&](std::size_t block) {
      for (std::int32_t n = plan_.blocks[block].begin; n < plan_.blocks[block].end; ++n) {
        before_[at(n)] = now_[at(n)];
        now_[at(n)] = place(at(n));
        motion[block] = std::max(motion[block], square_of_motion(before_[at(n)], now_[at(n)]));
      }
    });
    return *std::max_element(motion.begin(), motion.end());
  }

  void activate_all() {
    for (std::atomic<std::uint8_t>& active : active_) active.store(1, std::memory_order_relaxed);
  }

  /// Runs `tighten` in the active blocks, and in blocks beside one that changes, until nothing changes.
  ///
  /// Blocks of one colour run at the same time: none reads what another one writes.
  void tighten_all(const Control& control) {
    for (bool any = true; any;) {
      if (control.stop.stop_requested()) throw Cancelled();
      any = false;
      for (const std::vector<std::size_t>& blocks : of_colour_) {
        std::atomic<bool> changed = false;
        tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t n) {
          if (!active_[blocks[n]].exchange(0, std::memory_order_relaxed)) return;
          if (!tighten_block(plan_.blocks[blocks[n]])) return;
          for (const std::int32_t beside : plan_.blocks[blocks[n]].beside) {
            active_[at(beside)].store(1, std::memory_order_relaxed);
          }
          changed.store(true, std::memory_order_relaxed);
        });
        any = any || changed;
      }
    }
  }

  /// Runs `tighten` up and down through the nodes of a block until nothing changes. @return whether anything changed
  bool tighten_block(const ChainBlock& block) {
    const ChainView chain = plan_.view(moves_.data());
    bool any = false;
    for (bool up = true;; up = !up) {
      bool changed = false;
      for (std::int32_t n = 0; n < block.end - block.begin; ++n) {
        changed |= tighten(chain, upper_.data(), lower_.data(), up ? block.begin + n : block.end - 1 - n);
      }
      if (!changed) return any;
      any = true;
    }
  }

  void show(double part) {
    shown_ = now_;
    for (const PlacedNode& one : placed_) shown_[at(one.node)] = one.at(part);
    convert(deadband_square());
  }

  void convert(float square) {
    for_nodes([&](std::size_t n) {
      glm::vec3& shown = displacement_[at(plan_.node_of[n])];
      shown = shown_of(shown, to_lps(plan_.direction, shown_[n]), square);
    });
  }

  ChainPlan plan_;
  cpu::Arena arena_;
  std::vector<std::size_t> of_colour_[2];          ///< numbers of the blocks of each colour
  std::vector<std::atomic<std::uint8_t>> active_;  ///< by block: whether it has to be tightened again
  std::vector<PlacedNode> placed_;
  std::vector<std::uint8_t> moves_;
  bool has_loads_ = false;
  int advances_ = 0;                            ///< with these loads
  std::vector<PlacedSet> sets_;                 ///< of `placed_`
  SetPaths paths_;                              ///< of them, from the second advance on
  std::vector<Units> path_upper_, path_lower_;  ///< to which `paths_` refers
  std::vector<Units> now_, before_;             ///< within the limits at all times
  std::vector<Units> shown_;                    ///< `now_` with placed nodes at their goals
  std::vector<Units> upper_, lower_;            ///< the bounds that `tighten` narrows
  std::vector<DisplacementRange> ranges_;       ///< by node: what placed nodes leave to it
  std::vector<glm::vec3> displacement_;
};

}  // namespace

std::unique_ptr<Simulation> make_cpu_chainmail(const Model& model, Limits limits) {
  return std::make_unique<CpuChainmail>(model, limits);
}

std::vector<BrokenLink> links_beyond_limits(const Model& model, std::span<const glm::vec3> displacement,
                                            double tolerance_mm) {
  require(displacement.size() == model.nodes(), "one displacement a node is expected, " +
                                                    std::to_string(model.nodes()) + "; found " +
                                                    std::to_string(displacement.size()));
  const glm::dmat3& direction = model.lattice.direction;
  std::vector<BrokenLink> broken;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      const std::int32_t other = model.neighbour[model.link(direction_up(axis), n)];
      if (other < 0) continue;
      const glm::vec3 &upper = displacement[static_cast<std::size_t>(other)], &lower = displacement[n];
      const glm::dvec3 apart(double{upper.x} - double{lower.x}, double{upper.y} - double{lower.y},
                             double{upper.z} - double{lower.z});
      const LinkLimits& limits = model.limits[static_cast<std::size_t>(axis) * model.nodes() + n];
      double beyond = 0;
      for (int c = 0; c < 3; ++c) {
        const double along = direction[c].x * apart.x + direction[c].y * apart.y + direction[c].z * apart.z;
        const double least = c == axis ? limits.shortest : -limits.shear,
                     most = c == axis ? limits.longest : limits.shear;
        beyond = std::max({beyond, least - along, along - most});
      }
      if (beyond > tolerance_mm) broken.push_back({static_cast<std::uint32_t>(n), axis, beyond});
    }
  }
  return broken;
}

}  // namespace tetwarp::simulate
