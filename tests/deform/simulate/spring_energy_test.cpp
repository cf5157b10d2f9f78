// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "tests/support/springs.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

TEST(MassSpringEnergy, IsThatOfOneStretchedSpring) {
  Model model = make_model(lattice({2, 2, 2}), std::vector<std::uint8_t>(1, 0), tissues());
  std::fill(model.stiffness.begin(), model.stiffness.end(), 0.0f);
  model.stiffness[model.link(direction_up(0), 0)] = model.stiffness[model.link(opposite(direction_up(0)), 1)] = 3;
  std::vector<glm::vec3> u(8, glm::vec3(0));
  u[1] = {2, 0, 0};
  EXPECT_NEAR(energy(model, u), 6, 1e-12);
  EXPECT_NEAR(net_forces(model, u)[0].x, 6, 1e-12);
  EXPECT_NEAR(net_forces(model, u)[1].x, -6, 1e-12);
  u[1] = {-6, 8, 0};  // upright, 8 mm long
  EXPECT_NEAR(energy(model, u), 6, 1e-12);
  EXPECT_NEAR(net_forces(model, u)[0].y, 6, 1e-12);
}

}  // namespace
}  // namespace tetwarp::simulate
