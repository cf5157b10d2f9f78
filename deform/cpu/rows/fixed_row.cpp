// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/fixed_row.h"

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/fixed_row.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void fill(const RowRun* runs, int count, int y, int z, std::int32_t (&u)[3][kMostInRow]) {
  const hn::ScalableTag<std::int32_t> di;
  const hn::CappedTag<std::int32_t, 4> axes;  // a lane an axis
  const auto lanes = static_cast<int>(hn::Lanes(di));
  const auto along = hn::Iota(di, 0);
  for (const RowRun* run = runs; run < runs + count; ++run) {
    const TileMap& map = *run->map;
    HWY_ALIGN std::int32_t from[4];
    for (std::size_t n = 0; n < 4; n += hn::Lanes(axes)) {
      const auto part = [&](const std::int32_t* slope, int by) {
        return hn::Mul(hn::Load(axes, slope + n), hn::Set(axes, by));
      };
      hn::Store(hn::Add(hn::Add(hn::Load(axes, map.at + n), part(map.along_i, run->begin)),
                        hn::Add(part(map.along_j, y), part(map.along_k, z))),
                axes, from + n);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto step = hn::Set(di, map.along_i[axis]);
      auto at = hn::Add(hn::Set(di, from[axis]), hn::Mul(along, step));
      hn::StoreU(at, di, u[axis] + run->begin);
      if (run->end - run->begin <= lanes) continue;
      const auto leap = hn::Mul(step, hn::Set(di, lanes));
      for (int i = run->begin + lanes; i < run->end; i += lanes) {
        at = hn::Add(at, leap);
        hn::StoreU(at, di, u[axis] + i);
      }
    }
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(fill);

TileMap::TileMap(const CoarseMap& map, const glm::ivec3& first) : at{}, along_i{}, along_j{}, along_k{} {
  const glm::i64vec3 u = map.u(first);
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = static_cast<std::int32_t>(u[axis]);
    along_i[axis] = map.slope[0][axis];
    along_j[axis] = map.slope[1][axis];
    along_k[axis] = map.slope[2][axis];
  }
}

void fill_fixed_row(const RowRun* runs, int count, int y, int z, std::int32_t (&u)[3][kMostInRow]) {
  HWY_DYNAMIC_DISPATCH(fill)(runs, count, y, z, u);
}

}  // namespace tetwarp::cpu

#endif
