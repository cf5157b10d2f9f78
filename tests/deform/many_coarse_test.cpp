// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Many small coarse fields of every kind, by every backend, each voxel against the oracle; on a device also bit for bit
// against the CPU. TETWARP_CHECKS is the number of fields a test looks at, and TETWARP_TEST_SEED says which.
#include <gtest/gtest.h>
#include <cmath>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>

#include "tests/support/against_oracle.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/instruction_set.h"
#include "tests/support/meshes.h"

namespace tetwarp {
namespace {

using namespace test;

class ManyCoarseFields : public BackendTest {
 protected:
  /// Looks at `make_field(random, output)` for many seeds, on a random instruction set each.
  template <class MakeField>
  void look(std::uint64_t usual, std::uint64_t stream, const MakeField& make_field) {
    const std::uint64_t count = number_from("TETWARP_CHECKS", test_cases(usual)), seed = test_seed();
    const std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
    std::uint64_t covered = 0;
    for (std::uint64_t number = 0; number < count && !HasFailure(); ++number) {
      Random random(seed, stream + number);
      const OnInstructionSet on(
          targets[static_cast<std::size_t>(random.integer(0, static_cast<std::int64_t>(targets.size()) - 1))]);
      SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
      const Geometry output = unit_grid({random.integer(2, 18), random.integer(2, 14), random.integer(2, 10)});
      const VertexField field = make_field(random, output);
      const Volume<float> source = smooth_source(output);
      const auto resampler = make(output, 1);
      resampler->set_field(view(field, Outside::background));
      const Outcome<float> found = run(*resampler, source);
      expect_like_oracle(found, source, Oracle(output, field));
      covered += found.report.covered;
      if (GetParam().name == "cpu") continue;
      const auto on_cpu = make_cpu_resampler(output);
      on_cpu->set_field(view(field, Outside::background));
      expect_same_outcome(run(*on_cpu, source), found);
    }
    EXPECT_GT(covered, 50 * count) << "fields are not to miss the output";
  }
};

INSTANTIATE_TEST_SUITE_P(Backends, ManyCoarseFields, testing::ValuesIn(backends()), backend_name);

/// From 2^low to 2^high, each power as likely.
double any_size(Random& random, double low, double high) { return std::exp2(random.real(low, high)); }

glm::dvec3 any_vector(Random& random) { return {random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)}; }

/// A matrix near one that turns, stretches, shears, mirrors or presses flat.
glm::dmat3 any_matrix(Random& random) {
  glm::dmat3 m(1);
  for (int column = 0; column < 3; ++column) m[column] += random.real(0, 1) * any_vector(random);
  const int axis = random.axis();
  if (random.chance(0.2)) m[axis] *= -1.0;
  if (random.chance(0.3)) m[axis] *= any_size(random, -16, 2);
  return m;
}

TEST_P(ManyCoarseFields, LatticesHaveTheOraclesVoxels) {
  look(250, 9'000'000, [](Random& random, const Geometry& output) {
    Geometry lattice;
    const bool whole_steps = random.chance(0.5);
    for (int axis = 0; axis < 3; ++axis) {
      lattice.spacing[axis] = whole_steps ? static_cast<double>(random.integer(3, 17)) : random.real(2.5, 20);
      lattice.origin[axis] = random.chance(0.5) ? 0 : random.real(-20, 3);
      const double span = static_cast<double>(output.size[axis] - 1) - lattice.origin[axis];
      lattice.size[axis] =
          std::max<std::int64_t>(2, static_cast<std::int64_t>(std::ceil(span / lattice.spacing[axis])) + 1);
    }
    const glm::dvec3 middle = 0.5 * glm::dvec3(output.size - std::int64_t{1});
    const glm::dmat3 turned = random.chance(0.4) ? any_matrix(random) : glm::dmat3(1);
    const double throws = random.chance(0.7) ? any_size(random, -12, 4) : 0,
                 waves = random.chance(0.5) ? any_size(random, -4, 3) : 0, resting = random.chance(0.3) ? 0.5 : 0;
    const glm::dvec3 whole_shift = random.chance(0.2) ? glm::round(4.0 * any_vector(random)) : glm::dvec3(0);
    const glm::dvec3 wave = any_vector(random);
    return field_in_voxels(output, lattice, [&](const glm::dvec3& x) {
      if (random.chance(resting)) return glm::dvec3(0);
      return turned * (x - middle) - (x - middle) + throws * any_vector(random) + waves * glm::sin(0.3 * x + wave) +
             whole_shift;
    });
  });
}

TEST_P(ManyCoarseFields, MeshesHaveTheOraclesVoxels) {
  look(250, 9'500'000, [](Random& random, const Geometry& output) {
    if (random.chance(0.2)) {
      return field_of(
          loose_tetrahedra(output, static_cast<int>(random.integer(1, 30)), any_size(random, 1, 8), random));
    }
    const glm::dvec3 beyond(random.chance(0.5) ? 0 : any_size(random, -2, 10));
    TetrahedralMesh mesh =
        random_mesh(output, -beyond, glm::dvec3(output.size) + beyond, static_cast<int>(random.integer(1, 5)), random);
    shake(mesh, output, random.chance(0.8) ? any_size(random, -12, 4) : 0, random.chance(0.3) ? 1 : 0, random);
    return field_of(std::move(mesh));
  });
}

}  // namespace
}  // namespace tetwarp
