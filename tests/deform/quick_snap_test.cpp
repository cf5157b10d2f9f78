// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/quick_snap.h"

#include <gtest/gtest.h>

#include "deform/field_check.h"
#include "tests/support/fields.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

/// Displacements that move a vertex by so many steps on an axis: whole, halves, just beside halves, and any.
double random_steps(Random& random) {
  const double whole = static_cast<double>(random.integer(-3000000, 3000000));
  switch (random.integer(0, 5)) {
    case 0: return 0;
    case 1: return whole;
    case 2: return whole + 0.5;
    case 3: return whole + 0.5 + random.real(-1e-5, 1e-5);
    case 4: return random.real(-0.6, 0.6);
    default: return whole + random.real(0, 1);
  }
}

TEST(QuickSnap, GivesWhatSnapVertexGivesWhereItGivesAnything) {
  SCOPED_TRACE(seed_text(test_seed()));
  int usable = 0, given = 0, asked = 0;
  for (std::uint64_t n = 0; n < 300; ++n) {
    Random random(test_seed(), 600 + n);
    Geometry output = unit_grid({40, 30, 20});
    for (int axis = 0; axis < 3; ++axis) {
      output.spacing[axis] = random.chance(0.5) ? 1.0 : random.real(0.3, 3);
      output.origin[axis] = random.real(-300, 300);
    }
    Geometry lattice = lattice_over(output, random.integer(1, 5));
    if (random.chance(0.3)) lattice.origin += output.spacing * (random.real(0, 1) / 4096);  // between steps
    VertexField field{lattice, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(lattice)))};
    const LatticeFrame frame = make_lattice_frame(output, view(field, Outside::background));
    const QuickSnap quick(frame, make_step_lattice(frame, output));
    if (!quick.is_usable()) continue;
    ++usable;
    for (int vertex = 0; vertex < 200; ++vertex) {
      const glm::i64vec3 at(random.integer(0, frame.cells.x), random.integer(0, frame.cells.y),
                            random.integer(0, frame.cells.z));
      glm::vec3 displacement(0);
      for (int axis = 0; axis < 3; ++axis)
        displacement[axis] = static_cast<float>(random_steps(random) / kStepsPerVoxel * output.spacing[axis]);
      if (vertex == 7) displacement.y = std::numeric_limits<float>::quiet_NaN();
      if (vertex == 8) displacement.z = 1e30f;
      Vertex expected, found;
      const bool good = frame.snap_vertex(at, displacement, expected);
      ++asked;
      if (!quick.snap(glm::ivec3(at), displacement, found)) continue;
      ++given;
      ASSERT_TRUE(good);
      ASSERT_EQ(found.deformed, expected.deformed) << n;
      ASSERT_EQ(found.u, expected.u) << n;
    }
  }
  EXPECT_GT(usable, 100);
  EXPECT_GT(2 * given, asked);
}

}  // namespace
}  // namespace tetwarp::cpu
