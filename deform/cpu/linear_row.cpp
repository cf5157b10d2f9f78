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

/// Two neighbouring voxels side by side, as they lie in memory.
template <class V>
struct Pair {
  using Bits = std::uint32_t;  ///< the pair in the low ones
  using Value = Int;
  static constexpr int kBits = 8 * sizeof(V);

  /// Reads pairs into a vector of first and one of second voxels.
  static HWY_INLINE void load(const Bits* pairs, Int& low, Int& high) {
    const Int bits = hn::BitCast(Ints(), hn::Load(hn::RebindToUnsigned<Ints>(), pairs));
    low = from_top(hn::ShiftLeft<32 - kBits>(bits));
    high = from_top(hn::ShiftLeft<32 - 2 * kBits>(bits));
  }
  static HWY_INLINE void store(Int value, V* output) {
    const hn::Rebind<V, Floats> dv;
    hn::StoreU(hn::DemoteTo(dv, value), dv, output);
  }

 private:
  /// Values of type V from the topmost bits of numbers.
  static HWY_INLINE Int from_top(Int up) {
    const hn::RebindToUnsigned<Ints> du;
    if constexpr (std::is_signed_v<V>) return hn::ShiftRight<32 - kBits>(up);
    return hn::BitCast(Ints(), hn::ShiftRight<32 - kBits>(hn::BitCast(du, up)));
  }
};

template <>
struct Pair<float> {
  using Bits = std::uint64_t;
  using Value = Float;

  static HWY_INLINE void load(const Bits* pairs, Float& low, Float& high) {
    hn::LoadInterleaved2(Floats(), reinterpret_cast<const float*>(pairs), low, high);
  }
  static HWY_INLINE void store(Float value, float* output) { hn::StoreU(value, Floats(), output); }
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

/// Fractions of a vector of voxels, and where they are 0.
struct Fractions {
  Float x, y, z;
  hn::Mask<Floats> no_x, no_y, no_z;

  HWY_INLINE Fractions(const LinearPlaces& places, int i)
      : x(hn::Load(Floats(), places.x + i)), y(hn::Load(Floats(), places.y + i)), z(hn::Load(Floats(), places.z + i)) {
    const Float zero = hn::Zero(Floats());
    no_x = hn::Eq(x, zero);
    no_y = hn::Eq(y, zero);
    no_z = hn::Eq(z, zero);
  }
};

/// Values of the eight voxels around a vector of places, corner c = x + 2y + 4z.
template <class Value>
struct Corners {
  Value value[8];

  /// Puts its neighbour, which has weight, in the place of each corner that has none.
  HWY_INLINE void leave_out_weightless(const Fractions& at) {
    for (int c = 1; c < 8; c += 2) value[c] = chosen(at.no_x, value[c - 1], value[c]);
    for (const int c : {2, 3, 6, 7}) value[c] = chosen(at.no_y, value[c - 2], value[c]);
    for (int c = 4; c < 8; ++c) value[c] = chosen(at.no_z, value[c - 4], value[c]);
  }

  static HWY_INLINE Float chosen(hn::Mask<Floats> which, Float yes, Float no) { return hn::IfThenElse(which, yes, no); }
  static HWY_INLINE Int chosen(hn::Mask<Floats> which, Int yes, Int no) {
    return hn::IfThenElse(hn::RebindMask(Ints(), which), yes, no);
  }
};

/// The sample of whole numbers, to the nearest one. A corner without weight changes nothing.
HWY_INLINE Int interpolated(const Corners<Int>& at, const Fractions& t) {
  const auto along_x = [&](int c) {
    return mix(hn::ConvertTo(Floats(), at.value[c]), hn::ConvertTo(Floats(), at.value[c + 1]), t.x);
  };
  return hn::NearestInt(mix(mix(along_x(0), along_x(2), t.y), mix(along_x(4), along_x(6), t.y), t.z));
}

/// The sample of floats: a corner without weight does not count, even if it is infinite or no number; a copy is one to
/// the bit; and all that is no number is one and the same NaN.
HWY_INLINE Float interpolated(const Corners<Float>& at, const Fractions& t) {
  const Floats df;
  const auto along_x = [&](int c) {
    return hn::IfThenElse(t.no_x, at.value[c], mix(at.value[c], at.value[c + 1], t.x));
  };
  const auto along_y = [&](int c) {
    const Float low = along_x(c);
    return hn::IfThenElse(t.no_y, low, mix(low, along_x(c + 2), t.y));
  };
  const Float low = along_y(0);
  const Float value = hn::IfThenElse(t.no_z, low, mix(low, along_y(4), t.z));
  const Float number = hn::IfThenElse(hn::IsNaN(value), hn::Set(df, std::numeric_limits<float>::quiet_NaN()), value);
  return hn::IfThenElse(hn::And(t.no_x, hn::And(t.no_y, t.no_z)), at.value[0], number);
}

// is_same_label and is_smaller_label of deform/core/sample.h.
HWY_INLINE hn::Mask<Floats> same_label(Int a, Int b) { return hn::RebindMask(Floats(), hn::Eq(a, b)); }
HWY_INLINE hn::Mask<Floats> same_label(Float a, Float b) {
  return hn::Or(hn::Eq(a, b), hn::And(hn::IsNaN(a), hn::IsNaN(b)));
}
HWY_INLINE hn::Mask<Floats> smaller_label(Int a, Int b) { return hn::RebindMask(Floats(), hn::Lt(a, b)); }
HWY_INLINE hn::Mask<Floats> smaller_label(Float a, Float b) {
  return hn::Or(hn::Lt(a, b), hn::AndNot(hn::IsNaN(a), hn::IsNaN(b)));
}

/// The label with the largest sum of weights, by the rules of sample_vote in deform/core/sample.h.
template <class Value>
HWY_INLINE Value voted(Corners<Value> at, const Fractions& t) {
  const Floats df;
  at.leave_out_weightless(t);
  const Value* label = at.value;
  auto uniform = same_label(label[0], label[1]);
  for (int c = 2; c < 8; ++c) uniform = hn::And(uniform, same_label(label[0], label[c]));
  if (hn::AllTrue(df, uniform)) return label[0];
  const Float one = hn::Set(df, 1.0f);
  const Float along_x[2] = {hn::Sub(one, t.x), t.x}, along_y[2] = {hn::Sub(one, t.y), t.y},
              along_z[2] = {hn::Sub(one, t.z), t.z};
  Float weight[8];
  for (int c = 0; c < 8; ++c) weight[c] = hn::Mul(hn::Mul(along_x[c & 1], along_y[c >> 1 & 1]), along_z[c >> 2]);
  Value winner = label[0];
  Float most = hn::Zero(df);
  for (int c = 0; c < 8; ++c) {
    Float sum = weight[c];
    for (int other = c + 1; other < 8; ++other)
      sum = hn::Add(sum, hn::IfThenElseZero(same_label(label[other], label[c]), weight[other]));
    const auto wins = hn::Or(hn::Gt(sum, most), hn::And(hn::Eq(sum, most), smaller_label(label[c], winner)));
    winner = Corners<Value>::chosen(wins, label[c], winner);
    most = hn::IfThenElse(wins, sum, most);
  }
  return winner;
}

/// The samples between which a row is interpolated.
template <class V>
struct Samples {
  using Value = typename Pair<V>::Value;

  /// For each voxel, a sample and the next one along i: at its own place, in the next row, in the next slice, and in
  /// both.
  HWY_ALIGN typename Pair<V>::Bits pairs[4][kMostInRow];

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

  HWY_INLINE Corners<Value> corners(int i) const {
    Corners<Value> at;
    for (int n = 0; n < 4; ++n) Pair<V>::load(pairs[n] + i, at.value[2 * n], at.value[2 * n + 1]);
    return at;
  }

  /// Writes what `sample` makes of the corners and fractions of each vector of voxels.
  template <class Sample>
  HWY_INLINE void write(const LinearPlaces& places, V* output, Sample&& sample) const {
    const auto lanes = static_cast<int>(hn::Lanes(Floats()));
    for (int i = 0; i < places.count; i += lanes) Pair<V>::store(sample(corners(i), Fractions(places, i)), output + i);
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
void with_type(VoxelType type, void* output, Work&& work) {
  switch (type) {
    case VoxelType::u8: return work(static_cast<std::uint8_t*>(output));
    case VoxelType::i8: return work(static_cast<std::int8_t*>(output));
    case VoxelType::u16: return work(static_cast<std::uint16_t*>(output));
    case VoxelType::f32: return work(static_cast<float*>(output));
    default: return work(static_cast<std::int16_t*>(output));
  }
}

void sample_linear(const LinearSource& source, const LinearPlaces& places, void* output) {
  with_type(source.type, output, [&](auto* to) {
    using V = std::remove_pointer_t<decltype(to)>;
    Samples<V>(source, places).write(places, to, [](const auto& at, const Fractions& t) {
      return interpolated(at, t);
    });
  });
}

void sample_votes(const LinearSource& source, const LinearPlaces& places, void* output) {
  with_type(source.type, output, [&](auto* to) {
    using V = std::remove_pointer_t<decltype(to)>;
    Samples<V>(source, places).write(places, to, [](const auto& at, const Fractions& t) { return voted(at, t); });
  });
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(find_places);
HWY_EXPORT(sample_linear);
HWY_EXPORT(sample_votes);

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

void sample_vote_row(const LinearSource& source, const LinearPlaces& places, void* output) {
  if (places.sampled == 0) return;
  HWY_DYNAMIC_DISPATCH(sample_votes)(source, places, output);
}

}  // namespace tetwarp::cpu

#endif
