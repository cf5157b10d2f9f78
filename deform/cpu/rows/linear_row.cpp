// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/linear_row.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/linear_row.cpp"
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
    inside = hn::And(is_between(last), hn::RebindMask(Ints(), hn::Lt(fraction, hn::Set(Floats(), 1.0f))));
  }

  /// @param u  of a coarse field, 2^-23 voxel
  HWY_INLINE Axis(Int u, Int voxel, std::int32_t last) {
    static_assert(kFixedBits == 23);
    // Its 23 bits, behind a leading one, are a float from 1 to 2: exact, and so is the difference.
    const Float one = hn::Set(Floats(), 1.0f);
    const Int rest = hn::And(u, hn::Set(Ints(), static_cast<std::int32_t>(kFixedOne - 1)));
    fraction = hn::Sub(hn::BitCast(Floats(), hn::Or(rest, hn::BitCast(Ints(), one))), one);
    base = hn::Add(voxel, hn::ShiftRight<kFixedBits>(u));
    inside = is_between(last);
  }

 private:
  HWY_INLINE hn::Mask<Ints> is_between(std::int32_t last) const {
    const hn::RebindToUnsigned<Ints> du;  // what is negative is larger than any
    return hn::RebindMask(Ints(), hn::Lt(hn::BitCast(du, base), hn::Set(du, static_cast<std::uint32_t>(last))));
  }
};

#if !HWY_NATIVE_FMA
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
/// One number after the other: the vectors of double that these targets have turn an infinite sum into the largest
/// float.
HWY_INLINE Float emulated_fma(Float x, Float y, Float z) {
  constexpr std::size_t kMost = 4;
  float of_x[kMost], of_y[kMost], of_z[kMost];
  hn::StoreU(x, Floats(), of_x);
  hn::StoreU(y, Floats(), of_y);
  hn::StoreU(z, Floats(), of_z);
  for (std::size_t n = 0; n < hn::Lanes(Floats()); ++n) of_z[n] = std::fma(of_x[n], of_y[n], of_z[n]);
  return hn::LoadU(Floats(), of_z);
}
#else
/// x y + z in double, with a last bit that makes the rounding to float that follows the only one: the product is exact,
/// and a sum that is not is rounded to the neighbour whose last bit is 1 ("round to odd", Boldo and Melquiond 2008).
template <class D, class Double = hn::Vec<D> >
HWY_INLINE Double odd_sum(D dd, Double x, Double y, Double z) {
  const hn::RebindToSigned<D> di;
  const Double product = hn::Mul(x, y), sum = hn::Add(product, z), of_z = hn::Sub(sum, product);
  const Double error = hn::Add(hn::Sub(product, hn::Sub(sum, of_z)), hn::Sub(z, of_z)), zero = hn::Zero(dd);
  const auto bits = hn::BitCast(di, sum), one = hn::Set(di, 1);
  const auto inexact = hn::RebindMask(di, hn::Or(hn::Lt(error, zero), hn::Gt(error, zero)));  // not where it is NaN
  const auto even = hn::Eq(hn::And(bits, one), hn::Zero(di));
  const auto outwards = hn::RebindMask(di, hn::Gt(hn::Mul(hn::CopySign(hn::Set(dd, 1), error), sum), zero));
  const auto odd = hn::IfThenElse(outwards, hn::Add(bits, one), hn::Sub(bits, one));
  return hn::BitCast(dd, hn::IfThenElse(hn::And(inexact, even), odd, bits));
}

HWY_INLINE Float emulated_fma(Float x, Float y, Float z) {
  const hn::RepartitionToWide<Floats> dd;
  const hn::Rebind<float, decltype(dd)> half;
  const auto low = odd_sum(dd, hn::PromoteTo(dd, hn::LowerHalf(half, x)), hn::PromoteTo(dd, hn::LowerHalf(half, y)),
                           hn::PromoteTo(dd, hn::LowerHalf(half, z))),
             high = odd_sum(dd, hn::PromoteTo(dd, hn::UpperHalf(half, x)), hn::PromoteTo(dd, hn::UpperHalf(half, y)),
                            hn::PromoteTo(dd, hn::UpperHalf(half, z)));
  return hn::Combine(Floats(), hn::DemoteTo(half, high), hn::DemoteTo(half, low));
}
#endif
#endif

/// x y + z, rounded once.
HWY_INLINE Float fused(Float x, Float y, Float z) {
#if HWY_NATIVE_FMA
  return hn::MulAdd(x, y, z);
#else
  return emulated_fma(x, y, z);
#endif
}

/// a + t (b - a), rounded as the field has it.
template <Lerp kLerp>
HWY_INLINE Float mix(Float a, Float b, Float t) {
  if constexpr (kLerp == Lerp::fused) return fused(t, hn::Sub(b, a), a);
  return hn::Add(a, hn::Mul(t, hn::Sub(b, a)));
}

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

/// The nearest whole number, an even one between two, of values below 2^22: floats from 2^23 to 2^24 are whole numbers.
HWY_INLINE Int nearest_whole(Float value) {
  const Float lift = hn::Set(Floats(), 0x1.8p23f);
  return hn::Sub(hn::BitCast(Ints(), hn::Add(value, lift)), hn::BitCast(Ints(), lift));
}

/// The sample of whole numbers, to the nearest one. A corner without weight changes nothing.
template <Lerp kLerp>
HWY_INLINE Int interpolated(const Corners<Int>& at, const Fractions& t) {
  const auto along_x = [&](int c) {
    return mix<kLerp>(hn::ConvertTo(Floats(), at.value[c]), hn::ConvertTo(Floats(), at.value[c + 1]), t.x);
  };
  const auto along_y = [&](int c) { return mix<kLerp>(along_x(c), along_x(c + 2), t.y); };
  return nearest_whole(mix<kLerp>(along_y(0), along_y(4), t.z));
}

/// The sample of floats: a corner without weight does not count, even if it is infinite or no number; a copy is one to
/// the bit; and all that is no number is one and the same NaN.
template <Lerp kLerp>
HWY_INLINE Float interpolated(const Corners<Float>& at, const Fractions& t) {
  const Floats df;
  const auto along_x = [&](int c) {
    return hn::IfThenElse(t.no_x, at.value[c], mix<kLerp>(at.value[c], at.value[c + 1], t.x));
  };
  const auto along_y = [&](int c) {
    const Float low = along_x(c);
    return hn::IfThenElse(t.no_y, low, mix<kLerp>(low, along_x(c + 2), t.y));
  };
  const Float low = along_y(0);
  const Float value = hn::IfThenElse(t.no_z, low, mix<kLerp>(low, along_y(4), t.z));
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
  const Value* label = at.value;
  auto uniform = same_label(label[0], label[1]);
  for (int c = 2; c < 8; ++c) uniform = hn::And(uniform, same_label(label[0], label[c]));
  if (hn::AllTrue(df, uniform)) return label[0];
  at.leave_out_weightless(t);
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
  HWY_ALIGN typename Pair<V>::Bits pairs[4][kRoomTogether];

  /// Loads sample after sample: cheaper than gathers, which some processors make of many steps, and no vector waits for
  /// it.
  HWY_INLINE Samples(const LinearSource& source, const LinearPlaces& places) {
    const std::int64_t row = source.layout.row, slice = source.layout.slice, steps[4] = {0, row, slice, slice + row};
    const V* voxels = static_cast<const V*>(source.voxels);
    const int count = places.count;
    if (places.in_a_row) {
      for (int i = 0; i < count; i += kVoxelsInLine) prefetch(voxels + places.at[i] + 2 * slice);
      prefetch(voxels + places.at[count - 1] + 2 * slice);
    } else {
      for (int i = 0; i < count; i += 4) prefetch(voxels + places.at[i] + 2 * slice);
    }
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

struct Axes {
  Axis x, y, z;
};

/// A vector of output voxels.
struct Voxels {
  Int x, y, z;
  hn::Mask<Ints> mapped;
};

HWY_INLINE Voxels voxels_at(const Row& row, int i) {
  const Ints di;
  const hn::Rebind<std::uint8_t, Ints> d8;
  const glm::ivec3 first(row.voxel);
  return {hn::Iota(di, first.x + i), hn::Set(di, first.y), hn::Set(di, first.z),
          hn::Gt(hn::PromoteTo(di, hn::LoadU(d8, row.mapped + i)), hn::Zero(di))};
}
/// The same counted from the first voxel of the tile.
HWY_INLINE Voxels in_tile_at(const VoxelList& list, int i) {
  constexpr int kBits = VoxelList::kAxisBits;
  const Ints di;
  const Int number = hn::PromoteTo(di, hn::LoadU(hn::Rebind<std::uint16_t, Ints>(), list.numbers + i)),
            most = hn::Set(di, kTile - 1);
  return {hn::And(number, most), hn::And(hn::ShiftRight<kBits>(number), most), hn::ShiftRight<2 * kBits>(number),
          hn::FirstN(di, static_cast<std::size_t>(list.count - i))};
}
HWY_INLINE Voxels voxels_at(const VoxelList& list, int i) {
  const Ints di;
  const glm::ivec3 first(list.first);
  const Voxels in = in_tile_at(list, i);
  return {hn::Add(hn::Set(di, first.x), in.x), hn::Add(hn::Set(di, first.y), in.y), hn::Add(hn::Set(di, first.z), in.z),
          in.mapped};
}

/// Whether the slices of the source are wanted of all voxels together.
constexpr bool has_slices(const Row&) { return true; }
constexpr bool has_slices(const VoxelList&) { return false; }

/// How many voxels vectors take: of a row, whole vectors only, for others share memory with what lies behind it.
HWY_INLINE int count_in_vectors(const Row& row, int lanes) { return row.count / lanes * lanes; }
HWY_INLINE int count_in_vectors(const VoxelList& list, int lanes) { return (list.count + lanes - 1) / lanes * lanes; }

/// Computes the places of voxels in whole vectors.
/// @param axes_at  `axes_at(i, voxels)` makes the axes of a vector of voxels, the i-th and on
template <class OutputVoxels, class AxesAt>
HWY_INLINE void find_with(const LinearLayout& layout, const OutputVoxels& output, LinearPlaces& places,
                          AxesAt&& axes_at) {
  const Floats df;
  const Ints di;
  const hn::Rebind<std::uint8_t, Floats> d8;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const Int stride_row = hn::Set(di, layout.row), stride_slice = hn::Set(di, layout.slice);
  // Offset of the buffer's first voxel. Numbers may wrap around, for their differences fit.
  const auto begin = static_cast<std::int32_t>(std::int64_t{layout.begin.z} * layout.slice +
                                               std::int64_t{layout.begin.y} * layout.row + layout.begin.x);
  Int least = hn::Set(di, INT32_MAX), most = hn::Set(di, INT32_MIN);
  std::size_t sampled = 0;
  const int count = count_in_vectors(output, lanes);
  for (int i = 0; i < count; i += lanes) {
    const Voxels voxels = voxels_at(output, i);
    const auto [x, y, z] = axes_at(i, voxels);
    const Int at = hn::Sub(hn::Add(hn::Add(hn::Mul(z.base, stride_slice), hn::Mul(y.base, stride_row)), x.base),
                           hn::Set(di, begin));
    const auto good = hn::And(hn::And(voxels.mapped, x.inside), hn::And(y.inside, z.inside));
    hn::Store(hn::IfThenElseZero(good, at), di, places.at + i);
    hn::Store(x.fraction, df, places.x + i);
    hn::Store(y.fraction, df, places.y + i);
    hn::Store(z.fraction, df, places.z + i);
    hn::Store(z.base, di, places.slice + i);
    hn::StoreU(hn::DemoteTo(d8, hn::IfThenElse(good, hn::Set(di, 1), hn::Set(di, 2))), d8,
               reinterpret_cast<std::uint8_t*>(places.state) + i);
    sampled += hn::CountTrue(di, good);
    if (!has_slices(output)) continue;
    const auto between = hn::RebindMask(di, hn::Ne(z.fraction, hn::Zero(df)));
    const Int top = hn::Add(z.base, hn::IfThenElseZero(between, hn::Set(di, 1)));
    least = hn::Min(least, hn::IfThenElse(good, z.base, hn::Set(di, INT32_MAX)));
    most = hn::Max(most, hn::IfThenElse(good, top, hn::Set(di, INT32_MIN)));
  }
  for (int i = count; i < output.count; ++i) places.state[i] = RowState::left;
  places.count = count;
  places.sampled = static_cast<int>(sampled);
  if (sampled == 0 || !has_slices(output)) return;
  places.slices = {hn::GetLane(hn::MinOfLanes(di, least)), hn::GetLane(hn::MaxOfLanes(di, most))};
}

template <class OutputVoxels>
HWY_INLINE void find_places(const LinearLayout& layout, const OutputVoxels& output, LinearPlaces& places) {
  places.fused = output.fixed != nullptr;
  const glm::ivec3& last = layout.last;
  if (!output.fixed) {
    find_with(layout, output, places, [&](int i, const Voxels& voxels) {
      Float ux, uy, uz;
      hn::LoadInterleaved3(Floats(), &output.offset[i].x, ux, uy, uz);
      return Axes{Axis(ux, voxels.x, last.x), Axis(uy, voxels.y, last.y), Axis(uz, voxels.z, last.z)};
    });
  } else if (!output.fixed->is_wide()) {
    const auto& u = output.fixed->u;
    find_with(layout, output, places, [&](int i, const Voxels& voxels) {
      const Ints di;
      return Axes{Axis(hn::LoadU(di, u[0] + i), voxels.x, last.x), Axis(hn::LoadU(di, u[1] + i), voxels.y, last.y),
                  Axis(hn::LoadU(di, u[2] + i), voxels.z, last.z)};
    });
  } else {  // further than 32 bits reach
    std::fill(places.state, places.state + output.count, RowState::left);
    places.count = places.sampled = 0;
  }
}

void find_of_row(const LinearLayout& layout, const Row& row, LinearPlaces& places) { find_places(layout, row, places); }
void steps_of_list(const VoxelList& list, std::int32_t row, std::int32_t slice, std::int32_t (&to)[kRoomTogether]) {
  const Ints di;
  for (int i = 0; i < list.count; i += static_cast<int>(hn::Lanes(di))) {
    const Voxels in = in_tile_at(list, i);
    const Int along_j = hn::Mul(in.y, hn::Set(di, row)), along_k = hn::Mul(in.z, hn::Set(di, slice));
    hn::StoreU(hn::Add(in.x, hn::Add(along_j, along_k)), di, to + i);
  }
}
void find_of_list(const LinearLayout& layout, const VoxelList& list, LinearPlaces& places) {
  find_places(layout, list, places);
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
    const Samples<V> samples(source, places);
    if (places.fused)
      samples.write(places, to, [](const auto& at, const Fractions& t) { return interpolated<Lerp::fused>(at, t); });
    else
      samples.write(places, to, [](const auto& at, const Fractions& t) { return interpolated<Lerp::separate>(at, t); });
  });
}

void nearest_of(const LinearLayout& layout, const LinearPlaces& places, std::int32_t (&at)[kRoomTogether]) {
  const Ints di;
  const auto lanes = static_cast<int>(hn::Lanes(di));
  for (int i = 0; i < places.count; i += lanes) {
    const auto step = [&](const float* fraction, std::int32_t to_next) {
      const auto is_next = hn::Ge(hn::Load(Floats(), fraction + i), hn::Set(Floats(), 0.5f));
      return hn::IfThenElseZero(hn::RebindMask(di, is_next), hn::Set(di, to_next));
    };
    const Int steps = hn::Add(hn::Add(step(places.x, 1), step(places.y, layout.row)), step(places.z, layout.slice));
    hn::StoreU(hn::Add(hn::Load(di, places.at + i), steps), di, at + i);
  }
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

HWY_EXPORT(find_of_row);
HWY_EXPORT(find_of_list);
HWY_EXPORT(steps_of_list);
HWY_EXPORT(sample_linear);
HWY_EXPORT(sample_votes);
HWY_EXPORT(nearest_of);

bool LinearPlaces::begins(const LinearLayout& layout) {
  if (found_ && layout == layout_) return false;
  slices = {};
  layout_ = layout;
  return found_ = true;
}

void LinearPlaces::find(const LinearLayout& layout, const Row& row) {
  if (begins(layout)) HWY_DYNAMIC_DISPATCH(find_of_row)(layout, row, *this);
}

void LinearPlaces::find(const LinearLayout& layout, const VoxelList& list) {
  in_a_row = false;
  if (begins(layout)) HWY_DYNAMIC_DISPATCH(find_of_list)(layout, list, *this);
}

void find_steps(const VoxelList& list, std::int32_t row, std::int32_t slice, std::int32_t (&to)[kRoomTogether]) {
  HWY_DYNAMIC_DISPATCH(steps_of_list)(list, row, slice, to);
}

void find_nearest(const LinearLayout& layout, const LinearPlaces& places, std::int32_t (&at)[kRoomTogether]) {
  HWY_DYNAMIC_DISPATCH(nearest_of)(layout, places, at);
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
