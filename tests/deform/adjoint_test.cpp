// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>

#include "deform/adjoint.h"
#include "deform/core/adjoint.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/target_check.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/meshes.h"
#include "tests/support/reference_sample.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

using namespace test;

class Adjoints : public BackendTest {
 protected:
  std::unique_ptr<ResampleAdjoint> make_adjoint(const Geometry& output, int threads = 0) const {
    return GetParam().make_adjoint(output, Limits{.threads = threads});
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, Adjoints, testing::ValuesIn(backends()), backend_name);

template <class V>
Volume<V> noise(const Geometry& geometry, Random& random, double size = 1) {
  Volume<V> volume{geometry, std::vector<V>(static_cast<std::size_t>(voxel_count(geometry)))};
  for (V& voxel : volume.voxels) voxel = static_cast<V>(random.real(-size, size));
  return volume;
}

double dot(const auto& a, const auto& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += static_cast<double>(a[n]) * static_cast<double>(b[n]);
  return sum;
}

/// What a call of `apply` gives.
template <class V>
struct Gradients {
  Volume<V> source;
  std::vector<glm::vec3> displacement;
};

template <class V>
Gradients<V> apply(ResampleAdjoint& adjoint, const VertexField& field, const Volume<V>& source, const Volume<V>& given,
                   Interpolation interpolation = Interpolation::linear) {
  const bool moves = interpolation == Interpolation::linear;
  Gradients<V> found{poisoned<V>(source.geometry),
                     std::vector<glm::vec3>(static_cast<std::size_t>(vertex_count(view(field, Outside::background))))};
  const AdjointTarget target{.source = view(source),
                             .output_gradient = view(given),
                             .source_gradient = view(found.source),
                             .interpolation = interpolation};
  adjoint.apply({&target, 1}, {moves ? std::span(found.displacement) : std::span<glm::vec3>()});
  return found;
}

/// A grid other than the output's, that lies over its middle.
Geometry other_grid(const Geometry& output, Random& random) {
  Geometry grid = output;
  grid.size = glm::i64vec3(random.integer(5, 20), random.integer(5, 20), random.integer(5, 20));
  grid.spacing = output.spacing * random.real(0.6, 1.7);
  grid.direction = rotation({random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)}, random.real(0, 3));
  const glm::dvec3 middle = point_from_index(output)(glm::dvec3(output.size - std::int64_t{1}) * 0.5);
  grid.origin = glm::dvec3(0);
  grid.origin = middle - point_from_index(grid)(glm::dvec3(grid.size - std::int64_t{1}) * 0.5);
  if (random.chance(0.3)) {
    grid.slices.resize(static_cast<std::size_t>(grid.size.z));
    double at = 0;
    for (double& slice : grid.slices) slice = at += random.real(0.3, 1.7);
    const double mean = (grid.slices.back() - grid.slices.front()) / static_cast<double>(grid.size.z - 1),
                 first = grid.slices.front();
    for (double& slice : grid.slices) slice = (slice - first) / mean * grid.spacing.z;
  }
  return grid;
}

FieldCase random_case(Random& random) {
  if (random.chance(0.6)) return random_injective_case(random);
  return random_folding_case(random);
}

template <class V>
void expect_transpose(ForwardResampler& resampler, ResampleAdjoint& adjoint, const VertexField& field, Random& random) {
  const Geometry& output = resampler.output();
  const Volume<V> x = noise<V>(random.chance(0.5) ? output : other_grid(output, random), random);
  Interpolation interpolation = random.one_of({Interpolation::linear, Interpolation::nearest, Interpolation::cubic});
  if (interpolation == Interpolation::cubic && !x.geometry.slices.empty()) interpolation = Interpolation::linear;
  const Volume<V> y = noise<V>(output, random);
  Volume<V> forward = poisoned<V>(output);
  const Target target{.source = view(x), .output = view(forward), .interpolation = interpolation, .background = 0};
  resampler.resample(whole(output), {&target, 1});
  const Gradients<V> back = apply(adjoint, field, x, y, interpolation);
  const double norms = std::sqrt(dot(forward.voxels, forward.voxels) * dot(y.voxels, y.voxels));
  constexpr double kFew = 0x1p-21;  // rounding of a few values, where no more are covered
  EXPECT_LE(std::fabs(dot(forward.voxels, y.voxels) - dot(x.voxels, back.source.voxels)), 1e-6 * norms + kFew);
}

TEST_P(Adjoints, TheTransposeIsThatOfTheForwardPass) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(1000); ++number) {
    Random random(seed, 7000 + number);
    const FieldCase test = random_case(random);
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number) + ": " + test.description);
    const Outside outside = random.one_of({Outside::background, Outside::rest});
    const auto resampler = make(test.output);
    const auto adjoint = make_adjoint(test.output);
    resampler->set_field(view(test.field, outside));
    adjoint->set_field(view(test.field, outside));
    if (random.chance(0.7))
      expect_transpose<float>(*resampler, *adjoint, test.field, random);
    else
      expect_transpose<double>(*resampler, *adjoint, test.field, random);
    if (HasFailure()) return;
  }
}

/// The deformed volume as a function of where the vertices go, in double, nothing snapped, by owners that stay.
struct SmoothForward {
  const Geometry& output;
  const Volume<double>& source;
  std::vector<glm::dvec3> rest;  ///< output index
  std::vector<glm::u32vec4> tetrahedra;
  std::vector<std::uint32_t> owner;

  glm::dvec3 undeformed(const std::vector<glm::dvec3>& moved, const glm::dvec3& p, std::uint32_t number) const {
    const glm::u32vec4& t = tetrahedra[number];
    const glm::dvec3 d = rest[t.w] + moved[t.w];
    const glm::dmat3 edges(rest[t.x] + moved[t.x] - d, rest[t.y] + moved[t.y] - d, rest[t.z] + moved[t.z] - d);
    const glm::dvec3 b = glm::inverse(edges) * (p - d);
    return p - moved[t.w] - b.x * (moved[t.x] - moved[t.w]) - b.y * (moved[t.y] - moved[t.w]) -
           b.z * (moved[t.z] - moved[t.w]);
  }
  /// Sum of the deformed volume times `given`.
  double loss(const std::vector<glm::dvec3>& moved, const Volume<double>& given) const {
    const AffineMap source_index = index_from_point(source.geometry) * point_from_index(output);
    const std::vector<double> slices = uneven_slices(source.geometry);
    const UnevenSlices uneven{slices.empty() ? nullptr : slices.data(), std::ssize(slices)};
    double sum = 0;
    for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (owner[n] == kNoTetrahedron) return;
      glm::dvec3 at = source_index(undeformed(moved, glm::dvec3(voxel), owner[n]));
      if (uneven.at) at.z = uneven.index(at.z);
      const ReferenceSample sample = reference_sample(source, at, Interpolation::linear);
      if (sample.inside) sum += sample.value * given.voxels[n];
    });
    return sum;
  }
};

/// Rounds displacements to whole steps of a unit grid or a turned one, so that snapping changes none.
void snap_all(std::vector<glm::vec3>& displacement) {
  for (glm::vec3& d : displacement) d = glm::round(d * 2048.0f) / 2048.0f;
}

/// Compares the gradient of the displacement with differences of the smooth forward pass.
void expect_slopes(ForwardResampler& resampler, ResampleAdjoint& adjoint, const VertexField& field,
                   const Geometry& source_grid, Random& random) {
  const Geometry& output = resampler.output();
  resampler.set_field(view(field, Outside::background));
  adjoint.set_field(view(field, Outside::background));
  Volume<std::uint32_t> owners = poisoned<std::uint32_t>(output);
  resampler.resample(whole(output), {}, {.tetrahedra = view(owners)});
  const Volume<double> source = noise<double>(source_grid, random, 100), given = noise<double>(output, random);
  const Gradients<double> found = apply(adjoint, field, source, given);

  // Vertices of the lattice and of the mesh are two where they lie at one place.
  const TetrahedralMesh mesh = mesh_of(field);
  const AffineMap index = index_from_point(output);
  const std::size_t of_mesh = field.mesh.tetrahedra.size(), of_lattice = mesh.tetrahedra.size() - of_mesh;
  const std::size_t lattice_vertices = field.displacement.size();
  SmoothForward smooth{output, source, {}, mesh.tetrahedra, owners.voxels};
  std::vector<glm::dvec3> moved;
  for (std::size_t n = 0; n < lattice_vertices; ++n) {
    smooth.rest.push_back(index(mesh.rest[n]));
    moved.push_back(index.linear * glm::dvec3(field.displacement[n]));
  }
  for (std::size_t n = 0; n < field.mesh.rest.size(); ++n) {
    smooth.rest.push_back(index(field.mesh.rest[n]));
    moved.push_back(index.linear * glm::dvec3(field.mesh.displacement[n]));
  }
  for (std::size_t n = 0; n < of_mesh; ++n)
    smooth.tetrahedra[of_lattice + n] = field.mesh.tetrahedra[n] + static_cast<std::uint32_t>(lattice_vertices);
  ASSERT_EQ(found.displacement.size(), moved.size());

  double largest = 0;
  for (const glm::vec3& g : found.displacement)
    largest = std::max({largest, double(std::fabs(g.x)), double(std::fabs(g.y)), double(std::fabs(g.z))});
  EXPECT_GT(largest, 1);
  int wrong = 0, looked_at = 0;
  for (int tries = 0; tries < 40; ++tries) {
    const auto vertex = static_cast<std::size_t>(random.integer(0, std::ssize(moved) - 1));
    const int axis = random.axis();
    const auto slope = [&](double step) {
      std::vector<glm::dvec3> low = moved, high = moved;
      glm::dvec3 by(0);
      by[axis] = step;
      low[vertex] -= index.linear * by;
      high[vertex] += index.linear * by;
      return (smooth.loss(high, given) - smooth.loss(low, given)) / (2 * step);
    };
    const double fine = slope(1e-6), coarse = slope(1e-5);
    if (std::fabs(fine - coarse) > 2e-5 * largest) continue;  // a voxel passes a place where the slope jumps
    ++looked_at;
    if (std::fabs(double(found.displacement[vertex][axis]) - fine) > 1e-4 * largest) {
      ++wrong;
      ADD_FAILURE() << "vertex " << vertex << ", axis " << axis << ": found " << found.displacement[vertex][axis]
                    << ", by differences " << fine;
    }
    if (wrong > 3) return;
  }
  EXPECT_GT(looked_at, 10);
}

/// A grid along the axes of mm in another order, spaced by powers of two: places of whole steps stay exact.
Geometry turned_grid(const glm::i64vec3& size) {
  Geometry grid = unit_grid(size);
  grid.direction = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(0, 0, -1), glm::dvec3(-1, 0, 0));
  grid.spacing = {0.5, 2, 1};
  grid.origin = {5, -3, 8};
  return grid;
}

TEST_P(Adjoints, TheGradientOfTheDisplacementIsThatOfASmoothForwardPass) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(60); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9000 + number);
    const glm::i64vec3 size(random.integer(8, 14), random.integer(8, 14), random.integer(8, 14));
    const Geometry output = random.chance(0.5) ? unit_grid(size) : turned_grid(size);
    Geometry lattice = output;
    const auto cell = static_cast<double>(random.one_of<std::int64_t>({1, 2, 3, 4, 5, 8}));
    lattice.spacing = output.spacing * cell;
    for (int axis = 0; axis < 3; ++axis)
      lattice.size[axis] = static_cast<std::int64_t>(std::ceil(double(output.size[axis] - 1) / cell)) + 1;
    VertexField field = field_in_voxels(output, lattice, [&](const glm::dvec3&) {
      return 0.23 * cell * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)) + 0.3;
    });
    snap_all(field.displacement);
    const Geometry source = random.chance(0.5) ? output : other_grid(output, random);
    expect_slopes(*make(output), *make_adjoint(output), field, source, random);
    if (HasFailure()) return;
  }
}

TEST_P(Adjoints, TheSameHoldsOfMeshesAndOfLatticesWithReplacedCells) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(30); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9500 + number);
    const Geometry output = unit_grid({12, 11, 13});
    VertexField field;
    if (number % 2 == 0) {
      field = field_of(random_mesh(output, glm::dvec3(-1), glm::dvec3(13), 4, random));
      for (glm::dvec3& rest : field.mesh.rest) rest = glm::round(rest * 4096.0) / 4096.0;
      shake(field.mesh, output, 0.3, 0.3, random);
      snap_all(field.mesh.displacement);
    } else {  // one cell is a mesh of its own, whose vertices part from those of the lattice
      Geometry lattice = unit_grid({4, 4, 4});
      lattice.spacing = glm::dvec3(random.chance(0.5) ? 4.0 : 5.0);
      field = field_in_voxels(output, lattice, [&](const glm::dvec3&) {
        return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
      });
      snap_all(field.displacement);
      const TetrahedralMesh whole_mesh = mesh_of(field);
      const std::uint64_t cell = 13;  // (1, 1, 1) of three an axis
      field.replaced = {cell};
      std::vector<std::uint32_t> known(whole_mesh.rest.size(), UINT32_MAX);
      for (std::size_t t = 5 * cell; t < 5 * cell + 5; ++t) {
        glm::u32vec4 of;
        for (int corner = 0; corner < 4; ++corner) {
          std::uint32_t& vertex = known[whole_mesh.tetrahedra[t][corner]];
          if (vertex == UINT32_MAX) {
            vertex = static_cast<std::uint32_t>(field.mesh.rest.size());
            field.mesh.rest.push_back(whole_mesh.rest[whole_mesh.tetrahedra[t][corner]]);
            field.mesh.displacement.push_back(whole_mesh.displacement[whole_mesh.tetrahedra[t][corner]]);
            field.mesh.lattice_vertex.push_back(whole_mesh.tetrahedra[t][corner]);
          }
          of[corner] = vertex;
        }
        field.mesh.tetrahedra.push_back(of);
      }
      field.mesh.displacement.front() += glm::vec3(0.25f);
    }
    expect_slopes(*make(output), *make_adjoint(output), field, output, random);
    if (HasFailure()) return;
  }
}

TEST_P(Adjoints, AtTheIdentityTheSlopeIsTheMeanOfThatToBothSides) {
  const Geometry grid = unit_grid({9, 8, 7});
  for (const double cell : {1.0, 4.0}) {
    Geometry lattice = unit_grid({cell == 1 ? 9 : 3, cell == 1 ? 8 : 3, cell == 1 ? 7 : 3});
    lattice.spacing = glm::dvec3(cell);
    const VertexField field = uniform_field(lattice, glm::vec3(0));
    Volume<float> source{grid, {}}, given{grid, {}};
    for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
      source.voxels.push_back(static_cast<float>(v.x * v.x));
      given.voxels.push_back(v == glm::i64vec3(4, 4, 4) ? 1.0f : v == glm::i64vec3(8, 4, 4) ? 10.0f : 0.0f);
    });
    const auto adjoint = make_adjoint(grid);
    adjoint->set_field(view(field));
    const Gradients<float> found = apply(*adjoint, field, source, given);
    EXPECT_TRUE(same_bits(given.voxels, found.source.voxels)) << "the transpose of the identity";
    glm::vec3 sum(0);
    for (const glm::vec3& g : found.displacement) sum += g;
    // (25 - 9) / 2 in the middle; (64 - 49) / 2 at the border, beyond which the slope is 0.
    EXPECT_EQ(sum, glm::vec3(-8 - 75, 0, 0)) << "cells of " << cell;
  }
}

TEST_P(Adjoints, BetweenUnevenSlicesEachSideHasItsOwnSlope) {
  const Geometry output = unit_grid({5, 5, 6});
  Geometry grid = unit_grid({5, 5, 4});
  grid.slices = {0, 1, 3, 6};  // mm
  grid.spacing.z = 2;
  Volume<float> source{grid, {}}, given{output, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    const double z = grid.slices[static_cast<std::size_t>(v.z)];
    source.voxels.push_back(static_cast<float>(z * z));
  });
  for_each_voxel(output, [&](const glm::i64vec3& v, std::size_t) {
    given.voxels.push_back(v == glm::i64vec3(2, 2, 1) ? 1.0f : v == glm::i64vec3(2, 2, 2) ? 10.0f : 0.0f);
  });
  const VertexField field = uniform_field(unit_grid({5, 5, 6}), glm::vec3(0));
  const auto adjoint = make_adjoint(output);
  adjoint->set_field(view(field));
  const Gradients<float> found = apply(*adjoint, field, source, given);
  glm::vec3 sum(0);
  for (const glm::vec3& g : found.displacement) sum += g;
  // On the slice at 1: ((1 - 0) / 1 + (9 - 1) / 2) / 2 = 2.5; between those at 1 and 3: 4, by which 10 is multiplied.
  EXPECT_EQ(sum, glm::vec3(0, 0, -2.5f - 40));
}

/// A field of any kind over a grid: a lattice with or without folds, or a mesh.
FieldCase any_field(Random& random) {
  if (random.chance(0.7)) return random_case(random);
  FieldCase test;
  test.output = random.chance(0.5) ? unit_grid({12, 15, 11}) : oblique_grid({14, 9, 12});
  test.field = field_of(random_mesh(test.output, glm::dvec3(-1), glm::dvec3(13), 5, random));
  const double shaken = random.real(0.1, 2);
  shake(test.field.mesh, test.output, shaken, shaken, random);
  test.description = "a mesh shaken by " + std::to_string(shaken);
  return test;
}

template <class V>
void expect_bits_of_cpu(Random& random, const FieldCase& test, const auto& make_adjoint) {
  const Outside outside = test.field.lattice.size.x > 0 && random.chance(0.3) ? Outside::rest : Outside::background;
  Interpolation interpolation = Interpolation::linear;
  if (random.chance(0.3)) interpolation = random.chance(0.5) ? Interpolation::nearest : Interpolation::cubic;
  Geometry grid = random.chance(0.5) ? test.output : other_grid(test.output, random);
  if (interpolation == Interpolation::cubic) grid.slices.clear();
  const Volume<V> source = noise<V>(grid, random), given = noise<V>(test.output, random);
  const auto cpu = make_cpu_adjoint(test.output, {.threads = 1});
  cpu->set_field(view(test.field, outside));
  const Gradients<V> expected = apply(*cpu, test.field, source, given, interpolation);
  for (const int threads : {1, 2, 16}) {
    const auto adjoint = make_adjoint(test.output, threads);
    adjoint->set_field(view(test.field, outside));
    for (int run = 0; run < 4; ++run) {
      const Gradients<V> found = apply(*adjoint, test.field, source, given, interpolation);
      EXPECT_TRUE(same_bits(expected.source.voxels, found.source.voxels)) << threads << " threads, run " << run;
      EXPECT_TRUE(same_bits(expected.displacement, found.displacement)) << threads << " threads, run " << run;
    }
  }
}

TEST_P(Adjoints, EveryRunAndNumberOfThreadsGivesTheBitsOfTheCpu) {
  const std::uint64_t seed = test_seed();
  const auto make = [this](const Geometry& output, int threads) { return make_adjoint(output, threads); };
  for (std::uint64_t number = 0; number < test_cases(60) && !HasFailure(); ++number) {
    Random random(seed, 8000 + number);
    const FieldCase test = any_field(random);
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number) + ": " + test.description);
    if (random.chance(0.5))
      expect_bits_of_cpu<float>(random, test, make);
    else
      expect_bits_of_cpu<double>(random, test, make);
  }
}

TEST_P(Adjoints, WhatElseGoesThroughTheFieldChangesNoBitOfASource) {
  Random random(test_seed(), 6);
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({9, 8, 7});
  const VertexField field = uniform_field(grid, glm::vec3(0.3f));
  const Volume<float> one = noise<float>(grid, random), given = noise<float>(grid, random),
                      large = noise<float>(grid, random, 1e20);
  Volume<float> none = large;
  for (float& value : none.voxels) value = NAN;
  const auto adjoint = make_adjoint(grid);
  adjoint->set_field(view(field, Outside::background));
  const Gradients<float> alone = apply(*adjoint, field, one, given);
  Volume<float> gradient = poisoned<float>(grid), of_large = gradient, of_none = gradient;
  const AdjointTarget targets[] = {
      {.source = view(one), .output_gradient = view(large), .source_gradient = view(of_large)},
      {.source = view(one), .output_gradient = view(given), .source_gradient = view(gradient)},
      {.source = view(one), .output_gradient = view(none), .source_gradient = view(of_none)}};
  adjoint->apply(targets, {});
  EXPECT_TRUE(same_bits(alone.source.voxels, gradient.voxels));
  EXPECT_TRUE(std::isnan(of_none.voxels.front()) && std::isnan(of_none.voxels.back()));
  EXPECT_FALSE(std::isnan(of_large.voxels.front()));
}

TEST(WeightMaps, OfSliversAndSpecksAreThoseOfExactDeterminants) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 91);
  int slivers = 0, specks = 0;
  for (int n = 0; n < 20000; ++n) {
    // Flattened along an axis, or no larger than a few steps; about the voxel (20, 20, 20).
    const std::int64_t size = random.chance(0.5) ? random.integer(2, 60) : random.integer(4096, 8 * 4096);
    const int flat = random.axis();
    const std::int64_t thin = random.integer(1, 200);
    Tetrahedron t{};
    for (Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t reach = axis == flat ? std::min(size, thin) : size;
        v->deformed[axis] = static_cast<std::int32_t>(20 * kStepsPerVoxel + random.integer(-reach, reach));
      }
    }
    const glm::i32vec3 signs(random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1);
    const glm::i32vec3 steps(20 * kStepsPerVoxel);
    const ExactWeights exact = exact_weights(t, steps, signs);
    const double expected[4] = {exact.a, exact.b, exact.c, exact.d()};
    constexpr double kInside = -1e-12;
    if (!std::all_of(expected, expected + 4, [](double w) { return w >= kInside; })) continue;  // has another owner
    const WeightMap map(t);
    ++(size <= 60 ? specks : slivers);
    float weight[4];
    map.weights(
        glm::i64vec3(20), signs, [&] { return t; }, weight);
    for (int corner = 0; corner < 4; ++corner) EXPECT_NEAR(weight[corner], expected[corner], 2e-5) << "size " << size;
  }
  EXPECT_GT(slivers, 100);
  EXPECT_GT(specks, 100);
}

TEST_P(Adjoints, SeveralValuesAVoxelAreAddedUp) {
  Random random(test_seed(), 5);
  SCOPED_TRACE(seed_text(test_seed()));
  const FieldCase test = random_injective_case(random);
  const std::size_t voxels = static_cast<std::size_t>(voxel_count(test.output));
  const Volume<float> one = noise<float>(test.output, random), two = noise<float>(test.output, random, 50),
                      given_one = noise<float>(test.output, random), given_two = noise<float>(test.output, random);
  std::vector<float> both(2 * voxels), given(2 * voxels), gradient(2 * voxels);
  for (std::size_t n = 0; n < voxels; ++n) {
    both[2 * n] = one.voxels[n];
    both[2 * n + 1] = two.voxels[n];
    given[2 * n] = given_one.voxels[n];
    given[2 * n + 1] = given_two.voxels[n];
  }
  const auto view_of = [&](std::vector<float>& values) {
    return VolumeView{&test.output, whole(test.output), VoxelType::f32, 2,
                      std::as_writable_bytes(std::span(values)).data()};
  };
  const auto adjoint = make_adjoint(test.output);
  adjoint->set_field(view(test.field, Outside::background));
  std::vector<glm::vec3> together(static_cast<std::size_t>(vertex_count(view(test.field, Outside::background)))),
      apart = together;
  const AdjointTarget target{
      .source = view_of(both), .output_gradient = view_of(given), .source_gradient = view_of(gradient)};
  adjoint->apply({&target, 1}, {together});
  Volume<float> gradient_one = poisoned<float>(test.output), gradient_two = gradient_one;
  const AdjointTarget targets[] = {
      {.source = view(one), .output_gradient = view(given_one), .source_gradient = view(gradient_one)},
      {.source = view(two), .output_gradient = view(given_two), .source_gradient = view(gradient_two)}};
  adjoint->apply(targets, {apart});
  for (std::size_t n = 0; n < voxels; ++n) {  // but for the unit of each
    ASSERT_NEAR(gradient[2 * n], gradient_one.voxels[n], 1e-6);
    ASSERT_NEAR(gradient[2 * n + 1], gradient_two.voxels[n], 1e-6);
  }
  float largest = 0;
  for (const glm::vec3& g : apart) largest = std::max(largest, std::fabs(g.x));
  for (std::size_t n = 0; n < apart.size(); ++n)
    for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(together[n][axis], apart[n][axis], 1e-5f * largest);
}

TEST_P(Adjoints, SumsAreThoseOfWholeNumbersAsTheDefinitionSays) {
  const Geometry grid = unit_grid({7, 6, 5});
  const VertexField field = uniform_field(unit_grid({8, 7, 6}), glm::vec3(-0.75f, 0.375f, 0.5f));
  Random random(test_seed(), 77);
  SCOPED_TRACE(seed_text(test_seed()));
  const Volume<double> source = noise<double>(grid, random), given = noise<double>(grid, random, 1e5);
  const auto adjoint = make_adjoint(grid);
  adjoint->set_field(view(field, Outside::background));
  const Gradients<double> found = apply(*adjoint, field, source, given);
  const auto resampler = make(grid);
  resampler->set_field(view(field, Outside::background));
  Volume<std::uint32_t> owners = poisoned<std::uint32_t>(grid);
  resampler->resample(whole(grid), {}, {.tetrahedra = view(owners)});
  double largest = 0;
  for (std::size_t n = 0; n < owners.voxels.size(); ++n)
    if (owners.voxels[n] != kNoTetrahedron) largest = std::max(largest, std::fabs(given.voxels[n]));
  const int q = 62 - static_cast<int>(std::ceil(std::log2(static_cast<double>(voxel_count(grid)) * largest)));
  std::vector<std::int64_t> sums(source.voxels.size());
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (owners.voxels[n] == kNoTetrahedron) return;
    const glm::dvec3 at = glm::dvec3(voxel) + glm::dvec3(0.75, -0.375, -0.5), low = glm::floor(at);
    glm::dvec3 t = at - low;
    glm::i64vec3 base(low);
    for (int axis = 0; axis < 3; ++axis) {  // up to half a voxel outside counts as on the border
      const std::int64_t last = grid.size[axis] - 1;
      if (at[axis] < -0.5 || at[axis] > static_cast<double>(last) + 0.5) return;
      if (at[axis] < 0 || at[axis] > static_cast<double>(last)) {
        base[axis] = at[axis] < 0 ? 0 : last;
        t[axis] = 0;
      }
    }
    for (int corner = 0; corner < 8; ++corner) {
      const glm::i64vec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= step[axis] != 0 ? t[axis] : 1 - t[axis];
      if (weight == 0) continue;
      sums[offset_of(grid, base + step)] += std::llrint(std::ldexp(weight * given.voxels[n], q));
    }
  });
  for (std::size_t n = 0; n < sums.size(); ++n)
    ASSERT_EQ(found.source.voxels[n], std::ldexp(static_cast<double>(sums[n]), -q)) << n;
}

TEST_P(Adjoints, ATermThatIsNotFiniteMakesItsGradientNaN) {
  const Geometry grid = unit_grid({6, 6, 6});
  const VertexField field = uniform_field(unit_grid({7, 7, 7}), glm::vec3(0.25f));
  Random random(1);
  const Volume<float> source = noise<float>(grid, random);
  for (const float bad : {NAN, INFINITY}) {
    Volume<float> given = noise<float>(grid, random);
    given.voxels[86] = bad;
    const auto adjoint = make_adjoint(grid);
    adjoint->set_field(view(field));
    const Gradients<float> found = apply(*adjoint, field, source, given);
    EXPECT_TRUE(
        std::all_of(found.source.voxels.begin(), found.source.voxels.end(), [](float v) { return std::isnan(v); }));
    EXPECT_TRUE(std::all_of(found.displacement.begin(), found.displacement.end(),
                            [](const glm::vec3& v) { return std::isnan(v.x); }));
  }
  // What no voxel contributes does not count.
  const VertexField away = uniform_field(unit_grid({7, 7, 7}), glm::vec3(2, 0, 0));
  Volume<float> given = noise<float>(grid, random);
  given.voxels[0] = NAN;  // uncovered
  const auto adjoint = make_adjoint(grid);
  adjoint->set_field(view(away, Outside::background));
  const Gradients<float> found = apply(*adjoint, away, source, given);
  for (const float v : found.source.voxels) ASSERT_TRUE(std::isfinite(v));
  for (const glm::vec3& v : found.displacement) ASSERT_TRUE(std::isfinite(v.x));
}

TEST_P(Adjoints, HoldTermsThatOnlyDoubleHolds) {
  const Geometry grid = unit_grid({6, 6, 6});
  const VertexField field = uniform_field(unit_grid({7, 7, 7}), glm::vec3(0));
  const auto adjoint = make_adjoint(grid);
  adjoint->set_field(view(field));
  for (const double size : {1e308, 1e-290}) {
    const Volume<double> source{grid, std::vector<double>(216, 1.0)};
    Volume<double> given{grid, std::vector<double>(216, 0.0)};
    given.voxels[43] = size;
    const Gradients<double> found = apply(*adjoint, field, source, given);
    EXPECT_TRUE(same_bits(given.voxels, found.source.voxels)) << size;
  }
}

TEST_P(Adjoints, ProgressRisesToOne) {
  const Geometry grid = unit_grid({40, 40, 40});
  const VertexField field = uniform_field(unit_grid({41, 41, 41}), glm::vec3(0.25f));
  std::vector<double> shares;
  make_adjoint(grid)->set_field(view(field, Outside::background),
                                {.progress = [&](double done) { shares.push_back(done); }});
  ASSERT_FALSE(shares.empty());
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_EQ(shares.back(), 1);
}

TEST_P(Adjoints, OfNoVolumeIsZero) {
  const Geometry grid = oblique_grid({6, 6, 6});
  const VertexField field = uniform_field(grid, glm::vec3(0));
  const auto adjoint = make_adjoint(grid);
  adjoint->set_field(view(field));
  std::vector<glm::vec3> found(216, glm::vec3(NAN));
  adjoint->apply({}, {found});
  EXPECT_TRUE(same_bits(found, std::vector<glm::vec3>(216, glm::vec3(0))));
}

TEST_P(Adjoints, RefusesWhatHasNoGradient) {
  const Geometry grid = unit_grid({6, 6, 6});
  const VertexField field = uniform_field(grid, glm::vec3(0));
  Volume<float> source = poisoned<float>(grid), given = source, gradient = source;
  Volume<std::int16_t> whole_numbers = poisoned<std::int16_t>(grid);
  std::vector<glm::vec3> moved(source.voxels.size());
  const auto adjoint = make_adjoint(grid);
  const AdjointTarget good{.source = view(source), .output_gradient = view(given), .source_gradient = view(gradient)};
  const auto expect_refusal = [&](const AdjointTarget& target, bool moves, const std::string& word) {
    try {
      adjoint->apply({&target, 1}, {moves ? std::span(moved) : std::span<glm::vec3>()});
      ADD_FAILURE() << "expected a refusal: " << word;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {word}));
    }
  };
  expect_refusal(good, false, "set_field");
  adjoint->set_field(view(field));
  AdjointTarget bad = good;
  bad.source = bad.output_gradient = view(std::as_const(whole_numbers));
  expect_refusal(bad, false, "int16");
  bad = good;
  bad.interpolation = Interpolation::vote;
  expect_refusal(bad, false, "vote");
  for (const Interpolation kind : {Interpolation::nearest, Interpolation::cubic}) {
    bad.interpolation = kind;
    expect_refusal(bad, true, kind == Interpolation::nearest ? "nearest" : "cubic");
  }
  bad = good;
  bad.source.voxels = nullptr;
  expect_refusal(bad, true, "all voxels of the source");
  EXPECT_NO_THROW(adjoint->apply({&bad, 1}, {}));  // the volume's own gradient does not need them
  bad = good;
  bad.output_gradient.buffered.end.z = 3;
  expect_refusal(bad, false, "whole grid");
  bad = good;
  bad.output_gradient.components = 2;
  expect_refusal(bad, false, "values");
  moved.pop_back();
  expect_refusal(good, true, "215 vertices, and the field has 216");
}

/// Copies of three volumes of 216 floats, of which the source is not wanted for the volume's own gradient alone.
TEST_P(Adjoints, RefuseCopiesBeyondTheLimitOfADevice) {
  const Geometry grid = unit_grid({6, 6, 6});
  const VertexField field = uniform_field(grid, glm::vec3(0));
  Volume<float> source = poisoned<float>(grid), given{grid, std::vector<float>(216, 1.0f)}, gradient = source;
  std::vector<glm::vec3> moved(216);
  const AdjointTarget target{.source = view(source), .output_gradient = view(given), .source_gradient = view(gradient)};
  const auto adjoint = GetParam().make_adjoint(grid, Limits{.memory = 4 * (3 * 216 + 3 * 216) - 1});
  adjoint->set_field(view(field));
  adjoint->apply({&target, 1}, {});
  EXPECT_EQ(gradient.voxels[0], 1.0f);
  if (GetParam().name == "cpu") {
    EXPECT_NO_THROW(adjoint->apply({&target, 1}, {moved}));
    return;
  }
  try {
    adjoint->apply({&target, 1}, {moved});
    ADD_FAILURE() << "expected a refusal";
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"5184 bytes", "the limit is 5183", "not streamed"}));
  }
}

}  // namespace
}  // namespace tetwarp
