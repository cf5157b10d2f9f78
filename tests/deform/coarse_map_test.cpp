// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The map of a tetrahedron of a coarse field: its bits, how near it is to the exact one, and what is exact.
#include "deform/core/coarse_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"

namespace tetwarp {
namespace {

using namespace test;

__extension__ typedef __int128 Int;

/// A tetrahedron of any shape.
/// @param size   longest edge, steps  @param twist  how much u differs among corners, steps
Tetrahedron random_tetrahedron(Random& random, std::int64_t size, std::int64_t moved, std::int64_t twist) {
  Tetrahedron t{};
  const auto some = [&](std::int64_t most) {
    return glm::i32vec3(random.integer(-most, most), random.integer(-most, most), random.integer(-most, most));
  };
  const glm::i32vec3 at = some(1 << 20), u = some(moved);
  for (Vertex* v : {&t.a, &t.b, &t.c, &t.d}) *v = {at + some(size / 2), u + some(twist)};
  return t;
}

/// u at a voxel, exact: numerators over a determinant, in steps.
struct ExactU {
  Int numerator[3], determinant;

  ExactU(const Tetrahedron& t, const glm::ivec3& voxel) {
    const auto column = [&](const Vertex& v) { return glm::i64vec3(v.deformed - t.d.deformed); };
    const glm::i64vec3 a = column(t.a), b = column(t.b), c = column(t.c),
                       r = glm::i64vec3(voxel) * std::int64_t{4096} - glm::i64vec3(t.d.deformed);
    const auto det = [](const glm::i64vec3& x, const glm::i64vec3& y, const glm::i64vec3& z) {
      return Int(x.x) * (Int(y.y) * z.z - Int(y.z) * z.y) - Int(x.y) * (Int(y.x) * z.z - Int(y.z) * z.x) +
             Int(x.z) * (Int(y.x) * z.y - Int(y.y) * z.x);
    };
    determinant = det(a, b, c);
    const Int wa = det(r, b, c), wb = det(a, r, c), wc = det(a, b, r);
    for (int axis = 0; axis < 3; ++axis) {
      numerator[axis] = determinant * t.d.u[axis] + wa * (t.a.u[axis] - t.d.u[axis]) +
                        wb * (t.b.u[axis] - t.d.u[axis]) + wc * (t.c.u[axis] - t.d.u[axis]);
    }
  }
  /// How far a U, 2^-23 voxel, is from it on the worst axis, in voxels.
  long double distance(const glm::i64vec3& u) const {
    long double most = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Int rest = Int(u[axis]) * determinant - numerator[axis] * 2048;
      most =
          std::max(most, std::abs(static_cast<long double>(rest) / static_cast<long double>(determinant)) * 0x1p-23L);
    }
    return most;
  }
};

long double norm1(const glm::ivec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

TEST(CoarseMap, IsAsNearToTheExactPlaceAsIsPromised) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 71);
  int usable = 0;
  for (int n = 0; n < 20000; ++n) {
    const std::int64_t sizes[] = {10240, 32768, 65536, 262144, 1 << 20};
    const std::int64_t size = random.one_of(sizes);
    const Tetrahedron t = random_tetrahedron(random, size, 1 << 20, size / 4);
    const CoarseMap map(t);
    if (map.is_thin) continue;
    ++usable;
    for (int m = 0; m < 4; ++m) {
      const auto reach = static_cast<int>(size / 8192 + 1);
      const glm::ivec3 by(random.integer(-reach, reach), random.integer(-reach, reach), random.integer(-reach, reach));
      const glm::ivec3 voxel = map.origin + by;
      EXPECT_LE(ExactU(t, voxel).distance(map.u(voxel)), 0x1p-24L * (1 + norm1(by)) + 0x1p-30L) << "size " << size;
    }
  }
  EXPECT_GT(usable, 15000);
}

/// Compares the map of a tetrahedron with what docs/design/definition.md writes down, index by index. @return whether
/// it is usable
bool has_bits_of_definition(const Tetrahedron& t) {
  const Vertex corner[4] = {t.a, t.b, t.c, t.d};
  double edge[3][3], u[3][3], ud[3], e[3] = {};
  std::int64_t o[3];
  for (int r = 0; r < 3; ++r) {
    std::int64_t sum = 0;
    for (const Vertex& v : corner) sum += v.deformed[r];
    o[r] = static_cast<std::int64_t>(std::floor(static_cast<double>(sum) / 16384));
    e[r] = 4096.0 * static_cast<double>(o[r]) - t.d.deformed[r];
    ud[r] = t.d.u[r];
    for (int k = 0; k < 3; ++k) {
      edge[k][r] = corner[k].deformed[r] - t.d.deformed[r];
      u[k][r] = corner[k].u[r] - t.d.u[r];
    }
  }
  double cross[3][3];  // bc, ca, ab
  for (int k = 0; k < 3; ++k) {
    const double *p = edge[(k + 1) % 3], *q = edge[(k + 2) % 3];
    for (int r = 0; r < 3; ++r) cross[k][r] = p[(r + 1) % 3] * q[(r + 2) % 3] - p[(r + 2) % 3] * q[(r + 1) % 3];
  }
  const double det = (edge[0][0] * cross[0][0] + edge[0][1] * cross[0][1]) + edge[0][2] * cross[0][2], inv = 1.0 / det;
  const auto length = [&](int k) { return (std::fabs(edge[k][0]) + std::fabs(edge[k][1])) + std::fabs(edge[k][2]); };
  bool thin = !(std::fabs(det) >= 0x1p-16 * ((length(0) * length(1)) * length(2)));
  const CoarseMap map(t);
  for (int r = 0; r < 3; ++r) {
    double g[3];
    for (int j = 0; j < 3; ++j) {
      g[j] = ((u[0][r] * cross[0][j] + u[1][r] * cross[1][j]) + u[2][r] * cross[2][j]) * inv;
      if (!(std::fabs(g[j]) < 128)) thin = true;
    }
    EXPECT_EQ(map.origin[r], o[r]);
    if (map.is_thin) continue;
    for (int j = 0; j < 3; ++j) EXPECT_EQ(map.slope[j][r], std::lrint(g[j] * 8388608.0));
    EXPECT_EQ(map.at_origin[r], std::lrint((ud[r] + ((g[0] * e[0] + g[1] * e[1]) + g[2] * e[2])) * 2048.0));
  }
  EXPECT_EQ(map.is_thin, thin);
  return !thin;
}

TEST(CoarseMap, HasTheBitsOfItsDefinition) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 72);
  int usable = 0;
  for (int n = 0; n < 20000 && !HasFailure(); ++n) {
    const std::int64_t twist = random.one_of({0, 100, 30000, 3000000});
    usable += has_bits_of_definition(random_tetrahedron(random, 40000, 1 << 21, twist));
  }
  EXPECT_GT(usable, 5000);
  EXPECT_LT(usable, 19900) << "hardly any is thin or steep";
}

/// Of 26 million random tetrahedra these are the first that tell apart sums in another order, fused operations, and a
/// division in the place of a product with the reciprocal: there the last rounding goes the other way.
TEST(CoarseMap, RoundsEachOperationOnceInTheOrderOfItsDefinition) {
  const Tetrahedron cases[] = {
      {{{2329672, 2520729, -787595}, {-1009393, -924886, -117364}},
       {{3073063, 401062, 1333904}, {-190798, 269266, -64621}},
       {{1677566, 2491471, 527777}, {442426, 309466, -937719}},
       {{3032822, 233894, 1677973}, {-906324, 595322, 304184}}},
      {{{1514806, 1746555, 747577}, {208672, 226040, 480341}},
       {{352326, 2049790, 889026}, {-326506, -249450, 105563}},
       {{1799933, 1669440, 803960}, {37207, -37770, -467330}},
       {{344919, 22684, 1742539}, {429800, -446754, -28841}}},
      {{{-767936, 1930780, -433062}, {1015167, -262666, 626644}},
       {{-840642, 2875320, -861105}, {-1023756, 372509, 265465}},
       {{613144, 2922689, 352635}, {966721, -551120, -58742}},
       {{2462305, 1971211, 2474233}, {-766113, -305098, 721325}}},
      {{{2307744, 2668814, -330006}, {240732, -65836, 807973}},
       {{306328, -867445, 2838325}, {-946844, -154930, -1028034}},
       {{-417630, 1293752, -340033}, {278197, 13902, -330982}},
       {{166379, -761541, 2582271}, {-663930, -908709, -686027}}},
      {{{-191178, 825322, 2040615}, {-18866, -982978, 768381}},
       {{-3791, 1311332, 462228}, {-771932, 649277, 3558}},
       {{524609, 1961007, -716916}, {41372, -114195, 867640}},
       {{2512168, 2739856, 771763}, {579380, 607413, 546573}}},
      {{{1476261, 871522, 1885501}, {-305862, -82861, -389672}},
       {{1038819, 2025276, 1336095}, {149710, -300571, 315687}},
       {{1232157, 349697, 343142}, {-418904, -389808, -130985}},
       {{79598, 1494319, 1908416}, {-99900, -226710, 415203}}},
      {{{1377222, 534836, 1373345}, {-208546, -509531, -61644}},
       {{542109, 1374655, 552845}, {94825, 474974, 138042}},
       {{1441314, 109336, 1858295}, {354495, 518194, 481081}},
       {{1716904, 1431400, 200294}, {-223119, -106162, 227720}}},
  };
  for (const Tetrahedron& t : cases) EXPECT_TRUE(has_bits_of_definition(t));
}

TEST(CoarseMap, IdentityAndShiftsByWholeVoxelsAreExact) {
  Random random(5);
  for (int n = 0; n < 2000; ++n) {
    Tetrahedron t = random_tetrahedron(random, 65536, 0, 0);
    const glm::i32vec3 shift(random.integer(-300, 300), random.integer(-300, 300), random.integer(-300, 300));
    for (Vertex* v : {&t.a, &t.b, &t.c, &t.d}) v->u = n == 0 ? glm::i32vec3(0) : shift * 4096;
    const CoarseMap map(t);
    if (map.is_thin) continue;
    const glm::ivec3 voxel = map.origin + glm::ivec3(random.integer(-9, 9), 3, -4);
    EXPECT_EQ(map.u(voxel), glm::i64vec3(n == 0 ? glm::i32vec3(0) : shift) * kFixedOne);
    EXPECT_EQ(fixed_offset(map.u(voxel)).fraction, glm::vec3(0));
  }
}

TEST(CoarseMap, FlatAndVerySteepTetrahedraTakeTheExactWay) {
  Tetrahedron t{};
  t.a.deformed = {40960, 0, 0};
  t.b.deformed = {0, 40960, 0};
  t.c.deformed = {40960, 40960, 1};
  t.c.u = {0, 0, 1};
  EXPECT_TRUE(CoarseMap(t).is_thin) << "flat";
  const glm::ivec3 voxel(5, 5, 0);
  const glm::i64vec3 u = coarse_u(t, voxel, {1, 1, 1});
  EXPECT_LE(ExactU(t, voxel).distance(u), 0x1p-24L);
  t.c.deformed = {0, 0, 409};  // a tenth of a voxel high, over which u changes by 20 voxels
  t.c.u = {0, 0, 81920};
  EXPECT_TRUE(CoarseMap(t).is_thin) << "steep";
  t.c.u = {0, 0, 2000};
  EXPECT_FALSE(CoarseMap(t).is_thin);
  t.c.deformed = {40960, 40960, 0};  // without volume
  EXPECT_TRUE(CoarseMap(t).is_thin);
}

}  // namespace
}  // namespace tetwarp
