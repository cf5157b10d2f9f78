// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/simulate/mass_spring.h"
#include "tests/support/plain_machine.h"
#include "tests/support/random.h"

namespace tetwarp::test {

using namespace simulate;

inline constexpr StoppingRule kTight{.motion_mm = 1e-7, .residual = 1e-9, .steps = 500};

/// One way to solve mass-spring. The tests run over all of them.
struct SpringMethod {
  std::string name, cannot_run;
  std::function<std::unique_ptr<Simulation>(const Model&)> make;

  friend void PrintTo(const SpringMethod& method, std::ostream* stream) { *stream << method.name; }
};

inline std::vector<SpringMethod> methods() {
  const std::string no_cuda =
      !has_cuda() ? "CUDA is not in this build" : (device_count() == 0 ? "no CUDA device on this machine" : "");
  return {{.name = "cpu",
           .cannot_run = "",
           .make = [](const Model& model) { return make_cpu_mass_spring(model, {.threads = 2}); }},
          {.name = "device_code_on_cpu",
           .cannot_run = "",
           .make =
               [](const Model& model) {
                 require_springs(model);
                 return make_mass_spring(model, std::make_unique<SpringSolver<PlainMachine>>(model));
               }},
          {.name = "cuda", .cannot_run = no_cuda, .make = [](const Model& model) {
             return make_simulation(BackendKind::cuda, simulate::Method::mass_spring, model);
           }}};
}

inline std::vector<glm::vec3> displacement(const Simulation& simulation) { return simulation.displacement_on_host(); }

inline Geometry lattice(const glm::i64vec3& size, const glm::dvec3& spacing = {6, 7, 8}) {
  return {.size = size, .spacing = spacing, .origin = {3, -4, 5}};
}

inline const std::vector<Tissue>& tissues() {
  static const std::vector<Tissue> all{{.name = "soft", .youngs_modulus_kpa = 10},
                                       {.name = "bone", .youngs_modulus_kpa = 1e4},
                                       {.name = "air", .youngs_modulus_kpa = 0.1}};
  return all;
}

inline Model random_model(const Geometry& grid, Random& random, int kinds) {
  const glm::i64vec3 cells = grid.size - std::int64_t{1};
  std::vector<std::uint8_t> of_cell(static_cast<std::size_t>(cells.x * cells.y * cells.z));
  for (std::uint8_t& tissue : of_cell) tissue = static_cast<std::uint8_t>(random.integer(0, kinds - 1));
  return make_model(grid, of_cell, tissues());
}

inline glm::i64vec3 place_of(const Model& model, std::size_t node) {
  const glm::i64vec3& size = model.lattice.size;
  const auto v = static_cast<std::int64_t>(model.vertex[node]);
  return {v % size.x, v / size.x % size.y, v / (size.x * size.y)};
}

inline glm::dvec3 rest_of(const Model& model, std::size_t node) {
  return point_from_index(model.lattice)(glm::dvec3(place_of(model, node)));
}

/// Loads that leave all nodes free and exert no force.
inline Loads free_loads(const Model& model) {
  return {.constraint = std::vector<Constraint>(model.nodes(), Constraint::free),
          .goal = std::vector<glm::vec3>(model.nodes(), glm::vec3(0)),
          .force = {}};
}

inline void place(Loads& loads, std::size_t node, const glm::dvec3& goal) {
  loads.constraint[node] = Constraint::placed;
  loads.goal[node] = {static_cast<float>(goal.x), static_cast<float>(goal.y), static_cast<float>(goal.z)};
}

/// Loads that hold the bottom layer and move a part of the top layer.
inline Loads pressed(const Model& model, const glm::dvec3& motion) {
  Loads loads = free_loads(model);
  const glm::i64vec3& size = model.lattice.size;
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    const glm::i64vec3 at = place_of(model, n);
    if (at.z == 0) place(loads, n, glm::dvec3(0));
    if (at.z == size.z - 1 && at.x < (size.x + 1) / 2) place(loads, n, motion);
  }
  return loads;
}

inline double furthest(const std::vector<glm::vec3>& a, const std::function<glm::dvec3(std::size_t)>& b) {
  double most = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    const glm::dvec3 expected = b(n);
    const double apart =
        std::hypot(double{a[n].x} - expected.x, double{a[n].y} - expected.y, double{a[n].z} - expected.z);
    if (!(apart <= most)) most = apart;  // NaN stays
  }
  return most;
}

inline double furthest(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  return furthest(a, [&](std::size_t n) { return glm::dvec3(double{b[n].x}, double{b[n].y}, double{b[n].z}); });
}

}  // namespace tetwarp::test
