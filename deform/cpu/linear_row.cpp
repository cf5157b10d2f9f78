// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/linear_row.h"

#include <algorithm>
#include <cstring>
#include <limits>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/linear_row.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Float = hn::Vec<Floats>;
using Int = hn::Vec<Ints>;

/// Reads two neighbouring voxels from the 32 bits that begin with the first.
template <class V>
struct Voxels {
  static constexpr int kBits = 8 * sizeof(V);

  static HWY_INLINE Float low(Int bits) {
    const Int up = hn::ShiftLeft<32 - kBits>(bits);
    return to_float(up);
  }
  static HWY_INLINE Float high(Int bits) { return to_float(hn::ShiftLeft<32 - 2 * kBits>(bits)); }

 private:
  /// A value of type V from the topmost bits of a number.
  static HWY_INLINE Float to_float(Int up) {
    const hn::RebindToUnsigned<Ints> du;
    const Int value = std::is_signed_v<V> ? hn::ShiftRight<32 - kBits>(up)
                                          : hn::BitCast(Ints(), hn::ShiftRight<32 - kBits>(hn::BitCast(du, up)));
    return hn::ConvertTo(Floats(), value);
  }
};

/// Where voxels come from along one axis.
struct Axis {
  Int base;
  Float fraction;
  hn::Mask<Ints> inside;

  HWY_INLINE Axis(Float offset, Int voxel, std::int32_t last) {
    const Float whole = hn::Floor(offset);
    fraction = hn::Sub(offset, whole);
    base = hn::Add(voxel, hn::ConvertTo(Ints(), whole));
    inside = hn::And(hn::And(hn::Gt(base, hn::Set(Ints(), -1)), hn::Lt(base, hn::Set(Ints(), last))),
                     hn::RebindMask(Ints(), hn::Lt(fraction, hn::Set(Floats(), 1.0f))));
  }
};

HWY_INLINE Float mix(Float a, Float b, Float t) { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); }

/// The samples between which a row is interpolated.
template <class V>
struct Samples {
  /// For each voxel, a sample and the next one along i: at its own place, in the next row, in the next slice, and in
  /// both.
  HWY_ALIGN std::uint32_t pairs[4][kMostInRow];

  /// Loads sample after sample: cheaper than gathers, which some processors make of many steps, and no vector waits for
  /// it.
  HWY_INLINE Samples(const LinearSource& source, const LinearPlaces& places) {
    const std::int64_t row = source.layout.row, slice = source.layout.slice, steps[4] = {0, row, slice, slice + row};
    const V* voxels = static_cast<const V*>(source.voxels);
    const int count = places.count;
    for (int i = 0; i < count; i += kVoxelsInLine) prefetch(voxels + places.at[i] + 2 * slice);
    prefetch(voxels + places.at[count - 1] + 2 * slice);
    for (int i = 0; i < count; ++i) {
      const V* from = voxels + places.at[i];
      for (int n = 0; n < 4; ++n) {
        pairs[n][i] = 0;
        std::memcpy(&pairs[n][i], from + steps[n], 2 * sizeof(V));
      }
    }
  }

  HWY_INLINE Float along_x(int n, int i, Float fraction) const {
    const Ints di;
    const Int bits = hn::BitCast(di, hn::Load(hn::RebindToUnsigned<Ints>(), pairs[n] + i));
    return mix(Voxels<V>::low(bits), Voxels<V>::high(bits), fraction);
  }
  HWY_INLINE Float interpolated(const LinearPlaces& places, int i) const {
    const Floats df;
    const Float fx = hn::Load(df, places.x + i), fy = hn::Load(df, places.y + i), fz = hn::Load(df, places.z + i);
    return mix(mix(along_x(0, i, fx), along_x(1, i, fx), fy), mix(along_x(2, i, fx), along_x(3, i, fx), fy), fz);
  }

  void interpolate(const LinearPlaces& places, V* output) const {
    const hn::Rebind<V, Floats> dv;
    const auto lanes = static_cast<int>(hn::Lanes(Floats()));
    for (int i = 0; i < places.count; i += lanes)
      hn::StoreU(hn::DemoteTo(dv, hn::NearestInt(interpolated(places, i))), dv, output + i);
  }

  /// Copies voxels whose samples all have the same value, and leaves the others. @return how many are not left
  int copy_uniform(int count, V* output, RowState* state) const {
    using Bits = std::make_unsigned_t<V>;
    const hn::RebindToUnsigned<Ints> du;
    const hn::Rebind<Bits, Floats> dv;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const auto lanes = static_cast<int>(hn::Lanes(du));
    auto* const to = reinterpret_cast<Bits*>(output);
    auto* const states = reinterpret_cast<std::uint8_t*>(state);
    std::size_t copied = 0;
    for (int i = 0; i < count; i += lanes) {
      const auto pair = hn::Load(du, pairs[0] + i);
      const auto low = hn::And(pair, hn::Set(du, std::numeric_limits<Bits>::max()));
      const auto other =
          hn::Or(hn::Or(hn::Xor(pair, hn::Load(du, pairs[1] + i)), hn::Xor(pair, hn::Load(du, pairs[2] + i))),
                 hn::Or(hn::Xor(pair, hn::Load(du, pairs[3] + i)),
                        hn::Xor(pair, hn::Or(low, hn::ShiftLeft<Voxels<V>::kBits>(low)))));
      const auto was = hn::PromoteTo(du, hn::LoadU(d8, states + i));
      const auto left = hn::Set(du, static_cast<std::uint32_t>(RowState::left));
      const auto now = hn::IfThenElse(hn::Eq(other, hn::Zero(du)), was, left);
      copied += hn::CountTrue(du, hn::Ne(now, left));
      hn::StoreU(hn::TruncateTo(d8, now), d8, states + i);
      hn::StoreU(hn::TruncateTo(dv, low), dv, to + i);
    }
    return static_cast<int>(copied);
  }

 private:
  static constexpr int kVoxelsInLine = 64 / sizeof(V);

  /// Prefetches the samples that the same voxels of the next slice need, if they come from beside these.
  static HWY_INLINE void prefetch(const V* voxels) { hwy::Prefetch(voxels); }
};

void find_places(const LinearLayout& layout, const Row& row, LinearPlaces& places) {
  const Floats df;
  const Ints di;
  const hn::Rebind<std::uint8_t, Floats> d8;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const Int stride_row = hn::Set(di, layout.row), stride_slice = hn::Set(di, layout.slice);
  // Offset of the buffer's first voxel. Numbers may wrap around, for their differences fit.
  const auto begin = static_cast<std::int32_t>(std::int64_t{layout.begin.z} * layout.slice +
                                               std::int64_t{layout.begin.y} * layout.row + layout.begin.x);
  const glm::ivec3 first(row.voxel);
  const Int along = hn::Iota(di, 0);
  Int least = hn::Set(di, INT32_MAX), most = hn::Set(di, INT32_MIN);
  std::size_t sampled = 0;
  int count = 0;
  for (; count + lanes <= row.count; count += lanes) {
    Float ux, uy, uz;
    hn::LoadInterleaved3(df, &row.offset[count].x, ux, uy, uz);
    const Axis x(ux, hn::Add(along, hn::Set(di, first.x + count)), layout.last.x),
        y(uy, hn::Set(di, first.y), layout.last.y), z(uz, hn::Set(di, first.z), layout.last.z);
    const Int at = hn::Sub(hn::Add(hn::Add(hn::Mul(z.base, stride_slice), hn::Mul(y.base, stride_row)), x.base),
                           hn::Set(di, begin));
    const auto mapped = hn::Gt(hn::PromoteTo(di, hn::LoadU(d8, row.mapped + count)), hn::Zero(di));
    const auto good = hn::And(hn::And(mapped, x.inside), hn::And(y.inside, z.inside));
    hn::Store(hn::IfThenElseZero(good, at), di, places.at + count);
    hn::Store(x.fraction, df, places.x + count);
    hn::Store(y.fraction, df, places.y + count);
    hn::Store(z.fraction, df, places.z + count);
    hn::StoreU(hn::DemoteTo(d8, hn::IfThenElse(good, hn::Set(di, 1), hn::Set(di, 2))), d8,
               reinterpret_cast<std::uint8_t*>(places.state) + count);
    sampled += hn::CountTrue(di, good);
    const auto between = hn::RebindMask(di, hn::Ne(z.fraction, hn::Zero(df)));
    const Int top = hn::Add(z.base, hn::IfThenElseZero(between, hn::Set(di, 1)));
    least = hn::Min(least, hn::IfThenElse(good, z.base, hn::Set(di, INT32_MAX)));
    most = hn::Max(most, hn::IfThenElse(good, top, hn::Set(di, INT32_MIN)));
  }
  std::fill(places.state + count, places.state + row.count, RowState::left);
  places.count = count;
  places.sampled = static_cast<int>(sampled);
  if (sampled == 0) return;
  places.slices = {hn::GetLane(hn::MinOfLanes(di, least)), hn::GetLane(hn::MaxOfLanes(di, most))};
}

/// Calls `work` with the voxels' type.
template <class Work>
auto with_type(VoxelType type, void* output, Work&& work) {
  switch (type) {
    case VoxelType::u8: return work(static_cast<std::uint8_t*>(output));
    case VoxelType::i8: return work(static_cast<std::int8_t*>(output));
    case VoxelType::u16: return work(static_cast<std::uint16_t*>(output));
    default: return work(static_cast<std::int16_t*>(output));
  }
}

void sample_linear(const LinearSource& source, const LinearPlaces& places, void* output) {
  with_type(source.type, output, [&](auto* to) {
    using V = std::remove_pointer_t<decltype(to)>;
    Samples<V>(source, places).interpolate(places, to);
  });
}

int sample_uniform(const LinearSource& source, const LinearPlaces& places, void* output, RowState* state) {
  return with_type(source.type, output, [&](auto* to) {
    using V = std::remove_pointer_t<decltype(to)>;
    return Samples<V>(source, places).copy_uniform(places.count, to, state);
  });
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(find_places);
HWY_EXPORT(sample_linear);
HWY_EXPORT(sample_uniform);

void LinearPlaces::find(const LinearLayout& layout, const Row& row) {
  if (found_ && layout == layout_) return;
  slices = {};
  HWY_DYNAMIC_DISPATCH(find_places)(layout, row, *this);
  layout_ = layout;
  found_ = true;
}

void sample_linear_row(const LinearSource& source, const LinearPlaces& places, void* output) {
  if (places.sampled == 0) return;  // there may be no voxel at all that can be read
  HWY_DYNAMIC_DISPATCH(sample_linear)(source, places, output);
}

int sample_uniform_row(const LinearSource& source, const LinearPlaces& places, void* output, RowState* state) {
  if (places.sampled == 0) return 0;
  return HWY_DYNAMIC_DISPATCH(sample_uniform)(source, places, output, state);
}

}  // namespace tetwarp::cpu

#endif
