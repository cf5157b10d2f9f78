// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/default_scenario.h"

#include <limits>

namespace tetwarp::viewer {

using namespace simulate;

namespace {

/// With more vertices ChainMail takes longer than a frame may: 15 ms for 30 000 on two cores, 2 ms for 400 000 on an
/// H100.
constexpr std::int64_t kMostVertices = 30000, kMostVerticesOnDevice = 400000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TissueClass tissue(const char* name, double stiffness_kpa, double compression, double stretch, double shear,
                   std::optional<HuRange> hu) {
  return {{.name = name,
           .youngs_modulus_kpa = stiffness_kpa,
           .compression = compression,
           .stretch = stretch,
           .shear = shear},
          hu,
          {}};
}

}  // namespace

Scenario default_scenario(const Geometry& volume, bool has_device) {
  Scenario scenario;
  scenario.cell_size = 8;
  while (voxel_count(lattice_over(straightened(volume), scenario.cell_size)) >
         (has_device ? kMostVerticesOnDevice : kMostVertices))
    scenario.cell_size *= 2;
  scenario.name = "by hand";
  scenario.tissues = {tissue("bone", 300, 0.02, 0.02, 0.3, HuRange{400, kInfinity}),
                      tissue("air", 0.5, 0.9, 4, 4, HuRange{-kInfinity, -950}),
                      tissue("lung", 2, 0.4, 0.4, 0.5, HuRange{-950, -400}),
                      tissue("soft tissue", 10, 0.2, 0.2, 0.4, {})};
  scenario.hold = {{{Border{}}, "hold[0] \"border\""}};
  scenario.stop = {.motion_mm = 0.05, .residual = 1e-3, .steps = 4};
  return scenario;
}

}  // namespace tetwarp::viewer
