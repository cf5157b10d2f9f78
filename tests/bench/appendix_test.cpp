#include "bench/appendix.h"

#include <gtest/gtest.h>

namespace tetwarp::bench {
namespace {

constexpr Corners<float> kUnit = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

TEST(BenchAppendix, AllFormsAgreeOnAUnitTetrahedronAtTheOrigin) {
  const Determinants found = determinants(kUnit);
  EXPECT_EQ(found.double_4x4, 1);
  EXPECT_EQ(found.double_3x3, 1);
  EXPECT_EQ(found.float_4x4, 1);
  EXPECT_EQ(found.float_3x3, 1);
}

TEST(BenchAppendix, SwappingTwoCornersTurnsTheSign) {
  const Determinants found = determinants({kUnit.b, kUnit.a, kUnit.c, kUnit.d});
  EXPECT_EQ(found.double_4x4, -1);
  EXPECT_EQ(found.float_3x3, -1);
}

TEST(BenchAppendix, TheExampleIsAboutOneCellFarFromTheOrigin) {
  const Appendix appendix = measure_appendix(10);
  const Corners<float>& t = appendix.corners;
  for (const Point<float>& corner : {t.a, t.b, t.c, t.d}) {
    for (const float x : {corner.x, corner.y, corner.z}) {
      EXPECT_GT(x, 400);
      EXPECT_LT(x, 512);
      EXPECT_NE(x, std::floor(x));
    }
  }
  EXPECT_NEAR(appendix.example.double_3x3, 1.2, 0.05);
  EXPECT_NEAR(appendix.example.double_4x4, appendix.example.double_3x3, 1e-9);
  EXPECT_NEAR(appendix.example.float_3x3, appendix.example.double_3x3, 1e-6);
  EXPECT_GT(std::abs(appendix.example.float_4x4 - appendix.example.double_3x3), 1e-3);
}

TEST(BenchAppendix, FloatAboutDStaysAccurateWhereFloatByEquation6DoesNot) {
  const Appendix appendix = measure_appendix(2000);
  ASSERT_EQ(appendix.errors.size(), 4u);
  for (const DeterminantErrors& errors : appendix.errors) {
    EXPECT_EQ(errors.tetrahedra, 2000);
    EXPECT_LT(errors.largest_3x3, 1e-6) << errors.distance;
    EXPECT_LE(errors.median_4x4, errors.largest_4x4);
  }
  for (std::size_t n = 1; n < appendix.errors.size(); ++n) {
    EXPECT_GT(appendix.errors[n].distance, appendix.errors[n - 1].distance);
    EXPECT_GT(appendix.errors[n].median_4x4, 3 * appendix.errors[n - 1].median_4x4);
  }
  EXPECT_GT(appendix.errors[2].median_4x4, 1e-3);
}

}  // namespace
}  // namespace tetwarp::bench
