// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

/// Bits of words: fields with names, masks, and rows with a bit for each voxel.
namespace tetwarp::cuda_detail {

/// A field of a packed word: bits kFirst to kFirst + kBits - 1. A packed word is described by a list of fields, each
/// of which begins where the one before ends, so that the layout is written once and in one place:
///
///     31          12 11       5 4      0
///     +-------------+----------+--------+        using Lane = BitField<0, 5>;
///     |   Attempt   |  Slice   |  Lane  |        using Slice = BitField<Lane::kEnd, 7>;
///     +-------------+----------+--------+        using Attempt = BitField<Slice::kEnd, 20>;
///                                                static_assert(Attempt::kEnd == 32);
///
/// A field that takes the highest bits of a signed word is signed.
///
/// Plain shifts and masks: `cuda::bitfield_extract` and `cuda::bitfield_insert` of libcu++ prepare masks as well, and
/// four fields of one word took 24 instructions with them and 22 so (nvcc 13.0, sm_90).
template <int kFirst, int kBits, class Word = unsigned>
struct BitField {
  static constexpr int kEnd = kFirst + kBits;  ///< where the next field begins
  static constexpr int kWidth = 8 * sizeof(Word);
  static_assert(kBits > 0 && kEnd <= kWidth);
  static constexpr Word kMost = ((Word{1} << (kBits - 1)) - 1) + (Word{1} << (kBits - 1));  ///< the largest value

  /// @param value  a whole number from 0 to kMost, of any type
  /// @return the same type: a word is cast when it is whole, so that arithmetic with int stays arithmetic with int
  template <class Value>
  __host__ __device__ static constexpr auto put(Value value) {
    return value << kFirst;
  }
  __host__ __device__ static constexpr Word get(Word word) {
    if constexpr (kEnd == kWidth) return word >> kFirst;
    return word >> kFirst & kMost;
  }
};

/// The lowest `count` bits. @param count  1 to 32
__device__ inline std::uint32_t lowest_bits(int count) { return ~0u >> (32 - count); }
/// The bits below bit n. @param n  0 to 31
__device__ inline std::uint32_t bits_below(int n) { return (1u << n) - 1; }
/// Number of the lowest bit of a word that is not 0. A loop over the bits of a word goes on with `bits & (bits - 1)`.
__device__ inline int first_bit(std::uint32_t bits) { return __ffs(static_cast<int>(bits)) - 1; }
/// Number of the highest bit of a word that is not 0.
__device__ inline int last_bit(std::uint32_t bits) { return 31 - __clz(static_cast<int>(bits)); }

/// A box of bits, one for each voxel. Each row, the voxels along i, begins at a word:
///
///     word 0                word 1                word 2, the last of the row
///     bit 0 ........ 31     bit 0 ........ 31     bit 0 .... | unused
///     i = 0 ........ 31     i = 32 ....... 63     i = 64 ... size.x - 1
struct BitRows {
  const std::uint32_t* words;
  int words_per_row;
};

/// Place of a bit among the words of `BitRows`, in one number:
///
///     31            5 4     0
///     +--------------+-------+
///     |     Word     |  Bit  |
///     +--------------+-------+
struct BitNumber {
  using Bit = BitField<0, 5>;
  using Word = BitField<Bit::kEnd, 27>;
  static_assert(Word::kEnd == 32);

  __host__ __device__ static constexpr unsigned of(unsigned word, int bit) {
    return Word::put(word) | static_cast<unsigned>(Bit::put(bit));
  }
};

/// Mask of those bits of a word of a row that lie from `first` to `last` of the row, both included; the word must
/// contain some of them.
__device__ inline std::uint32_t bits_of_word(int word, int first, int last) {
  std::uint32_t mask = ~0u;
  if (word == first / 32) mask &= ~0u << (first & 31);
  if (word == last / 32) mask &= ~0u >> (31 - (last & 31));
  return mask;
}

}  // namespace tetwarp::cuda_detail
