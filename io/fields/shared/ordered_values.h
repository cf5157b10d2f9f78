// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Values of vectors that a file has in any order of its axes.
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "deform/volume.h"

namespace tetwarp {

/// One axis of the values of a file.
struct ValueAxis {
  std::size_t size = 1;  ///< number of values along it
  /// How many floats apart neighbours lie where the vectors are stored (three floats each, i fastest); below 0 where
  /// the file begins with the last.
  std::ptrdiff_t step = 0;
};

/// How the values of a file lie.
struct ValueOrder {
  std::array<ValueAxis, 4> axes{};  ///< the slowest first: three of the grid, and that of the components
  VoxelType type = VoxelType::f32;  ///< f32 or f64
  bool big_endian = false;
};

/// The values' bytes in another order: big endian for little endian, or the other way round.
template <class Bits>
Bits reversed_bytes(Bits bits) {
  auto bytes = std::bit_cast<std::array<std::byte, sizeof(Bits)>>(bits);
  std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<Bits>(bytes);
}

/// `read_values` of one type. @tparam Bits  an unsigned integer of the size of a `Value`
template <class Value, class Bits, class Next, class Take>
void read_values_as(const ValueOrder& order, Next&& next, Take&& take) {
  const auto& [a, b, c, d] = order.axes;
  const bool swap = order.big_endian != (std::endian::native == std::endian::big);
  const auto begin = [](const ValueAxis& axis) {
    return axis.step < 0 ? -axis.step * (static_cast<std::ptrdiff_t>(axis.size) - 1) : std::ptrdiff_t{0};
  };
  std::vector<Bits> plane(c.size * d.size);
  std::ptrdiff_t at_a = begin(a) + begin(b) + begin(c) + begin(d);
  for (std::size_t i = 0; i < a.size; ++i, at_a += a.step) {
    std::ptrdiff_t at_b = at_a;
    for (std::size_t j = 0; j < b.size; ++j, at_b += b.step) {
      next(std::as_writable_bytes(std::span(plane)));
      const Bits* bits = plane.data();
      std::ptrdiff_t at_c = at_b;
      for (std::size_t k = 0; k < c.size; ++k, at_c += c.step) {
        std::ptrdiff_t at = at_c;
        for (std::size_t n = 0; n < d.size; ++n, at += d.step, ++bits)
          take(static_cast<std::size_t>(at), std::bit_cast<Value>(swap ? reversed_bytes(*bits) : *bits));
      }
    }
  }
}

/// Reads the values of a file in the file's order, a plane of its two fastest axes at a time.
/// @param order  how the values lie
/// @param next   called with a span of bytes, which it fills with the file's next ones
/// @param take   called with each value, float or double, and before it the place among the floats of the vectors
template <class Next, class Take>
void read_values(const ValueOrder& order, Next&& next, Take&& take) {
  if (order.type == VoxelType::f32) {
    read_values_as<float, std::uint32_t>(order, next, take);
  } else {
    read_values_as<double, std::uint64_t>(order, next, take);
  }
}

}  // namespace tetwarp
