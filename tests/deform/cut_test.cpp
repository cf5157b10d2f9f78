// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <map>

#include "deform/errors.h"
#include "deform/field_quality.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/points.h"
#include "deform/simulate/cuts/cut_surface.h"
#include "deform/simulate/divided_lattice.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/oracle.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

using namespace test;
using namespace simulate;

TETWARP_BACKEND_SUITE(Cuts);

/// Along i, j, k, whatever the grid's frame.
Cut cut_in_index(const Geometry& grid, Cut cut) {
  const AffineMap point = point_from_index(grid);
  const auto along = [&](const glm::dvec3& v) { return point.linear * v; };
  const auto across = [&](const glm::dvec3& v) { return glm::transpose(glm::inverse(point.linear)) * v; };
  if (auto* plane = std::get_if<PlaneCut>(&cut.shape)) *plane = {point(plane->point), across(plane->normal)};
  if (auto* disc = std::get_if<DiscCut>(&cut.shape)) {
    disc->centre = point(disc->centre);
    disc->normal = across(disc->normal);
  }
  if (auto* swept = std::get_if<SweptCut>(&cut.shape)) {
    for (glm::dvec3& p : swept->path) p = point(p);
    swept->sweep = along(swept->sweep);
  }
  return cut;
}

Cut random_cut(Random& random, const Geometry& grid) {
  const glm::dvec3 last(grid.size - std::int64_t{1});
  const auto place = [&] {
    return last * glm::dvec3(random.real(0.1, 0.9), random.real(0.1, 0.9), random.real(0.1, 0.9));
  };
  const auto direction = [&] { return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(0.1, 1)); };
  switch (random.integer(0, 2)) {
    case 0: return cut_in_index(grid, {"plane", PlaneCut{place(), direction()}});
    case 1: return cut_in_index(grid, {"disc", DiscCut{place(), direction(), random.real(0.1, 0.6) * last.x}});
    default: return cut_in_index(grid, {"swept", SweptCut{{place(), place(), place()}, 20.0 * direction()}});
  }
}

std::vector<Cut> random_cuts(Random& random, const Geometry& grid) {
  std::vector<Cut> cuts;
  for (std::int64_t n = random.integer(1, 3); n > 0; --n) cuts.push_back(random_cut(random, grid));
  return cuts;
}

/// Where a vertex of a lattice is, i fastest.
glm::dvec3 index_of(const Geometry& lattice, std::uint32_t vertex) {
  const glm::i64vec3& size = lattice.size;
  return glm::dvec3(vertex % size.x, vertex / size.x % size.y, vertex / (size.x * size.y));
}

/// A lattice over a grid of which every vertex rests half a step of 2^-12 voxel from a place that it may be snapped to.
Geometry lattice_at_ties(const Geometry& grid, std::int64_t cell) {
  constexpr double kHalfStep = 0.5 / 4096;
  Geometry lattice = lattice_over(grid, cell);
  lattice.size += std::int64_t{1};
  lattice.origin = point_from_index(grid)(glm::dvec3(-1 + kHalfStep));
  return lattice;
}

/// A smooth displacement of a lattice's vertices, and of the nodes of its division: each copy goes where its vertex
/// goes, so that cuts stay closed.
struct Closed {
  VertexField whole, divided;
  DividedLattice division;
};
Closed closed_cuts(const Geometry& grid, const Geometry& lattice, std::span<const Cut> cuts, double amplitude) {
  Closed result;
  result.whole = field_in_voxels(grid, lattice, [&](const glm::dvec3& x) {
    return amplitude * glm::dvec3(std::sin(0.11 * x.y), std::cos(0.13 * x.z), std::sin(0.09 * x.x + 0.05 * x.y));
  });
  result.division = divide(lattice, cuts);
  std::vector<glm::vec3> displacement = result.whole.displacement;
  for (const std::uint32_t vertex : result.division.copies_of) displacement.push_back(displacement[vertex]);
  result.divided = field_of(lattice, result.division, displacement);
  return result;
}

Volume<std::int16_t> hounsfield_like(const Geometry& grid) {
  Volume<std::int16_t> source{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    const glm::dvec3 x(v);
    source.voxels.push_back(
        static_cast<std::int16_t>(std::lround(700 * std::sin(0.7 * x.x) * std::cos(0.6 * x.y) + 500 * std::sin(x.z))));
  });
  return source;
}

/// NaN equals NaN.
template <class Value>
bool same_bits(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

/// Whether a voxel comes from within a replaced cell or right beside one, by where the uncut field takes it from.
class NearCut {
 public:
  explicit NearCut(const Closed& closed)
      : from_mm_(index_from_point(closed.whole.lattice)),
        cells_(closed.whole.lattice.size - std::int64_t{1}),
        replaced_(closed.divided.replaced.begin(), closed.divided.replaced.end()) {}
  bool operator()(const glm::dvec3& undeformed_mm) const {
    // Part of a cell: points so near to a face may lie on either side, by rounding of vertices.
    constexpr double kBeside = 0.02;
    const glm::dvec3 at = from_mm_(undeformed_mm);
    for (int n = 0; n < 8; ++n) {
      const glm::dvec3 to = at + kBeside * glm::dvec3(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1);
      const glm::i64vec3 cell = glm::clamp(glm::i64vec3(glm::floor(to)), glm::i64vec3(0), cells_ - std::int64_t{1});
      if (std::binary_search(replaced_.begin(), replaced_.end(),
                             static_cast<std::uint64_t>((cell.z * cells_.y + cell.y) * cells_.x + cell.x)))
        return true;
    }
    return false;
  }

 private:
  AffineMap from_mm_;
  glm::i64vec3 cells_;
  std::vector<std::uint64_t> replaced_;
};

TEST_P(Cuts, ClosedOnesChangeNothingAwayFromThemAndOneUnitAlongThem) {
  const std::uint64_t seed = test_seed();
  std::uint64_t along = 0, away = 0, beside = 0;
  for (std::uint64_t number = 0; number < test_cases(30) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9'000'000 + number);
    const glm::i64vec3 size(random.integer(20, 45), random.integer(20, 40), random.integer(15, 40));
    Geometry grid = random.chance(0.6) ? unit_grid(size) : oblique_grid(size);
    if (random.chance(0.5)) grid.spacing = {0.976562, 0.7, 2.3};
    const std::vector<Cut> cuts = random_cuts(random, grid);
    const std::int64_t cell = random.integer(2, 9);
    const Geometry lattice = random.chance(0.5) ? lattice_over(grid, cell) : lattice_at_ties(grid, cell);
    const Closed closed = closed_cuts(grid, lattice, cuts, random.chance(0.3) ? 0 : 1.5);
    const Volume<std::int16_t> source = hounsfield_like(grid);
    const auto resampler = make(grid);
    resampler->set_field(view(closed.whole, Outside::background));
    const auto whole_result = run(*resampler, source);
    resampler->set_field(view(closed.divided, Outside::background));
    const auto cut_result = run(*resampler, source);
    const NearCut near(closed);
    const AffineMap point = point_from_index(grid);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (HasFailure()) return;
      SCOPED_TRACE("voxel " + to_string(voxel));
      const bool is_covered = whole_result.coverage.voxels[n] == 1;
      if (cut_result.coverage.voxels[n] != is_covered) ++beside;
      if (!is_covered || cut_result.coverage.voxels[n] == 0) return;
      const glm::dvec3 from = point(glm::dvec3(voxel)) + glm::dvec3(whole_result.inverse_mm.voxels[n]);
      if (near(from)) {
        ++along;
        EXPECT_NEAR(whole_result.output.voxels[n], cut_result.output.voxels[n], 1);
      } else {
        ++away;
        EXPECT_EQ(whole_result.output.voxels[n], cut_result.output.voxels[n]);
        EXPECT_EQ(whole_result.inverse_mm.voxels[n], cut_result.inverse_mm.voxels[n]);
        EXPECT_EQ(whole_result.jacobian.voxels[n], cut_result.jacobian.voxels[n]);
      }
    });
    // All tetrahedra are counted. Splitting one keeps its determinant, but for rounding, which slivers show.
    EXPECT_LT(cut_result.report.jacobian_min, whole_result.report.jacobian_min + 0.1);
    EXPECT_GT(cut_result.report.jacobian_max, whole_result.report.jacobian_max - 0.1);
    // Slivers where cuts cross may be thinner than a step, a few in a hundred. One cut alone makes none.
    const std::size_t slivers = cuts.size() == 1 ? 0 : closed.divided.mesh.tetrahedra.size() / 50;
    EXPECT_LE(cut_result.report.inverted, slivers);
  }
  EXPECT_GT(along, 10000u);
  EXPECT_GT(away, 10000u);
  EXPECT_LE(beside, 5u);  // points near the deformed border where a cut meets it, whose vertices are rounded, too
}

TEST_P(Cuts, LatticeAndTheMeshThatItIsMadeIntoGiveTheSameBits) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(20) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9'400'000 + number);
    const glm::i64vec3 size(random.integer(12, 30), random.integer(12, 30), random.integer(10, 24));
    Geometry grid = random.chance(0.5) ? unit_grid(size) : oblique_grid(size);
    if (random.chance(0.7)) grid.spacing = {0.976562, 0.7, 2.3};
    const std::int64_t cell = random.integer(1, 7);
    const Geometry lattice = random.chance(0.5) ? lattice_over(grid, cell) : lattice_at_ties(grid, cell);
    const double amplitude = 0.3 * static_cast<double>(cell);
    const VertexField field = field_in_voxels(grid, lattice, [&](const glm::dvec3&) {
      return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    const VertexField mesh{.lattice = field.lattice, .displacement = {}, .mesh = mesh_of(field)};
    const Volume<std::int16_t> source = hounsfield_like(grid);
    const auto resampler = make(grid);
    resampler->set_field(view(field, Outside::background));
    const auto of_lattice = run(*resampler, source);
    resampler->set_field(view(mesh, Outside::background));
    const auto of_mesh = run(*resampler, source);
    EXPECT_EQ(of_lattice.output.voxels, of_mesh.output.voxels);
    EXPECT_EQ(of_lattice.coverage.voxels, of_mesh.coverage.voxels);
    EXPECT_EQ(of_lattice.owners.voxels, of_mesh.owners.voxels);
    EXPECT_TRUE(same_bits(of_lattice.inverse_mm.voxels, of_mesh.inverse_mm.voxels));
    EXPECT_TRUE(same_bits(of_lattice.jacobian.voxels, of_mesh.jacobian.voxels));
    EXPECT_EQ(of_lattice.report.jacobian_min, of_mesh.report.jacobian_min);
    EXPECT_EQ(of_lattice.report.jacobian_max, of_mesh.report.jacobian_max);
  }
}

TEST_P(Cuts, BothSidesOfAnOpenedPlaneAreWholeAndNothingIsBetween) {
  const Geometry grid = unit_grid({40, 36, 30});
  const Geometry lattice = lattice_over(grid, 5);
  const glm::dvec3 normal = glm::normalize(glm::dvec3(0.2, -0.3, 1)), middle(19.3, 17.1, 14.4);
  const std::vector<Cut> cuts{{"plane", PlaneCut{middle, normal}}};
  const CutSurface surface(cuts[0]);
  const DividedLattice division = divide(lattice, cuts);
  const glm::vec3 opening(0.5f, 1.25f, 4);  // the upper side goes away
  const AffineMap point = point_from_index(lattice);
  std::vector<glm::vec3> displacement;
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  for (std::uint32_t n = 0; n < vertices + division.copies_of.size(); ++n) {
    const std::uint32_t v = n < vertices ? n : division.copies_of[n - vertices];
    const double side = surface.side(point(index_of(lattice, v)));
    const bool is_above = (side > 0) == (n < vertices);  // a copy: of the other side
    displacement.push_back(is_above ? opening : glm::vec3(0));
  }
  const VertexField field = field_of(lattice, division, displacement);
  const Volume<std::int16_t> source = hounsfield_like(grid);
  const auto resampler = make(grid);
  resampler->set_field(view(field, Outside::background));
  const auto result = run(*resampler, source, {.background = -2000});
  std::uint64_t below = 0, above = 0, between = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    constexpr double kRounding = 0.05;  // mm: voxels so near to the cut may be on either side of it
    const glm::dvec3 at = point_from_index(grid)(glm::dvec3(voxel));
    const double of_lower = surface.side(at), of_upper = surface.side(at - glm::dvec3(opening));
    SCOPED_TRACE("voxel " + to_string(voxel));
    if (of_lower < -kRounding) {
      ++below;
      EXPECT_EQ(result.output.voxels[n], source.voxels[n]);
    } else if (of_upper > kRounding && glm::all(glm::greaterThanEqual(at - glm::dvec3(opening), glm::dvec3(0)))) {
      ++above;
      EXPECT_EQ(result.coverage.voxels[n], 1);
      const glm::vec3 back = result.inverse_mm.voxels[n] + opening;
      EXPECT_LT(glm::length(back), 1e-3);
    } else if (of_lower > kRounding && of_upper < -kRounding) {
      ++between;
      EXPECT_EQ(result.coverage.voxels[n], 0);
      EXPECT_EQ(result.output.voxels[n], -2000);
    }
  });
  EXPECT_GT(below, 15000u);
  EXPECT_GT(above, 10000u);
  EXPECT_GT(between, 3000u);
  EXPECT_EQ(result.report.multiply_owned.value_or(1), 0u);
}

TEST(CutPoints, GoWithTheirSideOfAnOpenCutAndComeFromTheVoxelsThatShowThem) {
  Geometry grid = oblique_grid({30, 26, 24});
  grid.spacing = {0.976562, 0.7, 2.3};
  const Geometry lattice = lattice_over(grid, 4);
  const Cut cut = cut_in_index(grid, {"plane", PlaneCut{{14.3, 12.1, 11.4}, {0.2, -0.3, 1}}});
  const DividedLattice division = divide(lattice, std::span(&cut, 1));
  const CutSurface surface(cut);
  const AffineMap point = point_from_index(lattice);
  const glm::vec3 above(1, 2, 3), below(-2, 0.5f, -1);  // mm
  std::vector<glm::vec3> displacement;
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  for (std::uint32_t n = 0; n < vertices + division.copies_of.size(); ++n) {
    const std::uint32_t v = n < vertices ? n : division.copies_of[n - vertices];
    displacement.push_back((surface.side(point(index_of(lattice, v))) > 0) == (n < vertices) ? above : below);
  }
  const VertexField field = field_of(lattice, division, displacement);
  ASSERT_GT(field.replaced.size(), 20u);
  const PointMover mover(grid, view(field, Outside::background));
  // Memory that is given back and taken anew shows a mover that looks at what is gone.
  std::vector<std::vector<glm::u32vec4>> other(64, std::vector<glm::u32vec4>(4096, glm::u32vec4(0)));
  const AffineMap of_grid = point_from_index(grid);
  const double step = 4 * glm::length(of_grid.linear * glm::dvec3(1)) / 4096;
  std::size_t counts[2] = {0, 0};
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t) {
    const glm::dvec3 at = of_grid(glm::dvec3(voxel));
    const double side = surface.side(at);
    if (std::fabs(side) < 0.05) return;
    glm::dvec3 moved = at;
    ASSERT_EQ(mover.move(moved), PointStatus::moved) << to_string(voxel);
    EXPECT_LT(glm::distance(moved, at + glm::dvec3(side > 0 ? above : below)), step) << to_string(voxel);
    ++counts[side > 0];
  });
  EXPECT_GT(counts[0], 4000u);
  EXPECT_GT(counts[1], 4000u);
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field, Outside::background));
  const RoundTrip trip = measure_round_trip(*resampler, field);
  EXPECT_GT(trip.forward_after_inverse.points, 8000u);
  EXPECT_LT(trip.forward_after_inverse.largest, 4 * step);
}

/// An opening within a disc that closes towards its rim.
VertexField opened_disc(const Geometry& lattice, const Cut& cut, double opening, DividedLattice& division) {
  const CutSurface surface(cut);
  const auto& disc = std::get<DiscCut>(cut.shape);
  division = divide(lattice, std::span(&cut, 1));
  const AffineMap point = point_from_index(lattice);
  const glm::dvec3 normal = glm::normalize(disc.normal);
  std::vector<glm::vec3> displacement;
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  for (std::uint32_t n = 0; n < vertices + division.copies_of.size(); ++n) {
    const std::uint32_t v = n < vertices ? n : division.copies_of[n - vertices];
    const glm::dvec3 at = point(index_of(lattice, v));
    const double side = surface.side(at), across = glm::length(at - disc.centre - side * normal);
    const double part = std::max(0.0, 1 - across / disc.radius_mm) * std::max(0.0, 1 - std::fabs(side) / 12);
    displacement.emplace_back(((side > 0) == (n < vertices) ? 1.0 : -1.0) * part * opening * normal);
  }
  return field_of(lattice, division, displacement);
}

TEST_P(Cuts, AnOpenedDiscLeavesAHoleWithinItsRimAndNoneElsewhere) {
  const Geometry grid = unit_grid({48, 44, 40});
  const Geometry lattice = lattice_over(grid, 4);
  const Cut cut{"disc", DiscCut{{23.3, 21.2, 19.6}, {0.1, 0.25, 1}, 14}};
  DividedLattice division;
  const VertexField field = opened_disc(lattice, cut, 2.5, division);
  const Volume<std::int16_t> source = hounsfield_like(grid);
  const auto resampler = make(grid);
  resampler->set_field(view(field, Outside::background));
  const auto result = run(*resampler, source, {.background = -2000});
  const CutSurface surface(cut);
  std::uint64_t open = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (result.coverage.voxels[n] == 1) {
      EXPECT_GT(result.jacobian.voxels[n], 0.2);
      EXPECT_LT(result.jacobian.voxels[n], 2);
      return;
    }
    ++open;
    const glm::dvec3 at(voxel);
    EXPECT_LT(glm::length(at - std::get<DiscCut>(cut.shape).centre), 14 + 4) << to_string(voxel);  // a cell more
    EXPECT_LT(std::fabs(surface.side(at)), 2.5) << to_string(voxel);
  });
  EXPECT_GT(open, 500u);
  EXPECT_EQ(result.report.inverted, 0u);
}

TEST(CutLattice, PiecesHaveTheVolumeOfTheirCellsAndNoLinkGoesThroughTheCut) {
  const std::uint64_t seed = test_seed();
  std::size_t copies = 0;
  for (std::uint64_t number = 0; number < 40 && !testing::Test::HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9'500'000 + number);
    const Geometry lattice = unit_grid({random.integer(4, 9), random.integer(4, 9), random.integer(4, 9)});
    const std::vector<Cut> cuts = random_cuts(random, lattice);
    const DividedLattice division = divide(lattice, cuts);
    copies += division.copies_of.size();
    std::map<std::uint64_t, double> volume;
    for (const CellPiece& piece : division.pieces) volume[piece.cell] += piece.volume;
    for (const auto& [cell, sum] : volume) EXPECT_NEAR(sum, 1, 1e-9) << cell;
    const glm::i64vec3 cells = lattice.size - std::int64_t{1};
    const std::vector<std::uint8_t> tissue(static_cast<std::size_t>(cells.x * cells.y * cells.z), 0);
    const std::vector<Tissue> tissues{{.name = "soft"}};
    const Model model = make_model(lattice, tissue, tissues, division.copies_of, division.pieces);
    for (int d = 0; d < kDirections; ++d) {
      for (std::size_t n = 0; n < model.nodes(); ++n) {
        const std::int32_t other = model.neighbour[model.link(d, n)];
        if (other < 0) continue;
        EXPECT_EQ(model.neighbour[model.link(opposite(d), static_cast<std::size_t>(other))],
                  static_cast<std::int32_t>(n));
      }
    }
  }
  EXPECT_GT(copies, 500u);
}

TEST(CutLattice, ClosedTetrahedraMeetFaceToFaceOrAtTheBorder) {
  const std::uint64_t seed = test_seed();
  std::uint64_t inner = 0;
  for (std::uint64_t number = 0; number < 30 && !testing::Test::HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 9'700'000 + number);
    const Geometry lattice = unit_grid({random.integer(4, 8), random.integer(4, 8), random.integer(4, 8)});
    const std::vector<Cut> cuts = random_cuts(random, lattice);
    const DividedLattice division = divide(lattice, cuts);
    const std::vector<glm::vec3> rest(static_cast<std::size_t>(voxel_count(lattice)) + division.copies_of.size());
    const TetrahedralMesh mesh = mesh_of(field_of(lattice, division, rest));
    const auto key = [&](std::uint32_t n) { return std::array{mesh.rest[n].x, mesh.rest[n].y, mesh.rest[n].z}; };
    std::map<std::array<std::array<double, 3>, 3>, int> faces;
    for (const glm::u32vec4& t : mesh.tetrahedra) {
      for (int left_out = 0; left_out < 4; ++left_out) {
        std::array face{key(t[(left_out + 1) % 4]), key(t[(left_out + 2) % 4]), key(t[(left_out + 3) % 4])};
        std::sort(face.begin(), face.end());
        ++faces[face];
      }
    }
    const glm::dvec3 last(lattice.size - std::int64_t{1});
    for (const auto& [face, count] : faces) {
      bool is_border = false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const double at : {0.0, last[static_cast<int>(axis)]})
          is_border |= std::all_of(face.begin(), face.end(),
                                   [&](const auto& corner) { return std::fabs(corner[axis] - at) < 1e-9; });
      }
      inner += !is_border;
      EXPECT_EQ(count, is_border ? 1 : 2)
          << face[0][0] << ' ' << face[0][1] << ' ' << face[0][2] << ", " << cuts.size() << " cuts";
    }
  }
  EXPECT_GT(inner, 20000u);
}

TEST(CutLattice, APlaneBetweenTwoLayersHasCopiesOnBothSidesAndNoLinkBetweenTheVertices) {
  const Geometry lattice = unit_grid({4, 5, 6});
  const Cut cut{"plane", PlaneCut{{0, 0, 2.4}, {0, 0, 1}}};
  const DividedLattice division = divide(lattice, std::span(&cut, 1));
  EXPECT_EQ(division.copies_of.size(), 2u * 20);
  EXPECT_EQ(division.pieces.size(), 2u * 12);
  EXPECT_EQ(division.replaced.size(), 12u);
  double lower = 0, upper = 0;
  for (const CellPiece& piece : division.pieces) (piece.node[0] < 120 ? lower : upper) += piece.volume;
  EXPECT_NEAR(lower, 12 * 0.4, 1e-9);
  EXPECT_NEAR(upper, 12 * 0.6, 1e-9);
  const std::vector<std::uint8_t> tissue(60, 0);
  const std::vector<Tissue> tissues{{.name = "soft"}};
  const Model model = make_model(lattice, tissue, tissues, division.copies_of, division.pieces);
  for (std::size_t n = 40; n < 60; ++n) {  // the layer below the cut
    const std::int32_t up = model.neighbour[model.link(direction_up(2), n)];
    ASSERT_GE(up, 120);
    EXPECT_EQ(model.vertex[static_cast<std::size_t>(up)], n + 20);
    EXPECT_LT(model.neighbour[model.link(direction_up(2), static_cast<std::size_t>(up))], 0);
  }
}

TEST(CutLattice, ADiscWithinOneCellDividesNothingAndFarCutsAreNotThere) {
  const Geometry lattice = unit_grid({5, 5, 5});
  for (const Cut& cut :
       {Cut{"small", DiscCut{{1.1, 1.1, 2.5}, {0, 0, 1}, 0.2}}, Cut{"far", PlaneCut{{0, 0, 20}, {0, 0, 1}}}}) {
    const DividedLattice division = divide(lattice, std::span(&cut, 1));
    EXPECT_TRUE(division.copies_of.empty()) << cut.name;
    EXPECT_TRUE(division.pieces.empty()) << cut.name;
    EXPECT_TRUE(division.replaced.empty()) << cut.name;
  }
}

TEST(CutLattice, CutsThatAreNoneAreRefused) {
  const Geometry lattice = unit_grid({5, 5, 5});
  const auto refused = [&](const Cut& cut) {
    try {
      divide(lattice, std::span(&cut, 1));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(says(refused({"a", PlaneCut{{0, 0, 0}, {0, 0, 0}}}), {"\"a\"", "normal", "length 0"}));
  EXPECT_TRUE(says(refused({"b", DiscCut{{0, 0, 0}, {0, 0, 1}, -3}}), {"\"b\"", "radius", "-3"}));
  EXPECT_TRUE(says(refused({"c", SweptCut{{{1, 1, 1}}, {0, 0, 1}}}), {"\"c\"", "path of 1 points"}));
  EXPECT_TRUE(says(refused({"d", SweptCut{{{1, 1, 1}, {1, 1, 3}}, {0, 0, 1}}}), {"\"d\"", "across the sweep"}));
  EXPECT_TRUE(says(refused({"e", DiscCut{{NAN, 0, 0}, {0, 0, 1}, 3}}), {"\"e\"", "not finite"}));
}

TEST(CutSurfaces, TellSidesOfABentBladeAndWhereItEnds) {
  const CutSurface blade({"blade", SweptCut{{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, {0, 0, 5}}});
  EXPECT_GT(blade.side({5, 1, 2}), 0);
  EXPECT_LT(blade.side({5, -1, 2}), 0);
  EXPECT_GT(blade.side({9, 5, 2}), 0);
  EXPECT_LT(blade.side({11, 5, 2}), 0);
  EXPECT_LT(blade.side({11, -1, 2}), 0);
  EXPECT_TRUE(blade.reaches({5, 0, 0.1}));
  EXPECT_FALSE(blade.reaches({5, 0, -0.1}));
  EXPECT_FALSE(blade.reaches({5, 0, 5.1}));
  EXPECT_FALSE(blade.reaches({-0.1, 0, 2}));
  EXPECT_TRUE(blade.reaches({10, 9.9, 2}));
  EXPECT_FALSE(blade.reaches({10, 10.1, 2}));
  const CutSurface tube({"tube", SweptCut{{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}}, {0, 0, 5}, true}});
  EXPECT_GT(tube.side({5, 5, 2}), 0);
  EXPECT_LT(tube.side({-1, 5, 2}), 0);
  EXPECT_LT(tube.side({12, 12, 2}), 0);
  EXPECT_TRUE(tube.reaches({0, 5, 2}));
}

}  // namespace
}  // namespace tetwarp
