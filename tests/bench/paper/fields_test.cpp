// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The paper's methods and its fields as it writes them.
#include "bench/paper/fields.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/paper/baselines.h"

namespace tetwarp::bench {
namespace {

TEST(BenchPublished, AThreadHoldsAsManyBytesOfVerticesAsThePaperSays) { EXPECT_EQ(8 * sizeof(CellVertex), 192u); }

TEST(BenchMethods, OnlyThePapersHaveAFormWithAnInversePerVoxel) {
  for (const std::string& name : method_names()) {
    const Method method = parse_method(name);
    EXPECT_EQ(name_of(method), name);
    if (inverse_of(method) == InverseIn::every_voxel) {
      EXPECT_TRUE(name.ends_with("-per-voxel")) << name;
      EXPECT_THROW(per_voxel(method), InputError);
    } else if (method == Method::gascon || method == Method::tetwarp) {
      EXPECT_THROW(per_voxel(method), InputError);
    } else {
      EXPECT_EQ(name_of(per_voxel(method)), name + "-per-voxel");
      EXPECT_EQ(inverse_of(per_voxel(method)), InverseIn::every_voxel);
    }
  }
}

// Eqs. 14 to 16 in double at t = pi / 2, p in voxels.
TEST(BenchFields, FieldsAsWrittenAreThePapersEquations) {
  const glm::i64vec3 size(41, 37, 33);
  const glm::dvec3 c(20, 18, 16);
  const double t = std::acos(0.0);
  for (const FieldAsWritten& field : fields_as_written()) {
    const Formula formula = make_formula(field.name, size);
    const std::string transform = field.transform;
    for (const glm::dvec3 p :
         {glm::dvec3(3, 5, 7), glm::dvec3(20, 18, 16), glm::dvec3(40, 0, 32), glm::dvec3(0, 18, 0)}) {
      const glm::dvec3 d = p - c;
      glm::dvec3 expected(0);
      if (transform == "wave") {
        expected.x = field.amplitude * std::sin(p.z + t);
      } else if (transform == "twist") {
        const double theta = field.amplitude / (20 * 16) * std::sin(t) * d.z;
        expected = {d.x * std::cos(theta) - d.y * std::sin(theta) - d.x,
                    d.x * std::sin(theta) + d.y * std::cos(theta) - d.y, 0};
      } else if (d != glm::dvec3(0)) {
        expected = field.amplitude * std::sin(t) / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) * d;
      }
      const glm::vec3 found = displacement_at(formula, glm::vec3(p));
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(static_cast<double>(found[axis]), expected[axis], 4e-5) << field.name << axis;
    }
  }
}

TEST(BenchFields, AmplitudesAreTheWayThatAVertexGoes) {
  const glm::i64vec3 size(401, 401, 301);
  for (const FieldAsWritten& field : fields_as_written()) {
    // the first slice of Wave has sin(pi / 2); of Twist the middle of a side, of Bubble any place
    const glm::vec3 way = displacement_at(make_formula(field.name, size), {0, 200, 0});
    const double length = std::sqrt(static_cast<double>(way.x * way.x + way.y * way.y + way.z * way.z));
    EXPECT_NEAR(length, field.amplitude, 0.01 * field.amplitude) << field.name;
  }
}

}  // namespace
}  // namespace tetwarp::bench
