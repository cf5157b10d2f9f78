// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "deform/errors.h"
#include "deform/simulate/scenario.h"

namespace tetwarp::simulate::test {

/// The message with which an action is refused; empty where it is not.
template <class Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A CT whose voxels are `hu(i, j, k)`.
template <class Hu>
Volume<std::int16_t> ct_of(const Geometry& geometry, const Hu& hu) {
  Volume<std::int16_t> ct{geometry, {}};
  for (std::int64_t k = 0; k < geometry.size.z; ++k) {
    for (std::int64_t j = 0; j < geometry.size.y; ++j) {
      for (std::int64_t i = 0; i < geometry.size.x; ++i) ct.voxels.push_back(static_cast<std::int16_t>(hu(i, j, k)));
    }
  }
  return ct;
}

/// A grid of 21 x 21 x 11 voxels of 2 x 2 x 4 mm from (-20, -20, 0). With cells of 2 voxels it has 11 x 11 x 6
/// vertices, 4 x 4 x 8 mm apart.
inline Geometry small_grid() { return {.size = {21, 21, 11}, .spacing = {2, 2, 4}, .origin = {-20, -20, 0}}; }

/// A patient with one HU everywhere, so that the body is the whole volume.
inline Patient uniform_patient(double hu = 40) {
  const Volume<std::int16_t> ct = ct_of(small_grid(), [&](auto...) { return hu; });
  return examine(view(ct), nullptr, 2, -400);
}

/// Numbers of the vertices in a selection.
inline std::vector<std::size_t> numbers_of(const std::vector<std::uint8_t>& inside) {
  std::vector<std::size_t> numbers;
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (inside[n]) numbers.push_back(n);
  }
  return numbers;
}

inline Move move_of(std::variant<Zone, Handle> what, std::variant<Shift, Rotation, Force, Drag> how,
                    std::string entry) {
  return {std::move(what), std::move(how), std::move(entry)};
}

inline TissueClass tissue_of(std::string name, std::optional<HuRange> hu = {}, std::vector<std::int64_t> labels = {}) {
  TissueClass one;
  one.tissue.name = std::move(name);
  one.hu = hu;
  one.labels = std::move(labels);
  return one;
}

/// A scenario with one tissue and one phase, by ChainMail.
inline Scenario scenario_of(std::vector<HeldZone> hold, std::vector<Move> moves) {
  Scenario scenario;
  scenario.cell_size = 2;
  scenario.tissues = {tissue_of("tissue")};
  scenario.hold = std::move(hold);
  scenario.phases = {{.name = "only", .moves = std::move(moves), .closed_cuts = {}}};
  return scenario;
}

}  // namespace tetwarp::simulate::test
