// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/mesh_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "deform/errors.h"
#include "tests/support/random.h"
#include "tests/support/says.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::test;

using Corners = std::vector<std::uint32_t>;
using Triangle = std::array<std::uint32_t, 3>;

constexpr std::array<glm::ivec3, 8> kCube = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};

double volume(const glm::u32vec4& t, const std::vector<glm::dvec3>& points) {
  const glm::dvec3 a = points[t[0]];
  return glm::dot(glm::cross(points[t[1]] - a, points[t[2]] - a), points[t[3]] - a) / 6;
}

/// Triangles of the tetrahedra by their sorted vertices, and how often each is there.
std::map<Triangle, int> triangles_of(const std::vector<glm::u32vec4>& tetrahedra) {
  std::map<Triangle, int> triangles;
  for (const glm::u32vec4& t : tetrahedra) {
    for (int without = 0; without < 4; ++without) {
      Triangle triangle = {t[(without + 1) % 4], t[(without + 2) % 4], t[(without + 3) % 4]};
      std::sort(triangle.begin(), triangle.end());
      ++triangles[triangle];
    }
  }
  return triangles;
}

double area_of_once(const std::map<Triangle, int>& triangles, const std::vector<glm::dvec3>& points) {
  double area = 0;
  for (const auto& [t, times] : triangles) {
    if (times == 1) area += glm::length(glm::cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]])) / 2;
  }
  return area;
}

/// A block of unit cubes with vertices numbered at random: each column along k of hexahedra and sets of six pyramids,
/// or of wedges.
class Block {
 public:
  explicit Block(Random& random)
      : random_(random), size_(random.integer(1, 3), random.integer(1, 3), random.integer(1, 3)) {
    points_.resize(
        static_cast<std::size_t>((size_.x + 1) * (size_.y + 1) * (size_.z + 1) + size_.x * size_.y * size_.z));
    numbers_.resize(points_.size());
    std::iota(numbers_.begin(), numbers_.end(), 0U);
    for (std::size_t n = numbers_.size(); n > 1; --n)
      std::swap(numbers_[n - 1],
                numbers_[static_cast<std::size_t>(random.integer(0, static_cast<std::int64_t>(n) - 1))]);
  }

  /// Calls use(shape, corners, volume) with every cell.
  template <class Use>
  void for_each_cell(const Use& use) {
    for (std::int64_t i = 0; i < size_.x; ++i) {
      for (std::int64_t j = 0; j < size_.y; ++j) {
        const int kind = static_cast<int>(random_.integer(0, 2));  // hexahedra and pyramids, wedges, wedges turned
        for (std::int64_t k = 0; k < size_.z; ++k) {
          Corners c;
          for (const glm::ivec3& at : kCube) c.push_back(vertex(glm::i64vec3(i, j, k) + glm::i64vec3(at)));
          if (kind == 1) {
            use(CellShape::wedge, {c[0], c[2], c[1], c[4], c[6], c[5]}, 0.5);
            use(CellShape::wedge, {c[0], c[3], c[2], c[4], c[7], c[6]}, 0.5);
          } else if (kind == 2) {
            use(CellShape::wedge, {c[1], c[3], c[2], c[5], c[7], c[6]}, 0.5);
            use(CellShape::wedge, {c[1], c[0], c[3], c[5], c[4], c[7]}, 0.5);
          } else if (random_.chance(0.5)) {
            use(CellShape::hexahedron, c, 1.0);
          } else {
            const std::uint32_t top = centre({i, j, k});
            for (const auto& face :
                 {std::array{0, 1, 2, 3}, {7, 6, 5, 4}, {4, 5, 1, 0}, {5, 6, 2, 1}, {6, 7, 3, 2}, {7, 4, 0, 3}})
              use(CellShape::pyramid, {c[face[0]], c[face[1]], c[face[2]], c[face[3]], top}, 1.0 / 6);
          }
        }
      }
    }
  }

  const std::vector<glm::dvec3>& points() const { return points_; }
  double surface() const {
    return 2.0 * static_cast<double>(size_.x * size_.y + size_.y * size_.z + size_.z * size_.x);
  }

 private:
  std::uint32_t placed(std::int64_t n, const glm::dvec3& at) {
    const std::uint32_t number = numbers_[static_cast<std::size_t>(n)];
    points_[number] = at;
    return number;
  }
  std::uint32_t vertex(const glm::i64vec3& at) {
    return placed(at.x + (size_.x + 1) * (at.y + (size_.y + 1) * at.z), glm::dvec3(at));
  }
  std::uint32_t centre(const glm::i64vec3& cell) {
    const std::int64_t vertices = (size_.x + 1) * (size_.y + 1) * (size_.z + 1);
    return placed(vertices + cell.x + size_.x * (cell.y + size_.y * cell.z), glm::dvec3(cell) + 0.5);
  }

  Random& random_;
  glm::i64vec3 size_;
  std::vector<glm::dvec3> points_;
  std::vector<std::uint32_t> numbers_;
};

TEST(MeshCells, MixedCellsAreSplitWithoutGapsWhateverTheirNumbers) {
  const std::uint64_t seed = test_seed(), cases = test_cases(300);
  SCOPED_TRACE(seed_text(seed));
  for (std::uint64_t n = 0; n < cases && !::testing::Test::HasFailure(); ++n) {
    Random random(seed, n);
    Block block(random);
    MeshCells cells("block");
    block.for_each_cell([&](CellShape shape, const Corners& corners, double expected) {
      const std::size_t before = cells.tetrahedra().size();
      cells.add(shape, corners, 1);
      double sum = 0;
      for (std::size_t t = before; t < cells.tetrahedra().size(); ++t) {
        const glm::u32vec4& tetrahedron = cells.tetrahedra()[t];
        for (int v = 0; v < 4; ++v) ASSERT_NE(std::find(corners.begin(), corners.end(), tetrahedron[v]), corners.end());
        ASSERT_GT(volume(tetrahedron, block.points()), 1e-6);
        sum += volume(tetrahedron, block.points());
      }
      ASSERT_NEAR(sum, expected, 1e-12);
    });
    const auto triangles = triangles_of(cells.tetrahedra());
    for (const auto& [triangle, times] : triangles) ASSERT_LE(times, 2);
    ASSERT_NEAR(area_of_once(triangles, block.points()), block.surface(), 1e-9)
        << "an inner triangle has one side only";
  }
}

TEST(MeshCells, AHexahedronIsSplitAtTheLowestVertexOfEachFaceInEveryNumbering) {
  std::vector<std::uint32_t> numbers(8);
  std::iota(numbers.begin(), numbers.end(), 0U);
  constexpr std::array<std::array<int, 4>, 6> kFaces = {
      {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
  do {
    std::vector<glm::dvec3> points(8);
    for (std::size_t n = 0; n < 8; ++n) points[numbers[n]] = glm::dvec3(kCube[n]);
    MeshCells cells("cube");
    cells.add(CellShape::hexahedron, numbers, 1);
    ASSERT_EQ(cells.tetrahedra().size(), 6U);
    double sum = 0;
    for (const glm::u32vec4& t : cells.tetrahedra()) {
      ASSERT_GT(volume(t, points), 0);
      sum += volume(t, points);
    }
    ASSERT_NEAR(sum, 1, 1e-12);
    const auto triangles = triangles_of(cells.tetrahedra());
    for (const auto& face : kFaces) {
      std::size_t low = 0;
      for (std::size_t n = 1; n < 4; ++n) low = numbers[face[n]] < numbers[face[low]] ? n : low;
      for (const std::size_t side : {low + 1, low + 3}) {
        Triangle half = {numbers[face[low]], numbers[face[(low + 2) % 4]], numbers[face[side % 4]]};
        std::sort(half.begin(), half.end());
        ASSERT_TRUE(triangles.contains(half) && triangles.at(half) == 1);
      }
    }
  } while (std::next_permutation(numbers.begin(), numbers.end()));
}

/// Volume of a hexahedron with repeated corners in every numbering of its vertices; it must have a closed surface.
void expect_collapsed(const std::array<int, 8>& corners, const std::vector<glm::dvec3>& places, double expected) {
  std::vector<std::uint32_t> numbers(places.size());
  std::iota(numbers.begin(), numbers.end(), 0U);
  do {
    std::vector<glm::dvec3> points(places.size());
    for (std::size_t n = 0; n < places.size(); ++n) points[numbers[n]] = places[n];
    Corners cell;
    for (const int corner : corners) cell.push_back(numbers[static_cast<std::size_t>(corner)]);
    MeshCells cells("collapsed");
    cells.add(CellShape::hexahedron, cell, 1);
    double sum = 0;
    for (const glm::u32vec4& t : cells.tetrahedra()) {
      ASSERT_GT(volume(t, points), 0);
      sum += volume(t, points);
    }
    ASSERT_NEAR(sum, expected, 1e-12);
    for (const auto& [triangle, times] : triangles_of(cells.tetrahedra())) ASSERT_LE(times, 2);
  } while (std::next_permutation(numbers.begin(), numbers.end()));
}

TEST(MeshCells, HexahedraCollapsedToOtherShapesKeepTheirVolume) {
  const glm::dvec3 a(0, 0, 0), b(1, 0, 0), c(1, 1, 0), d(0, 1, 0), e(0, 0, 1), f(1, 0, 1), h(0, 1, 1);
  expect_collapsed({0, 1, 2, 2, 3, 4, 5, 5}, {a, b, d, e, f, h}, 0.5);   // a wedge
  expect_collapsed({0, 1, 2, 3, 4, 4, 5, 5}, {a, b, c, d, e, h}, 0.5);   // a wedge lying on a side
  expect_collapsed({0, 1, 2, 3, 4, 4, 4, 4}, {a, b, c, d, e}, 1.0 / 3);  // a pyramid
  expect_collapsed({0, 1, 2, 2, 3, 3, 3, 3}, {a, b, d, e}, 1.0 / 6);     // a tetrahedron
  expect_collapsed({0, 1, 2, 3, 3, 3, 3, 3}, {a, b, d, e}, 1.0 / 6);     // a tetrahedron, another habit
}

TEST(MeshCells, CellsWithoutASolidAreRefusedByName) {
  const auto refusal = [](CellShape shape, const Corners& corners) -> std::string {
    try {
      MeshCells("a.msh").add(shape, corners, 17);
    } catch (const InputError& error) {
      return error.what();
    }
    return "taken";
  };
  const std::vector<std::string> why = {"no solid is left", "17, a.msh"};
  EXPECT_TRUE(says(refusal(CellShape::tetrahedron, {1, 2, 3, 1}), why));
  EXPECT_TRUE(says(refusal(CellShape::pyramid, {1, 2, 1, 2, 3}), why));
  EXPECT_TRUE(says(refusal(CellShape::wedge, {1, 2, 3, 1, 2, 3}), why));
  EXPECT_TRUE(says(refusal(CellShape::hexahedron, {1, 2, 3, 4, 1, 2, 3, 4}), why));
  EXPECT_TRUE(says(refusal(CellShape::hexahedron, {5, 5, 5, 5, 5, 5, 5, 5}), why));
  EXPECT_TRUE(
      says(refusal(CellShape::hexahedron, {1, 2, 3, 4}), {"4 vertices of the hexahedron 17, a.msh", "expected 8"}));
}

}  // namespace
