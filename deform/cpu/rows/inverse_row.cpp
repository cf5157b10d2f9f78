// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/inverse_row.h"

#include <limits>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/inverse_row.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::ScalableTag<double>;
using Floats = hn::Rebind<float, Doubles>;
using Double = hn::Vec<Doubles>;
using Float = hn::Vec<Floats>;

/// One component of a matrix times a vector, summed from left to right as GLM does.
HWY_INLINE Float component(const glm::dmat3& m, int axis, Double x, Double y, Double z) {
  const Doubles dd;
  const Double along_x = hn::Mul(hn::Set(dd, m[0][axis]), x), along_y = hn::Mul(hn::Set(dd, m[1][axis]), y),
               along_z = hn::Mul(hn::Set(dd, m[2][axis]), z);
  return hn::DemoteTo(Floats(), hn::Add(hn::Add(along_x, along_y), along_z));
}

void write_row(const glm::dmat3& m, const Row& row, glm::vec3* out) {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  const Doubles dd;
  const Floats df;
  const hn::RebindToSigned<Floats> di;
  const hn::Rebind<std::uint8_t, Floats> d8;
  const auto lanes = static_cast<int>(hn::Lanes(dd));
  int i = 0;
  for (; i + lanes <= row.count && !(row.fixed && row.fixed->is_wide()); i += lanes) {
    Double x, y, z;
    if (row.fixed) {
      const auto along = [&](int axis) {
        return hn::Mul(hn::PromoteTo(dd, hn::LoadU(di, row.fixed->u[axis] + i)), hn::Set(dd, 0x1p-23));
      };
      x = along(0);
      y = along(1);
      z = along(2);
    } else {
      Float ux, uy, uz;
      hn::LoadInterleaved3(df, &row.offset[i].x, ux, uy, uz);
      x = hn::PromoteTo(dd, ux);
      y = hn::PromoteTo(dd, uy);
      z = hn::PromoteTo(dd, uz);
    }
    const auto mapped = hn::RebindMask(df, hn::Ne(hn::PromoteTo(di, hn::LoadU(d8, row.mapped + i)), hn::Zero(di)));
    const Float nothing = hn::Set(df, kNothing);
    hn::StoreInterleaved3(hn::IfThenElse(mapped, component(m, 0, x, y, z), nothing),
                          hn::IfThenElse(mapped, component(m, 1, x, y, z), nothing),
                          hn::IfThenElse(mapped, component(m, 2, x, y, z), nothing), df, &out[i].x);
  }
  for (; i < row.count; ++i) {
    const glm::dvec3 offset = row.fixed ? in_double(row.fixed->at(i)) : in_double(row.offset[i]);
    out[i] = row.mapped[i] ? glm::vec3(m * offset) : glm::vec3(kNothing);
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(write_row);

void write_inverse_row(const glm::dmat3& mm_from_index, const Row& row, glm::vec3* inverse_mm) {
  HWY_DYNAMIC_DISPATCH(write_row)(mm_from_index, row, inverse_mm);
}

}  // namespace tetwarp::cpu

#endif
