// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/fixed_list.h"

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/fixed_list.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void fill(const TileMap& map, const std::uint16_t* numbers, int count, std::int32_t* const (&u)[3]) {
  constexpr int kBits = VoxelList::kAxisBits;
  const hn::ScalableTag<std::int32_t> di;
  const hn::Rebind<std::uint16_t, decltype(di)> d16;
  const auto lanes = static_cast<int>(hn::Lanes(di));
  const auto most = hn::Set(di, kTile - 1);
  for (int i = 0; i < count; i += lanes) {
    const auto number = hn::PromoteTo(di, hn::LoadU(d16, numbers + i));
    const auto x = hn::And(number, most), y = hn::And(hn::ShiftRight<kBits>(number), most),
               z = hn::ShiftRight<2 * kBits>(number);
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = [&](int way, auto by) { return hn::Mul(hn::Set(di, map.along[way][axis]), by); };
      hn::StoreU(hn::Add(hn::Add(hn::Set(di, map.at[axis]), along(0, x)), hn::Add(along(1, y), along(2, z))), di,
                 u[axis] + i);
    }
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(fill);

TileMap::TileMap(const CoarseMap& map, const glm::ivec3& first)
    : at(map.u(first)), along{map.slope[0], map.slope[1], map.slope[2]} {}

void fill_fixed_list(const TileMap& map, const std::uint16_t* numbers, int count, std::int32_t* const (&u)[3]) {
  HWY_DYNAMIC_DISPATCH(fill)(map, numbers, count, u);
}

}  // namespace tetwarp::cpu

#endif
