// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The bodies that every backend runs, here on the host and with fields of the tests' own.
#include "bench/paper/baselines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "tests/support/random.h"

namespace tetwarp::bench {
namespace {

using FieldFunction = std::function<glm::vec3(int, int, int, const glm::vec3&)>;

/// 3 x + 5 y - 2 z + 100: what linear interpolation of any kind gives back exactly, but for rounding.
float ramp(float x, float y, float z) { return 3 * x + 5 * y - 2 * z + 100; }

struct Written {
  int times = 0;
  std::vector<double> values;
};

struct Recorder {
  Grid grid;
  std::vector<Written>* voxels;

  template <class Real>
  void operator()(int x, int y, int z, Real value) const {
    Written& voxel = (*voxels)[static_cast<std::size_t>(grid.offset(x, y, z))];
    ++voxel.times;
    voxel.values.push_back(to_short(value));
  }
};

constexpr Grid kGrid{12, 10, 8, 12, 10, 8, 1};

template <class F>
void for_each_cell(const Grid& grid, F&& f) {
  for (int k = 0; k + 1 < grid.vertices_z; ++k) {
    for (int j = 0; j + 1 < grid.vertices_y; ++j) {
      for (int i = 0; i + 1 < grid.vertices_x; ++i) f(i, j, k);
    }
  }
}

template <class Method>
struct CellByCell {
  static std::vector<Written> run(const Grid& grid, const FieldFunction& field) {
    std::vector<Written> voxels(static_cast<std::size_t>(grid.nx * grid.ny * grid.nz));
    for_each_cell(grid, [&](int i, int j, int k) {
      deform_cell<Method, InverseIn::loop_as_compiled>(grid, i, j, k, field, ramp, Recorder{grid, &voxels});
    });
    return voxels;
  }
};

/// One block a tetrahedron, of `kThreads` threads.
struct Gascon {
  static constexpr int kThreads = 5;

  static std::vector<Written> run(const Grid& grid, const FieldFunction& field) {
    std::vector<Written> voxels(static_cast<std::size_t>(grid.nx * grid.ny * grid.nz));
    for_each_cell(grid, [&](int i, int j, int k) {
      for (int t = 0; t < kTetrahedraPerCell; ++t) {
        CellVertex corners[4];
        for (int n = 0; n < 4; ++n) corners[n] = make_tetrahedron_vertex(grid, field, i, j, k, t, n);
        for (int thread = 0; thread < kThreads; ++thread) {
          walk_tetrahedron<InverseIn::loop_as_compiled>(grid, corners, thread, kThreads, ramp, Recorder{grid, &voxels});
        }
      }
    });
    return voxels;
  }
};

glm::vec3 nowhere(int, int, int, const glm::vec3&) { return glm::vec3(0); }

/// A smooth field that keeps no plane in place.
glm::vec3 bulge(int, int, int, const glm::vec3& rest) {
  return {0.4f * std::sin(0.7f * rest.y + 0.3f * rest.z), 0.4f * std::sin(0.6f * rest.z + 0.2f * rest.x),
          0.4f * std::sin(0.5f * rest.x + 0.4f * rest.y)};
}

template <class Method>
class BenchMethod : public testing::Test {};
using Methods = testing::Types<CellByCell<Inverse4x4Double>, CellByCell<Inverse3x3Double>, CellByCell<Inverse3x3Float>,
                               CellByCell<Paper>, Gascon>;
TYPED_TEST_SUITE(BenchMethod, Methods);

// A vertex whose parity puts it into the centre of its eight cells belongs to 8 x 4 tetrahedra, any other to 8 x 1.
TYPED_TEST(BenchMethod, IdentityWritesInnerVoxelsEightOrThirtyTwoTimesAndLosesNone) {
  const std::vector<Written> voxels = TypeParam::run(kGrid, nowhere);
  std::uint64_t writes = 0, inner = 0;
  for (int z = 0; z < kGrid.nz; ++z) {
    for (int y = 0; y < kGrid.ny; ++y) {
      for (int x = 0; x < kGrid.nx; ++x) {
        const Written& voxel = voxels[static_cast<std::size_t>(kGrid.offset(x, y, z))];
        ASSERT_GE(voxel.times, 1) << x << " " << y << " " << z;
        for (const double value : voxel.values) ASSERT_EQ(value, ramp(float(x), float(y), float(z)));
        if (x == 0 || y == 0 || z == 0 || x == kGrid.nx - 1 || y == kGrid.ny - 1 || z == kGrid.nz - 1) continue;
        ASSERT_EQ(voxel.times, (x + y + z) % 2 ? 32 : 8) << x << " " << y << " " << z;
        writes += static_cast<std::uint64_t>(voxel.times);
        ++inner;
      }
    }
  }
  EXPECT_EQ(writes, 20 * inner);  // 20 on average
}

TYPED_TEST(BenchMethod, GenericTranslationGivesTheRampWithinRounding) {
  const glm::vec3 shift(0.31f, 0.22f, 0.13f);  // generic: no voxel on a face (0.3, 0.2, 0.1 has one, y + z - x = 1)
  const std::vector<Written> voxels = TypeParam::run(kGrid, [&](int, int, int, const glm::vec3&) { return shift; });
  for (int z = 0; z < kGrid.nz; ++z) {
    for (int y = 0; y < kGrid.ny; ++y) {
      for (int x = 0; x < kGrid.nx; ++x) {
        const Written& voxel = voxels[static_cast<std::size_t>(kGrid.offset(x, y, z))];
        const bool covered = x > 0 && y > 0 && z > 0;  // the lattice moved up
        ASSERT_EQ(voxel.times, covered ? 1 : 0) << x << " " << y << " " << z;
        for (const double value : voxel.values) {
          ASSERT_NEAR(value, ramp(float(x) - shift.x, float(y) - shift.y, float(z) - shift.z), 0.5 + 1e-3);
        }
      }
    }
  }
}

// If all cells were split alike the diagonals of a shared face would cross, and this field would open the face.
TYPED_TEST(BenchMethod, NeighbouringCellsCloseUpUnderASmoothField) {
  const std::vector<Written> voxels = TypeParam::run(kGrid, bulge);
  int lost = 0, multiple = 0;
  for (int z = 1; z + 1 < kGrid.nz; ++z) {
    for (int y = 1; y + 1 < kGrid.ny; ++y) {
      for (int x = 1; x + 1 < kGrid.nx; ++x) {
        const int times = voxels[static_cast<std::size_t>(kGrid.offset(x, y, z))].times;
        lost += times == 0;
        multiple += times > 1;
      }
    }
  }
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(multiple, 0);
}

TEST(BenchGascon, WritesWhatThePaperWrites) {
  const Grid coarse{21, 19, 17, 6, 6, 5, 4};
  const std::vector<Written> gascon = Gascon::run(coarse, bulge), paper = CellByCell<Paper>::run(coarse, bulge);
  ASSERT_EQ(gascon.size(), paper.size());
  std::uint64_t written = 0;
  for (std::size_t n = 0; n < paper.size(); ++n) {
    ASSERT_EQ(gascon[n].times, paper[n].times) << n;
    std::vector<double> left = gascon[n].values, right = paper[n].values;
    std::sort(left.begin(), left.end());
    std::sort(right.begin(), right.end());
    ASSERT_EQ(left, right) << n;
    written += paper[n].times > 0;
  }
  EXPECT_GT(written, 5000u);
}

template <class Real>
void expect_coordinates_of(Barycentric<Real> (*compute)(const Corners<Real>&, const Point<Real>&), double tolerance) {
  test::Random random(7);
  for (int n = 0; n < 1000; ++n) {
    const auto near = [&](double x, double y, double z) {
      return Point<Real>{Real(x + random.real(-0.3, 0.3)), Real(y + random.real(-0.3, 0.3)),
                         Real(z + random.real(-0.3, 0.3))};
    };
    const Corners<Real> t{near(101, 50, 70), near(100, 51, 70), near(100, 50, 71), near(100, 50, 70)};
    const Point<Real> p = near(100, 50, 70);
    const Barycentric<Real> at = compute(t, p);
    ASSERT_NEAR(at.a + at.b + at.c + at.d, 1, tolerance);
    ASSERT_NEAR(at.a * t.a.x + at.b * t.b.x + at.c * t.c.x + at.d * t.d.x, p.x, tolerance * 100);
    ASSERT_NEAR(at.a * t.a.y + at.b * t.b.y + at.c * t.c.y + at.d * t.d.y, p.y, tolerance * 100);
    ASSERT_NEAR(at.a * t.a.z + at.b * t.b.z + at.c * t.c.z + at.d * t.d.z, p.z, tolerance * 100);
  }
}

TEST(BenchInverse, CoordinatesGiveThePointBack) {
  expect_coordinates_of<double>(barycentric_4x4<double>, 1e-8);
  expect_coordinates_of<double>(barycentric_about_d<double>, 1e-12);
  expect_coordinates_of<float>(barycentric_about_d<float>, 1e-5);
}

TEST(BenchInverse, ATetrahedronWithoutVolumeContainsNothing) {
  const Corners<float> flat{{1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 0}};
  EXPECT_FALSE(is_inside(barycentric_about_d(flat, {0, 0, 0})));
  EXPECT_FALSE(is_inside(barycentric_about_d(flat, {0.5f, 0.5f, 0})));
}

}  // namespace
}  // namespace tetwarp::bench
