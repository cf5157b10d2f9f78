// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/row_scan.h"

#include <bit>

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

/// Whole numbers from 0 to 2^22: with 2^23 added, their bits are the lowest of a float.
HWY_INLINE Int in_int(Float whole) {
  const Ints di;
  return hn::And(hn::BitCast(di, hn::Add(whole, hn::Set(Floats(), 0x1p23f))), hn::Set(di, (1 << 23) - 1));
}

/// A bit for each voxel from `begin` to before `end`, both from 0 to 32. Any bits where there is none.
HWY_INLINE Int bits_between(Int begin, Int end) {
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const Int most = hn::Set(di, 31), none_left = hn::And(hn::Sub(begin, end), most);  // 32 minus their number
  return hn::Shl(hn::BitCast(di, hn::Shr(hn::Set(du, ~0u), hn::BitCast(du, none_left))), hn::And(begin, most));
}

/// Appends the lanes of a mask. @return how many
template <class D, class T = hn::TFromD<D>>
HWY_INLINE int append(Int lanes, hn::Mask<Ints> mask, D d, T* to) {
  const Int first = hn::Compress(lanes, mask);
  if constexpr (sizeof(T) == sizeof(std::int32_t)) {
    hn::StoreU(hn::BitCast(d, first), d, to);
  } else {
    hn::StoreU(hn::DemoteTo(d, first), d, to);
  }
  return static_cast<int>(hn::CountTrue(Ints(), mask));
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
  // The first voxels that do not lie before a crossing, those of the row as far as it matters: where `begin` lies
  // behind the row, `end` does not, and where `end` lies before it, `begin` does not.
  const Float zero = hn::Zero(Floats());
  const Float begin = hn::Ceil(hn::Max(begin_low, zero)), end = hn::Ceil(hn::Min(end_high, width));
  const auto any = hn::And(wanted, hn::RebindMask(di, hn::Lt(begin, end)));
  if (hn::AllFalse(di, any)) return;
  const Float late_begin = hn::Ceil(hn::Max(begin_high, zero)), early_end = hn::Ceil(hn::Min(end_low, width));
  const auto sure = hn::RebindMask(di, hn::And(hn::Eq(begin, late_begin), hn::Eq(early_end, end)));
  const Int rows = in_int(hn::MulAdd(z, hn::Set(Floats(), float{kMostRowTile}), y));
  const hn::Rebind<std::uint16_t, Ints> d16;
  const auto found = hn::And(any, sure), unsure = hn::AndNot(sure, any);
  append(bits_between(in_int(begin), in_int(end)), found, hn::RebindToUnsigned<Ints>(), out.found_bits + out.found);
  out.found += append(rows, found, d16, out.found_rows + out.found);
  if (!hn::AllFalse(di, unsure)) out.unsure += append(rows, unsure, d16, out.unsure_rows + out.unsure);
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

int list(const std::uint16_t* rows, const std::uint32_t* bits, int count, std::uint16_t* numbers, int& listed,
         int room) {
  const hn::CappedTag<std::uint16_t, 16> d16;
  const auto lanes = static_cast<int>(hn::Lanes(d16));
  const auto along = hn::Iota(d16, 0);
  int at = listed, n = 0;
  for (; n < count && at <= room - kMostRowTile; ++n) {
    for (std::uint32_t left = bits[n]; left != 0;) {
      const int begin = std::countr_zero(left), length = std::countr_one(left >> begin);
      const auto first = static_cast<std::uint16_t>(rows[n] * kMostRowTile + begin);
      for (int i = 0; i < length; i += lanes)
        hn::StoreU(hn::Add(along, hn::Set(d16, static_cast<std::uint16_t>(first + i))), d16, numbers + at + i);
      at += length;
      left = begin + length == 32 ? 0 : left & ~0u << (begin + length);
    }
  }
  listed = at;
  return n;
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(scan);
HWY_EXPORT(list);

void scan_rows(const RowFaces& faces, int y_begin, int y_end, int z_begin, int z_end, int width, RowScan& scan_of) {
  HWY_DYNAMIC_DISPATCH(scan)(faces, y_begin, y_end, z_begin, z_end, width, scan_of);
}

int list_voxels(const std::uint16_t* rows, const std::uint32_t* bits, int count, std::uint16_t* numbers, int& listed,
                int room) {
  return HWY_DYNAMIC_DISPATCH(list)(rows, bits, count, numbers, listed, room);
}

}  // namespace tetwarp::cpu

#endif
