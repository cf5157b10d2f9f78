#include "deform/cpu/linear_row.h"

#include <algorithm>
#include <cstring>
#include <limits>

// Compiled once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/linear_row.cpp"
#include <hwy/foreach_target.h>
// After it, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Float = hn::Vec<Floats>;
using Int = hn::Vec<Ints>;

/// Two voxels side by side, from the 32 bits that begin with the first.
template <class V>
struct Voxels {
  static constexpr int kBits = 8 * sizeof(V);

  static HWY_INLINE Float low(Int bits) {
    const Int up = hn::ShiftLeft<32 - kBits>(bits);
    return to_float(up);
  }
  static HWY_INLINE Float high(Int bits) { return to_float(hn::ShiftLeft<32 - 2 * kBits>(bits)); }

 private:
  /// The topmost bits, as V.
  static HWY_INLINE Float to_float(Int up) {
    const hn::RebindToUnsigned<Ints> du;
    const Int value = std::is_signed_v<V> ? hn::ShiftRight<32 - kBits>(up)
                                          : hn::BitCast(Ints(), hn::ShiftRight<32 - kBits>(hn::BitCast(du, up)));
    return hn::ConvertTo(Floats(), value);
  }
};

/// Where a voxel comes from along one axis.
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

/// Asks for what the same voxels of the next slice will be sampled from, if they come from beside these.
template <class V>
HWY_INLINE void prefetch(const LinearSource& source, std::int64_t at, int lanes) {
  const auto* line = reinterpret_cast<const char*>(static_cast<const V*>(source.voxels)) +
                     (at + 2 * std::int64_t{source.slice}) * static_cast<std::int64_t>(sizeof(V));
  hwy::Prefetch(line);
  hwy::Prefetch(line + lanes * static_cast<int>(sizeof(V)));
}

HWY_INLINE Float mix(Float a, Float b, Float t) { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); }

/// What a row is interpolated from.
template <class V>
struct Samples {
  HWY_ALIGN float x[kMostInRow], y[kMostInRow], z[kMostInRow];  ///< fractions
  HWY_ALIGN std::int32_t at[kMostInRow];                        ///< voxel of the buffer; 0 where it is left
  /// Of each the voxel and the next along i; of the next row, the next slice, and both.
  HWY_ALIGN std::uint32_t pairs[4][kMostInRow];

  /// One after the other: cheaper than gathers, which some processors make of many steps, and no vector waits for it.
  void read(const LinearSource& source, int count) {
    const std::int64_t steps[4] = {0, source.row, source.slice, std::int64_t{source.slice} + source.row};
    for (int i = 0; i < count; ++i) {
      const V* from = static_cast<const V*>(source.voxels) + at[i];
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
  HWY_INLINE Float interpolated(int i) const {
    const Floats df;
    const Float fx = hn::Load(df, x + i), fy = hn::Load(df, y + i), fz = hn::Load(df, z + i);
    return mix(mix(along_x(0, i, fx), along_x(1, i, fx), fy), mix(along_x(2, i, fx), along_x(3, i, fx), fy), fz);
  }

  void interpolate(int count, V* output) const {
    const hn::Rebind<V, Floats> dv;
    const auto lanes = static_cast<int>(hn::Lanes(Floats()));
    for (int i = 0; i < count; i += lanes)
      hn::StoreU(hn::DemoteTo(dv, hn::NearestInt(interpolated(i))), dv, output + i);
  }

  /// Copies what voxels are made of that is the same all around; leaves others.
  void copy_uniform(int count, V* output, RowState* state) const {
    using Bits = std::make_unsigned_t<V>;
    const hn::RebindToUnsigned<Ints> du;
    const hn::Rebind<Bits, Floats> dv;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const auto lanes = static_cast<int>(hn::Lanes(du));
    auto* const to = reinterpret_cast<Bits*>(output);
    auto* const states = reinterpret_cast<std::uint8_t*>(state);
    for (int i = 0; i < count; i += lanes) {
      const auto pair = hn::Load(du, pairs[0] + i);
      const auto low = hn::And(pair, hn::Set(du, std::numeric_limits<Bits>::max()));
      const auto other =
          hn::Or(hn::Or(hn::Xor(pair, hn::Load(du, pairs[1] + i)), hn::Xor(pair, hn::Load(du, pairs[2] + i))),
                 hn::Or(hn::Xor(pair, hn::Load(du, pairs[3] + i)),
                        hn::Xor(pair, hn::Or(low, hn::ShiftLeft<Voxels<V>::kBits>(low)))));
      const auto was = hn::PromoteTo(du, hn::LoadU(d8, states + i));
      const auto now =
          hn::IfThenElse(hn::Eq(other, hn::Zero(du)), was, hn::Set(du, static_cast<std::uint32_t>(RowState::left)));
      hn::StoreU(hn::TruncateTo(d8, now), d8, states + i);
      hn::StoreU(hn::TruncateTo(dv, low), dv, to + i);
    }
  }
};

template <class V>
SliceRange sample(const LinearSource& source, const Row& row, V* output, RowState* state, bool uniform) {
  const Floats df;
  const Ints di;
  const hn::Rebind<std::uint8_t, Floats> d8;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const Int stride_row = hn::Set(di, source.row), stride_slice = hn::Set(di, source.slice);
  // Of the buffer's first voxel. Numbers may wrap around: their differences fit.
  const auto begin = static_cast<std::int32_t>(std::int64_t{source.begin.z} * source.slice +
                                               std::int64_t{source.begin.y} * source.row + source.begin.x);
  const glm::ivec3 first(row.voxel);
  Int least = hn::Set(di, INT32_MAX), most = hn::Set(di, INT32_MIN);
  Samples<V> samples;
  int count = 0;
  for (; count + lanes <= row.count; count += lanes) {
    Float ux, uy, uz;
    hn::LoadInterleaved3(df, &row.offset[count].x, ux, uy, uz);
    const Axis x(ux, hn::Iota(di, first.x + count), source.last.x), y(uy, hn::Set(di, first.y), source.last.y),
        z(uz, hn::Set(di, first.z), source.last.z);
    const Int at = hn::Sub(hn::Add(hn::Add(hn::Mul(z.base, stride_slice), hn::Mul(y.base, stride_row)), x.base),
                           hn::Set(di, begin));
    const auto mapped = hn::Gt(hn::PromoteTo(di, hn::LoadU(d8, row.mapped + count)), hn::Zero(di));
    const auto good = hn::And(hn::And(mapped, x.inside), hn::And(y.inside, z.inside));
    prefetch<V>(source, hn::GetLane(at), lanes);
    hn::Store(hn::IfThenElseZero(good, at), di, samples.at + count);
    hn::Store(x.fraction, df, samples.x + count);
    hn::Store(y.fraction, df, samples.y + count);
    hn::Store(z.fraction, df, samples.z + count);
    hn::StoreU(hn::DemoteTo(d8, hn::IfThenElse(good, hn::Set(di, 1), hn::Set(di, 2))), d8,
               reinterpret_cast<std::uint8_t*>(state) + count);
    const auto between = hn::RebindMask(di, hn::Ne(z.fraction, hn::Zero(df)));
    const Int top = hn::Add(z.base, hn::IfThenElseZero(between, hn::Set(di, 1)));
    least = hn::Min(least, hn::IfThenElse(good, z.base, hn::Set(di, INT32_MAX)));
    most = hn::Max(most, hn::IfThenElse(good, top, hn::Set(di, INT32_MIN)));
  }
  for (int i = count; i < row.count; ++i) state[i] = RowState::left;
  const std::int32_t low = hn::GetLane(hn::MinOfLanes(di, least)), high = hn::GetLane(hn::MaxOfLanes(di, most));
  if (low > high) return {};  // and nothing that a voxel left might read instead
  samples.read(source, count);
  if (uniform) {
    samples.copy_uniform(count, output, state);
  } else {
    samples.interpolate(count, output);
  }
  return {low, high};
}

SliceRange sample_any(const LinearSource& source, const Row& row, void* output, RowState* state, bool uniform) {
  switch (source.type) {
    case VoxelType::u8: return sample(source, row, static_cast<std::uint8_t*>(output), state, uniform);
    case VoxelType::i8: return sample(source, row, static_cast<std::int8_t*>(output), state, uniform);
    case VoxelType::u16: return sample(source, row, static_cast<std::uint16_t*>(output), state, uniform);
    case VoxelType::i16: return sample(source, row, static_cast<std::int16_t*>(output), state, uniform);
    default: std::fill(state, state + row.count, RowState::left); return {};
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(sample_any);

SliceRange sample_linear_row(const LinearSource& source, const Row& row, void* output, RowState* state) {
  return HWY_DYNAMIC_DISPATCH(sample_any)(source, row, output, state, false);
}

SliceRange sample_uniform_row(const LinearSource& source, const Row& row, void* output, RowState* state) {
  return HWY_DYNAMIC_DISPATCH(sample_any)(source, row, output, state, true);
}

}  // namespace tetwarp::cpu

#endif
