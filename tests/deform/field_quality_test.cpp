// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/field_quality.h"

#include <gtest/gtest.h>
#include <cmath>
#include <glm/matrix.hpp>
#include <numeric>

#include "deform/fields/lattice_mesh.h"
#include "tests/support/fields.h"
#include "tests/support/instruction_set.h"
#include "tests/support/run.h"

namespace tetwarp {
namespace {

using namespace test;

/// A field that moves x to `to` x.
VertexField affine_field(const Geometry& lattice, const glm::dmat3& to) {
  VertexField field{lattice, {}};
  const AffineMap point = point_from_index(lattice);
  for (std::int64_t k = 0; k < lattice.size.z; ++k) {
    for (std::int64_t j = 0; j < lattice.size.y; ++j) {
      for (std::int64_t i = 0; i < lattice.size.x; ++i) {
        const glm::dvec3 x = point(glm::dvec3(i, j, k));
        field.displacement.emplace_back(to * x - x);
      }
    }
  }
  return field;
}

TEST(FieldQuality, OfAnAffineMapIsItsDeterminantAndLargestSingularValue) {
  const glm::dmat3 turn = rotation({1, 2, -0.5}, 0.8), other = rotation({-2, 1, 1}, 2.1);
  for (const glm::dvec3& stretches : {glm::dvec3(1.5, 1.1, 0.7), {0.3, 0.4, 0.2}, {3, 2, 1}, {1, 1, 1}, {1, 1, -1}}) {
    const glm::dmat3 to =
        turn * glm::dmat3(stretches.x, 0, 0, 0, stretches.y, 0, 0, 0, stretches.z) * glm::transpose(other);
    const Geometry lattice = oblique_grid({5, 4, 6});
    const FieldQuality quality = measure_quality(affine_field(lattice, to));
    const double determinant = stretches.x * stretches.y * stretches.z;
    for (std::size_t bin = 0; bin < quality.parts.size(); ++bin) {
      const bool above = bin == 0 || determinant >= FieldQuality::kEdges[bin - 1] - 1e-6,
                 below = bin == FieldQuality::kEdges.size() || determinant < FieldQuality::kEdges[bin];
      EXPECT_EQ(quality.parts[bin], above && below ? 6U * 4 * 3 * 5 : 0U) << determinant << " in bin " << bin;
    }
    EXPECT_NEAR(quality.largest_stretch, std::max({stretches.x, stretches.y, std::abs(stretches.z)}), 1e-4);
  }
}

TEST(FieldQuality, CountsWhatTheResamplerCountsAndAddsUpToTheLattice) {
  Random random(test_seed(), 3);
  const Geometry grid = unit_grid({20, 17, 15});
  VertexField field = field_in_voxels(grid, lattice_over(grid, 2), [&](const glm::dvec3& x) {
    if (x.x > 12) return glm::dvec3(0);
    return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field));
  const Report report = resampler->resample(whole(grid), {});
  const FieldQuality one = measure_quality(field, {.threads = 1}), quality = measure_quality(field);
  EXPECT_EQ(one.parts, quality.parts);
  EXPECT_EQ(one.largest_stretch, quality.largest_stretch);
  const glm::i64vec3 cells = field.lattice.size - std::int64_t{1};
  EXPECT_EQ(std::accumulate(quality.parts.begin(), quality.parts.end(), std::uint64_t{0}),
            static_cast<std::uint64_t>(6 * cells.x * cells.y * cells.z));
  // A tetrahedron has one sixth or two.
  EXPECT_GT(report.inverted, 0U);
  EXPECT_GE(quality.parts.front(), report.inverted);
  EXPECT_LE(quality.parts.front(), 2 * report.inverted);
  EXPECT_GT(quality.parts.back() + quality.parts[6], 0U);
  EXPECT_NE(verdict(report, quality, {}).find(std::to_string(report.inverted) + " tetrahedra are inverted"),
            std::string::npos);
}

TEST(FieldQuality, TheWorstPlaceIsThatOfTheTetrahedronThatIsTurnedInsideOut) {
  Random random(test_seed(), 8);
  const Geometry lattice = oblique_grid({9, 8, 7});
  VertexField field{lattice, {}};
  for (std::int64_t n = 0; n < voxel_count(lattice); ++n)
    field.displacement.emplace_back(random.real(-0.2, 0.2), random.real(-0.2, 0.2), random.real(-0.2, 0.2));
  const glm::i64vec3 vertex(5, 3, 4);
  const glm::dvec3 leap = 3.0 * point_from_index(lattice).linear[0];
  field.displacement[static_cast<std::size_t>((vertex.z * 8 + vertex.y) * 9 + vertex.x)] = leap;
  const std::optional<glm::dvec3> worst = worst_place(field);
  ASSERT_TRUE(worst.has_value());
  const glm::dvec3 index = index_from_point(lattice)(*worst);
  EXPECT_LT(glm::distance(index, glm::dvec3(vertex)), 3);
  VertexField as_mesh;
  as_mesh.mesh = mesh_of(field);
  EXPECT_EQ(worst_place(as_mesh), worst);
  EXPECT_EQ(worst_place(field, {.threads = 1}), worst);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(worst_place(field, {}, {.stop = stop.get_token()}), Cancelled);
}

TEST(FieldQuality, TheLargestStretchIsTheSameWhateverThreadTookWhichPart) {
  // Cells of one stretch to within rounding: which of them is the largest, to the last bit, is for rounding to say.
  const Geometry grid = unit_grid({40, 40, 60});
  const glm::dmat3 turn = rotation({1, 2, 3}, 0.7);
  VertexField lattice = field_in_voxels(grid, grid, [&](const glm::dvec3& x) { return 1.25 * (turn * x) - x; });
  VertexField mesh;
  mesh.mesh = mesh_of(lattice);
  mesh.mesh.lattice_vertex.clear();
  for (const VertexField* field : {&lattice, &mesh}) {
    const double one = measure_quality(*field, {.threads = 1}).largest_stretch;
    EXPECT_NEAR(one, 1.25, 1e-5);
    for (int run = 0; run < 20; ++run)
      EXPECT_EQ(measure_quality(*field, {.threads = 2 + run % 7}).largest_stretch, one);
  }
}

TEST(FieldQuality, TheLargestStretchOfAFieldIsThatOfItsPartsEachAlone) {
  // Stretches that are 1 to within rounding, each by other last bits. Of two such, the first that is met is kept; so a
  // part must not know what came before it.
  const Geometry grid = unit_grid({40, 40, 61});
  Random random(test_seed(), 4);
  VertexField lattice = field_in_voxels(grid, grid, [](const glm::dvec3&) { return glm::dvec3(0); });
  for (glm::vec3& u : lattice.displacement)
    u = glm::vec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)) * 3e-16F;
  const double whole_lattice = measure_quality(lattice, {.threads = 1}).largest_stretch;
  double largest = 0;
  for (std::int64_t z = 0; z + 2 < grid.size.z; z += 2) {  // an even slice, so that cells are divided as in the whole
    VertexField part;
    part.lattice = lattice.lattice;
    part.lattice.size.z = 3;
    const auto slice = static_cast<std::size_t>(grid.size.x * grid.size.y);
    const auto begin = lattice.displacement.begin() + static_cast<std::ptrdiff_t>(slice) * z;
    part.displacement.assign(begin, begin + static_cast<std::ptrdiff_t>(3 * slice));
    largest = std::max(largest, measure_quality(part, {.threads = 1}).largest_stretch);
  }
  EXPECT_EQ(whole_lattice, largest);

  VertexField mesh;
  mesh.mesh = mesh_of(lattice);
  mesh.mesh.lattice_vertex.clear();
  const double whole_mesh = measure_quality(mesh, {.threads = 1}).largest_stretch;
  const std::vector<glm::u32vec4> all = mesh.mesh.tetrahedra;
  constexpr std::size_t kPart = 4096;  // tetrahedra, as they are divided there
  largest = 0;
  for (std::size_t begin = 0; begin < all.size(); begin += kPart) {
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kPart, all.size()));
    mesh.mesh.tetrahedra.assign(all.begin() + static_cast<std::ptrdiff_t>(begin), end);
    largest = std::max(largest, measure_quality(mesh, {.threads = 1}).largest_stretch);
  }
  EXPECT_EQ(whole_mesh, largest);
}

/// Cells of a lattice are measured with vectors, tetrahedra of a mesh one after the other.
TEST(FieldQualityByVectors, IsThatOfTheLatticeAsAMeshOnEveryInstructionSet) {
  for (std::uint64_t number = 0; number < test_cases(24); ++number) {
    SCOPED_TRACE(seed_text(test_seed()) + ", case " + std::to_string(number));
    Random random(test_seed(), 50 + number);
    // Rows of one cell, of a few, and of more than are measured at a time; axes in general directions or not.
    const glm::i64vec3 size(number % 3 == 0 ? random.integer(2, 20) : random.integer(120, 300), random.integer(2, 5),
                            random.integer(2, 5));
    const Geometry grid = random.chance(0.5) ? oblique_grid(size) : Geometry{.size = size, .spacing = {0.7, 0.9, 3}};
    const double amplitude = random.real(0, 1), moving = random.real(0, 1);
    const bool is_smooth = random.chance(0.5);
    const VertexField lattice = field_in_voxels(grid, grid, [&](const glm::dvec3& x) {
      if (std::sin(0.3 * x.x) > moving) return glm::dvec3(0);
      if (is_smooth) return amplitude * glm::dvec3(std::sin(0.4 * x.y), std::cos(0.2 * x.x), std::sin(0.1 * x.x));
      return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    VertexField mesh;
    mesh.mesh = mesh_of(lattice);
    mesh.mesh.lattice_vertex.clear();
    const FieldQuality expected = measure_quality(mesh);
    const FieldQuality first = measure_quality(lattice);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      const OnInstructionSet on(target);
      const FieldQuality found = measure_quality(lattice);
      EXPECT_EQ(found.parts, first.parts);
      EXPECT_EQ(found.largest_stretch, first.largest_stretch);
    }
    EXPECT_NEAR(first.largest_stretch, expected.largest_stretch, 1e-5);
    for (std::size_t bin = 0; bin < first.parts.size(); ++bin)
      EXPECT_NEAR(first.shares()[bin], expected.shares()[bin], 1e-9) << "bin " << bin;
  }
}

TEST(FieldQuality, StretchOfAShearIsNotItsLongestColumn) {
  const FieldQuality quality =
      measure_quality(affine_field(unit_grid({3, 3, 3}), glm::dmat3(1, 0, 0, 1, 1, 0, 0, 0, 1)));
  EXPECT_NEAR(quality.largest_stretch, (1 + std::sqrt(5.0)) / 2, 1e-6);
  Report report;
  report.covered = 3;
  report.uncovered = 1;
  EXPECT_EQ(verdict(report, quality, {}),
            "No tetrahedron folds; 75.00 % of the voxels are covered; the largest stretch is 1.62 times.");
}

TEST(FieldQuality, TheVerdictWarnsOfAnInverseThatLeadsFurtherThanRounding) {
  FieldQuality quality;
  quality.largest_stretch = 3;
  Report report;
  report.covered = 1;
  RoundTrip trip;
  trip.step_mm = 0.001;
  trip.inverse_after_forward = {.points = 9, .mean = 0.1, .percentile_99 = 0.2, .largest = 0.25};
  trip.forward_after_inverse.largest = 0.0039;
  const std::string rest =
      "100.00 % of the voxels are covered; the largest stretch is 3.00 times; a vertex sent there and back by the "
      "inverse ends at most 0.25 mm from its place.";
  EXPECT_EQ(verdict(report, quality, trip), "No tetrahedron folds; " + rest);
  trip.forward_after_inverse.largest = 0.5;
  EXPECT_EQ(verdict(report, quality, trip),
            "Do not trust it: the inverse leads up to 0.5 mm beside a voxel, where rounding explains 0.004; " + rest);
}

}  // namespace
}  // namespace tetwarp
