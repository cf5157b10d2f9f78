// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/row_scan.h"

#include <bit>
#include <cstring>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/row_scan.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Float = hn::Vec<Floats>;
using Int = hn::Vec<Ints>;

constexpr int kLanes = 16;  ///< of the widest vectors

/// Where some faces cross rows: the least and the most that float leaves open, `RowsAlongZ` for a vector of rows.
struct Crossing {
  Float low, high;

  HWY_INLINE Crossing(const RowFace& face, Float y, Float z) {
    const Floats df;
    const Float at =
        hn::MulAdd(hn::Set(df, face.along_z), z, hn::MulAdd(hn::Set(df, face.along_y), y, hn::Set(df, face.at)));
    const Float error = hn::Set(df, face.error);
    low = hn::Sub(at, error);
    high = hn::Add(at, error);
  }
};

/// The first voxel that does not lie before a crossing, from 0 to `width`. Whatever is far away is clamped first.
HWY_INLINE Int first_from(Float crossing, Float width) {
  const Float clamped = hn::Min(hn::Max(crossing, hn::Zero(Floats())), width);
  return hn::ConvertTo(Ints(), hn::Ceil(clamped));
}

/// The lowest n bits, n from 0 to 32.
HWY_INLINE Int lowest(Int n) {
  const Ints di;
  const Int all = hn::Set(di, -1), some = hn::Sub(hn::Shl(hn::Set(di, 1), hn::And(n, hn::Set(di, 31))), hn::Set(di, 1));
  return hn::IfThenElse(hn::Gt(n, hn::Set(di, 31)), all, some);
}

/// Calls `visit(lane)` for the lanes of a mask.
template <class Mask, class Visit>
HWY_INLINE void for_each_lane(Mask mask, Visit&& visit) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Ints(), mask, bytes);
  std::uint64_t bits = 0;
  std::memcpy(&bits, bytes, sizeof bits);
  for (; bits != 0; bits &= bits - 1) visit(std::countr_zero(bits));
}

/// The rows of a vector. @param wanted  lanes that count
HWY_INLINE void scan_vector(const RowFaces& t, Float y, Float z, Float width, hn::Mask<Ints> wanted, RowScan& out) {
  const Ints di;
  const Crossing first(t.faces[0], y, z), second(t.faces[1], y, z), third(t.faces[2], y, z), last(t.faces[3], y, z);
  Float begin_low = first.low, begin_high = first.high, end_low = last.low, end_high = last.high;
  const auto enters = [&](const Crossing& at) {
    begin_low = hn::Max(begin_low, at.low);
    begin_high = hn::Max(begin_high, at.high);
  };
  const auto leaves = [&](const Crossing& at) {
    end_low = hn::Min(end_low, at.low);
    end_high = hn::Min(end_high, at.high);
  };
  t.lower > 1 ? enters(second) : leaves(second);
  t.lower > 2 ? enters(third) : leaves(third);
  const Int begin = first_from(begin_low, width), end = first_from(end_high, width);
  const auto any = hn::And(wanted, hn::Lt(begin, end));
  if (hn::AllFalse(di, any)) return;
  const Int late_begin = first_from(begin_high, width), early_end = first_from(end_low, width);
  const auto sure = hn::And(hn::Eq(begin, late_begin), hn::Eq(early_end, end));
  HWY_ALIGN std::int32_t bits[kLanes], rows[kLanes];
  hn::Store(hn::AndNot(lowest(begin), lowest(end)), di, bits);
  hn::Store(hn::ConvertTo(di, hn::MulAdd(z, hn::Set(Floats(), float{kMostRowTile}), y)), di, rows);
  for_each_lane(hn::And(any, sure), [&](int lane) {
    out.found_rows[out.found] = static_cast<std::uint16_t>(rows[lane]);
    out.found_bits[out.found++] = static_cast<std::uint32_t>(bits[lane]);
  });
  for_each_lane(hn::AndNot(sure, any),
                [&](int lane) { out.unsure_rows[out.unsure++] = static_cast<std::uint16_t>(rows[lane]); });
}

void scan(const RowFaces& faces, int y_begin, int y_end, int z_begin, int z_end, int width, RowScan& out) {
  const Floats df;
  const Ints di;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const int rows = y_end - y_begin;
  out.found = out.unsure = 0;
  if (rows <= 0) return;
  const Float voxels = hn::Set(df, static_cast<float>(width));
  const Float count = hn::Set(df, static_cast<float>(rows)), past = hn::Set(df, static_cast<float>(y_end)),
              one = hn::Set(df, 1.0f);
  // Lanes go on from slice to slice: a vector further is so many rows and slices, and one slice more at the end of
  // rows.
  const Float step_y = hn::Set(df, static_cast<float>(lanes % rows)),
              step_z = hn::Set(df, static_cast<float>(lanes / rows));
  const Float lane = hn::Iota(df, 0.0f), slice = hn::Floor(hn::Div(hn::Add(lane, hn::Set(df, 0.5f)), count));
  Float y = hn::Add(hn::Sub(lane, hn::Mul(slice, count)), hn::Set(df, static_cast<float>(y_begin))),
        z = hn::Add(slice, hn::Set(df, static_cast<float>(z_begin)));
  for (int left = rows * (z_end - z_begin); left > 0; left -= lanes) {
    scan_vector(faces, y, z, voxels, hn::FirstN(di, static_cast<std::size_t>(left < lanes ? left : lanes)), out);
    y = hn::Add(y, step_y);
    z = hn::Add(z, step_z);
    const auto next = hn::Ge(y, past);
    y = hn::IfThenElse(next, hn::Sub(y, count), y);
    z = hn::IfThenElse(next, hn::Add(z, one), z);
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(scan);

void scan_rows(const RowFaces& faces, int y_begin, int y_end, int z_begin, int z_end, int width, RowScan& scan_of) {
  HWY_DYNAMIC_DISPATCH(scan)(faces, y_begin, y_end, z_begin, z_end, width, scan_of);
}

}  // namespace tetwarp::cpu

#endif
