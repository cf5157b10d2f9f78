// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "deform/simulate/spring_sweeps.h"

namespace tetwarp::simulate {

/// Nodes whose sum is made at a time. The sum of n terms is made in this order, on every machine: each block of
/// kSumBlock terms, filled up with zeros, by `tree_sum`; then of the blocks' sums, those whose number leaves the same
/// rest divided by kSumBlock one after the other; then these kSumBlock sums by `tree_sum`.
inline constexpr std::size_t kSumBlock = 256;

/// Adds the upper half of terms to the lower half, until one term is left.
template <class T>
T tree_sum(T (&terms)[kSumBlock]) {
  for (std::size_t half = kSumBlock / 2; half > 0; half /= 2) {
    for (std::size_t t = 0; t < half; ++t) terms[t].add(terms[t + half]);
  }
  return terms[0];
}

/// Adds up what is left of blocks of kSumBlock terms.
template <class T>
T sum_of_blocks(std::span<const T> of_block) {
  T terms[kSumBlock];
  for (std::size_t block = 0; block < of_block.size(); ++block) terms[block % kSumBlock].add(of_block[block]);
  return tree_sum(terms);
}

/// Iterations of conjugate gradients, up to so many, until they are done. For machines in host memory.
template <class Machine>
void iterate_gradients(Machine& machine, const SpringArrays& a, Stiffness kind, int times) {
  for (int n = 0; n < times && !a.state->is_done; ++n) {
    machine.template sum<Products>(a.nodes, sweeps::Bend{{a}, kind}, sweeps::AfterBend{a.state});
    if (a.state->descends) machine.each(a.nodes, sweeps::Descend{{a}});
  }
}

/// A part of a task: sets the system up, unless it resumes, iterates, and when that is done finds out what the
/// direction leads to. For machines in host memory; others do the same in their own way.
template <class Machine>
void solve_part(Machine& machine, const SpringArrays& a, const SolveTask& task) {
  if (!task.resumes) {
    if (task.follows) machine.each(a.nodes, sweeps::PlacedMotion{{a}});
    machine.each(a.nodes, sweeps::Matrices{{a}, task.kind});
    machine.each(a.nodes, sweeps::Inverses{{a}, task.kind});
    if (task.follows) {
      machine.each(a.nodes, sweeps::PlacedForces{{a}, task.kind});
    } else {
      machine.each(a.nodes, sweeps::Forces{{a}});
    }
    machine.each(a.nodes, sweeps::Begin{{a}});
    *a.state = {.effort = task.effort};
  }
  iterate_gradients(machine, a, task.kind, task.times);
  if (!a.state->is_done && !task.ends) return;
  if (task.follows) {
    machine.each(a.nodes, sweeps::Follow{{a}});
  } else {
    machine.each(a.nodes, sweeps::Go{{a}, 1});
  }
  machine.template sum<Sums>(a.nodes, sweeps::StrainOf{{a}}, sweeps::Keep{&a.state->there});
}

/// Mass-spring on a machine that runs sweeps over nodes. The same code runs on the CPU and on devices, and gives the
/// same bits. Only sums and, every kIterations iterations, the state of conjugate gradients leave the machine's memory.
/// A machine is
///
///     template <class T> class Buffer;           // reserve(size), data()
///     kReadsLinks;                               // whether it calls sweeps that read the table of links
///     kNumbersOfVector;                          // that NodeVectors has in its memory
///     kIterations;                               // between questions whether to stop
///     std::size_t padding();                     // numbers that vectors have before the first node and after the last
///     scope();                                   // what it returns holds while the machine is used
///     each(nodes, sweep);                        // sweep(n) for every node
///     sum<T>(nodes, sweep, then);                // adds up what sweep(n) returns as kSumBlock says, then calls
///                                                // then(total) where the sweep ran
///     solve(arrays, task);                       // what solve_part does
///     upload(place, host, size), wait();
///     T fetch(const T* place);                   // waits for what is queued, and brings a value to the host
template <class Machine>
class SpringSolver final : public SpringEngine {
 public:
  template <class... Given>
  explicit SpringSolver(const Model& model, Given&&... given)
      : machine_(std::forward<Given>(given)...), nodes_(model.nodes()) {
    const auto scope = machine_.scope();
    if constexpr (Machine::kReadsLinks) {
      a_.neighbour = hold(neighbour_, model.neighbour);
      a_.stiffness = hold(stiffness_, model.stiffness);
      a_.links = hold(links_, links_of(model));
    }
    a_.role = hold(role_, std::vector<SpringRole>(nodes_, SpringRole::kept));
    a_.vertex = hold(vertex_, model.vertex);
    a_.rest_place = RestPlace(model.lattice);
    a_.nodes = nodes_;
    for (int d = 0; d < kDirections; ++d) {
      const glm::dvec3 along = rest_link(model.lattice, d);
      a_.rest[d] = {along, std::sqrt(dot3(along, along))};
      a_.distance[d] = static_cast<std::int32_t>(link_distance(model.lattice, d));
    }
    NodeVectors<double>* const doubles[] = {&a_.u,         &a_.trial,   &a_.start, &a_.goal,       &a_.load,
                                            &a_.load_from, &a_.load_to, &a_.force, &a_.trial_force};
    for (std::size_t i = 0; i < std::size(doubles); ++i) zeros(*doubles[i], doubles_[i], Machine::kNumbersOfVector);
    NodeVectors<float>* const floats[] = {&a_.x, &a_.r, &a_.z, &a_.q, &a_.p, &a_.s};
    for (std::size_t i = 0; i < std::size(floats); ++i) zeros(*floats[i], floats_[i], Machine::kNumbersOfVector);
    zeros(a_.matrix, matrix_, KeptMatrix::kEntries * kUp);
    zeros(a_.inverse, inverse_, NodeMatrices::kEntries);
    a_.shown = hold(shown_, std::vector<glm::vec3>(nodes_, glm::vec3(0)));
    a_.state = state_.reserve(1);
    a_.result = result_.reserve(1);
    a_.ways = ways_.reserve(1);
  }

  void set_stream(void* stream) override { machine_.set_stream(stream); }

  void set_loads(const Loads& loads, std::span<const SpringRole> roles) override {
    const auto scope = machine_.scope();
    machine_.upload(role_.data(), roles.data(), nodes_);
    const glm::vec3* goals = hold(given_, loads.goal);
    const glm::vec3* forces = loads.force.empty() ? nullptr : hold(given_forces_, loads.force);
    machine_.each(nodes_, sweeps::TakeLoads{{a_}, goals, forces});
    machine_.wait();
  }

  void set_displacement(std::span<const glm::vec3> displacement) override {
    const auto scope = machine_.scope();
    machine_.each(nodes_, sweeps::Start{{a_}, hold(given_, displacement)});
    machine_.wait();
  }

  std::vector<std::byte> state() override {
    const auto scope = machine_.scope();
    std::vector<double> kept(sweeps::WriteState::kNumbers * nodes_);
    double* const place = kept_.reserve(kept.size());
    machine_.each(nodes_, sweeps::WriteState{{a_}, place});
    machine_.download(kept.data(), place, kept.size());
    std::vector<std::byte> bytes;
    put_bytes(bytes, std::span<const double>(kept));
    put_bytes(bytes, std::span<const glm::vec3>(shown_on_host()));
    return bytes;
  }
  void set_state(std::span<const std::byte> state) override {
    const auto scope = machine_.scope();
    const std::size_t numbers = sweeps::WriteState::kNumbers * nodes_;
    StateBytes bytes(state, numbers * sizeof(double) + nodes_ * sizeof(glm::vec3));
    machine_.each(nodes_, sweeps::ReadState{{a_}, hold(kept_, bytes.take<double>(numbers))});
    const std::vector<glm::vec3> shown = bytes.take<glm::vec3>(nodes_);
    machine_.upload(shown_.data(), shown.data(), nodes_);
    machine_.wait();
  }

  Ways aim(double part) override {
    const auto scope = machine_.scope();
    machine_.template sum<Ways>(nodes_, sweeps::Aim{{a_}, part}, sweeps::Keep{a_.ways});
    return machine_.fetch(a_.ways);
  }

  void carry(const RigidMotion& motion) override {
    const auto scope = machine_.scope();
    machine_.each(nodes_, sweeps::Carry{{a_}, motion});
  }

  Strain follow(const SolveEffort& effort, std::stop_token stop) override {
    return solve_all({.kind = Stiffness::laplacian, .follows = true, .effort = effort}, stop).there.strain();
  }

  Solved solve(Stiffness kind, const SolveEffort& effort, std::stop_token stop) override {
    const GradientState state = solve_all({.kind = kind, .effort = effort}, stop);
    return {.iterations = state.iterations,
            .is_indefinite = state.is_indefinite,
            .slope = state.there.slope_before,
            .longest_mm = std::sqrt(state.there.length),
            .there = state.there.strain()};
  }

  Strain try_step(double part) override {
    const auto scope = machine_.scope();
    machine_.each(nodes_, sweeps::Go{{a_}, part});
    machine_.template sum<Sums>(nodes_, sweeps::StrainOf{{a_}}, sweeps::Keep{a_.result});
    return machine_.fetch(a_.result).strain();
  }

  void accept() override {
    std::swap(a_.u, a_.trial);
    std::swap(a_.force, a_.trial_force);
  }

  void show(float square) override {
    const auto scope = machine_.scope();
    machine_.each(nodes_, sweeps::Show{{a_}, square});
    machine_.wait();
  }
  std::span<const glm::vec3> shown() const override { return {a_.shown, nodes_}; }
  std::vector<glm::vec3> shown_on_host() override {
    const auto scope = machine_.scope();
    std::vector<glm::vec3> result(nodes_);
    machine_.download(result.data(), a_.shown, nodes_);
    return result;
  }
  Memory memory() const override { return Machine::kMemory; }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  template <class T, class Values>
  T* hold(Buffer<T>& buffer, const Values& values) {
    T* place = buffer.reserve(values.size());
    machine_.upload(place, values.data(), values.size());
    return place;
  }
  /// Gives numbers of nodes their place, each of some arrays of them with its padding.
  template <class Numbers, class T>
  void zeros(Numbers& numbers, Buffer<T>& buffer, std::size_t arrays) {
    numbers.stride = nodes_ + 2 * machine_.padding();
    numbers.data = hold(buffer, std::vector<T>(arrays * numbers.stride)) + machine_.padding();
  }

  /// What SpringArrays::links holds.
  static std::vector<std::uint32_t> links_of(const Model& model) {
    std::vector<std::uint32_t> links(model.nodes(), 0);
    for (int d = 0; d < kDirections; ++d) {
      const std::ptrdiff_t distance = link_distance(model.lattice, d);
      for (std::size_t n = 0; n < links.size(); ++n) {
        const std::int32_t to = model.neighbour[model.link(d, n)];
        if (to >= 0) links[n] |= to == static_cast<std::ptrdiff_t>(n) + distance ? 1u << d : kHasOddLinks;
      }
    }
    return links;
  }

  GradientState solve_all(SolveTask task, const std::stop_token& stop) {
    const auto scope = machine_.scope();
    task.times = Machine::kIterations;
    machine_.solve(a_, task);
    GradientState state = machine_.fetch(a_.state);
    while (!state.is_done && !task.ends) {
      task.resumes = true;
      task.ends = stop.stop_requested();
      if (task.ends) task.times = 0;
      machine_.solve(a_, task);
      state = machine_.fetch(a_.state);
    }
    return state;
  }

  Machine machine_;
  std::size_t nodes_;
  SpringArrays a_{};
  Buffer<std::int32_t> neighbour_;
  Buffer<std::uint32_t> vertex_, links_;
  Buffer<float> stiffness_, floats_[6], inverse_;
  Buffer<Bfloat16> matrix_;
  Buffer<SpringRole> role_;
  Buffer<double> doubles_[9], kept_;
  Buffer<glm::vec3> shown_, given_, given_forces_;
  Buffer<GradientState> state_;
  Buffer<Sums> result_;
  Buffer<Ways> ways_;
};

}  // namespace tetwarp::simulate
