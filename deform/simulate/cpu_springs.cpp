// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "deform/cpu/tiles.h"
#include "deform/simulate/cholesky.h"
#include "deform/simulate/spring_engine.h"
#include "deform/simulate/spring_grid.h"

namespace tetwarp::simulate {

namespace {

constexpr int kStopEvery = 16;  ///< iterations between two looks at a request to stop

class CpuSprings final : public SpringEngine {
 public:
  CpuSprings(const Model& model, const MassSpringOptions& options, Limits limits)
      : model_(model),
        grid_(model),
        rest_(model.lattice),
        is_factored_(
            options.solver == MassSpringOptions::Solver::cholesky ||
            (options.solver == MassSpringOptions::Solver::automatic && model.nodes() <= kMostNodesForCholesky)),
        arena_(limits),
        roles_(model.nodes(), SpringRole::kept),
        inverse_(model.nodes()),
        partial_(grid_.blocks()),
        shown_(model.nodes(), glm::vec3(0)) {
    for (auto* vectors : {&u_, &trial_, &start_, &goal_, &load_, &load_from_, &load_to_, &force_, &trial_force_}) {
      *vectors = grid_.vectors<double>();
    }
    for (auto* vectors : {&x_, &r_, &z_, &p_, &q_}) *vectors = grid_.vectors<float>();
    for (auto& of_direction : matrices_.up) of_direction.fill(Padded<float>(grid_.nodes, grid_.padding));
    matrices_.odd.resize(grid_.odd.size());
  }

  void set_loads(const Loads& loads, std::span<const SpringRole> roles) override {
    if (!std::equal(roles.begin(), roles.end(), roles_.begin())) factor_.reset();
    roles_.assign(roles.begin(), roles.end());
    if (is_factored_ && !factor_) factor_ = std::make_unique<LaplacianFactor>(model_, roles_);
    start_ = u_;
    load_from_ = load_;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      for (std::size_t n = 0; n < grid_.nodes; ++n) {
        const bool is_free = roles[n] == SpringRole::free;
        goal_[a][n] = double{loads.goal[n][axis]};
        load_to_[a][n] = is_free && !loads.force.empty() ? double{loads.force[n][axis]} : 0;
        if (!is_free) load_from_[a][n] = 0;
      }
    }
  }

  void set_displacement(std::span<const glm::vec3> displacement) override {
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      for (std::size_t n = 0; n < grid_.nodes; ++n) u_[a][n] = double{displacement[n][axis]};
    }
    start_ = u_;
  }

  Ways aim(double part) override {
    Ways ways;
    for (std::size_t n = 0; n < grid_.nodes; ++n) {
      const bool is_placed = roles_[n] == SpringRole::placed;
      for (std::size_t a = 0; a < 3; ++a) {
        load_[a][n] = on_the_way(load_from_[a][n], load_to_[a][n], part);
        trial_[a][n] = is_placed ? on_the_way(start_[a][n], goal_[a][n], part) : u_[a][n];
      }
      if (is_placed) ways.add(Ways::of(rest_(model_.vertex[n]) + at(u_, n), at(trial_, n) - at(u_, n)));
    }
    return ways;
  }

  void carry(const RigidMotion& motion) override {
    arena_.execute([&] {
      for_blocks([&](NodeRange range, std::size_t) {
        for (std::size_t n = range.begin; n < range.end; ++n) {
          if (roles_[n] == SpringRole::kept) continue;
          const glm::dvec3 way = motion.way_of(rest_(model_.vertex[n]) + at(u_, n));
          for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            u_[a][n] += way[axis];
            if (roles_[n] == SpringRole::free) trial_[a][n] = u_[a][n];
          }
        }
      });
    });
  }

  void follow(const SolveEffort& effort, std::stop_token stop) override {
    arena_.execute([&] {
      for_blocks([&](NodeRange range, std::size_t) {
        for (std::size_t a = 0; a < 3; ++a) {
          for (std::size_t n = range.begin; n < range.end; ++n) {
            p_[a][n] = static_cast<float>(trial_[a][n] - u_[a][n]);
          }
        }
      });
      make_matrices(Stiffness::laplacian);
      for_blocks([&](NodeRange range, std::size_t) {
        sweep_product(grid_, range, matrices_, p_, q_);
        for_free(range, [&](std::size_t a, std::size_t n) { r_[a][n] = -q_[a][n]; });
      });
      seek(Stiffness::laplacian, effort, stop);
      for_blocks([&](NodeRange range, std::size_t) {
        for_free(range, [&](std::size_t a, std::size_t n) { trial_[a][n] += double{x_[a][n]}; });
      });
      u_.swap(trial_);
    });
  }

  Solved solve(Stiffness kind, const SolveEffort& effort, std::stop_token stop) override {
    return arena_.execute([&] {
      for_blocks([&](NodeRange range, std::size_t) {
        for_free(range, [&](std::size_t a, std::size_t n) { r_[a][n] = static_cast<float>(force_[a][n]); });
      });
      if (!(kind == Stiffness::laplacian && factor_)) make_matrices(kind);
      Solved result = seek(kind, effort, stop);
      const Sums sums = sum_blocks([&](NodeRange range) {
        Sums block;
        for (std::size_t n = range.begin; n < range.end; ++n) {
          double square = 0;
          for (std::size_t a = 0; a < 3; ++a) {
            block.sum -= force_[a][n] * double{x_[a][n]};
            square += double{x_[a][n]} * double{x_[a][n]};
          }
          block.most = std::max(block.most, square);
        }
        return block;
      });
      result.slope = sums.sum;
      result.longest_mm = std::sqrt(sums.most);
      return result;
    });
  }

  Strain try_step(double part) override {
    return arena_.execute([&] {
      for_blocks([&](NodeRange range, std::size_t) {
        for (std::size_t a = 0; a < 3; ++a) {
          for (std::size_t n = range.begin; n < range.end; ++n) {
            trial_[a][n] = part == 0 ? u_[a][n] : u_[a][n] + part * double{x_[a][n]};
          }
        }
      });
      return sum_blocks([&](NodeRange range) { return strain_of(range); }).strain();
    });
  }

  void accept() override {
    u_.swap(trial_);
    force_.swap(trial_force_);
  }

  void show() override {
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      for (std::size_t n = 0; n < grid_.nodes; ++n) shown_[n][axis] = static_cast<float>(u_[a][n]);
    }
  }
  std::span<const glm::vec3> shown() const override { return shown_; }

 private:
  static glm::dvec3 at(const PaddedVectors<double>& vectors, std::size_t n) {
    return {vectors[0][n], vectors[1][n], vectors[2][n]};
  }
  static double on_the_way(double from, double to, double part) { return part == 1 ? to : from + part * (to - from); }

  template <class Work>
  void for_blocks(Work&& work) {
    const auto run = [&](std::size_t block) {
      const std::size_t begin = block * SpringGrid::kBlock;
      work(NodeRange{begin, std::min(begin + SpringGrid::kBlock, grid_.nodes)}, block);
    };
    // A thread sweeps over neighbouring blocks: what it has read for one is in its cache for the next.
    tbb::parallel_for(std::size_t{0}, grid_.blocks(), run, tbb::static_partitioner());
  }

  /// Adds up what blocks return, in their order, whichever thread swept over them.
  template <class Work>
  Sums sum_blocks(Work&& work) {
    for_blocks([&](NodeRange range, std::size_t block) { partial_[block] = work(range); });
    Sums result;
    for (const Sums& block : partial_) result.add(block);
    return result;
  }

  template <class Work>
  void for_free(NodeRange range, Work&& work) const {
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t n = range.begin; n < range.end; ++n) {
        if (roles_[n] == SpringRole::free) work(a, n);
      }
    }
  }

  Sums strain_of(NodeRange range) {
    Sums sums{.sum = sweep_forces(grid_, range, trial_, trial_force_)};
    for (std::size_t n = range.begin; n < range.end; ++n) {
      double square = 0, load = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        double& force = trial_force_[a][n];
        force += load_[a][n];
        sums.sum -= load_[a][n] * trial_[a][n];
        square += force * force;
        load += load_[a][n] * load_[a][n];
        if (roles_[n] != SpringRole::free) force = 0;
        sums.slope -= force * double{x_[a][n]};
      }
      double& most = roles_[n] == SpringRole::free ? sums.most : sums.most_placed;
      if (roles_[n] != SpringRole::kept) most = std::max(most, square);
      sums.most_load = std::max(sums.most_load, load);
    }
    return sums;
  }

  void make_matrices(Stiffness kind) {
    for_blocks([&](NodeRange range, std::size_t) { sweep_matrices(grid_, range, u_, kind, matrices_); });
    for_blocks([&](NodeRange range, std::size_t block) {
      for (std::size_t n = range.begin; n < range.end; ++n) inverse_[n] = {};
      for (std::size_t at = grid_.first_odd[block]; at < grid_.first_odd[block + 1]; ++at) {
        inverse_[grid_.odd[at].node].add(matrices_.odd[at].full());
      }
      for (std::size_t n = range.begin; n < range.end; ++n) {
        Symmetric<float> sum = inverse_[n];
        for (std::size_t up = 0; up < kUp; ++up) {
          for (const std::ptrdiff_t back : {std::ptrdiff_t{0}, grid_.distance[up]}) {
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(n) - back;
            const auto entry = [&](std::size_t i) { return matrices_.up[up][i].data()[at]; };
            sum.add(SpringMatrix<float>{{entry(0), entry(1), entry(2)}, entry(3)}.full());
          }
        }
        inverse_[n] = roles_[n] == SpringRole::free ? inverse_block(sum) : Symmetric<float>{};
      }
    });
  }

  /// Solves A x_ = r_ for free nodes, where A has the spring matrices of a kind.
  Solved seek(Stiffness kind, const SolveEffort& effort, const std::stop_token& stop) {
    for_blocks([&](NodeRange range, std::size_t) {
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t n = range.begin; n < range.end; ++n) {
          if (roles_[n] != SpringRole::free) r_[a][n] = 0;
        }
      }
    });
    if (kind != Stiffness::laplacian || !factor_) return conjugate_gradients(effort, stop);
    std::vector<glm::dvec3> values(grid_.nodes);
    for (std::size_t n = 0; n < grid_.nodes; ++n) {
      values[n] = {double{r_[0][n]}, double{r_[1][n]}, double{r_[2][n]}};
    }
    factor_->solve(values);
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t n = 0; n < grid_.nodes; ++n) {
        x_[static_cast<std::size_t>(axis)][n] = static_cast<float>(values[n][axis]);
      }
    }
    return {.iterations = 1};
  }

  /// Solves by conjugate gradients, preconditioned by the inverse of each node's own 3 x 3 block.
  Solved conjugate_gradients(const SolveEffort& effort, const std::stop_token& stop) {
    double rz = sum_blocks([&](NodeRange range) { return descend(range, 0, true); }).sum;
    const double least = kFloatRounding * rz;
    turn(0);
    Solved result;
    for (double gained = 0; rz > least && result.iterations < effort.most; ++result.iterations) {
      if (result.iterations % kStopEvery == 0 && stop.stop_requested()) break;
      const double curvature = sum_blocks([&](NodeRange range) { return bend(range); }).sum;
      if (!(curvature > 0)) {
        result.is_indefinite = true;
        break;
      }
      const double length = rz / curvature, gain = length * rz / 2;
      const double next =
          sum_blocks([&](NodeRange range) { return descend(range, static_cast<float>(length), false); }).sum;
      gained += gain;
      const int done = result.iterations + 1;
      if (effort.is_enough(done, gain, gained)) {
        ++result.iterations;
        break;
      }
      turn(static_cast<float>(next / rz));
      rz = next;
    }
    return result;
  }

  /// Sets q = A p in a block. @return p.q over free nodes
  Sums bend(NodeRange range) {
    sweep_product(grid_, range, matrices_, p_, q_);
    Sums sums;
    for (std::size_t a = 0; a < 3; ++a) {
      const float *p = p_[a].data(), *q = q_[a].data();
      for (std::size_t n = range.begin; n < range.end; ++n) sums.sum += double{p[n]} * double{q[n]};
    }
    return sums;
  }

  /// Sets x += length p, r -= length q, z = preconditioned r in a block. If it `begins`, x starts at 0. @return r.z
  Sums descend(NodeRange range, float length, bool begins) {
    Sums sums;
    for (std::size_t n = range.begin; n < range.end; ++n) {
      const bool is_free = roles_[n] == SpringRole::free;
      glm::vec3 r;
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        x_[a][n] = begins ? 0.0f : x_[a][n] + length * p_[a][n];
        if (!begins && is_free) r_[a][n] -= length * q_[a][n];
        r[axis] = r_[a][n];
      }
      const glm::vec3 z = inverse_[n] * r;
      for (int axis = 0; axis < 3; ++axis) z_[static_cast<std::size_t>(axis)][n] = z[axis];
      sums.sum += double{r.x} * double{z.x} + double{r.y} * double{z.y} + double{r.z} * double{z.z};
    }
    return sums;
  }

  /// Sets p = z + share p.
  void turn(float share) {
    for_blocks([&](NodeRange range, std::size_t) {
      for (std::size_t a = 0; a < 3; ++a) {
        float* p = p_[a].data();
        const float* z = z_[a].data();
        for (std::size_t n = range.begin; n < range.end; ++n) p[n] = share == 0 ? z[n] : z[n] + share * p[n];
      }
    });
  }

  const Model& model_;
  SpringGrid grid_;
  RestPlace rest_;
  bool is_factored_;
  cpu::Arena arena_;
  std::vector<SpringRole> roles_;
  std::unique_ptr<LaplacianFactor> factor_;
  PaddedVectors<double> u_, trial_;                   ///< displacement
  PaddedVectors<double> start_, goal_;                ///< of placed nodes: where they come from, and where they go
  PaddedVectors<double> load_, load_from_, load_to_;  ///< on free nodes: force now, at the start, and at the goal, N
  PaddedVectors<double> force_, trial_force_;         ///< net force on free nodes at u_ and at trial_, N
  SpringMatrices matrices_;
  std::vector<Symmetric<float>> inverse_;   ///< by free node: the inverse of its sum of spring matrices
  PaddedVectors<float> x_, r_, z_, p_, q_;  ///< the direction that is sought, and vectors of conjugate gradients
  std::vector<Sums> partial_;
  std::vector<glm::vec3> shown_;
};

}  // namespace

std::unique_ptr<SpringEngine> make_cpu_springs(const Model& model, const MassSpringOptions& options, Limits limits) {
  return std::make_unique<CpuSprings>(model, options, limits);
}

}  // namespace tetwarp::simulate
