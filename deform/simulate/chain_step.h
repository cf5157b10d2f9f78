// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/core/host_device.h"

/// ChainMail in whole numbers: what is done for one node, the same on every backend. chainmail.h says what is solved
/// and why the order of nodes does not matter.
namespace tetwarp::simulate {

/// Displacements are whole numbers of 2^-16 mm along the lattice's axes.
inline constexpr double kUnitsPerMm = 65536;
/// Largest displacement on an axis, 4096 mm in units, so that the sum of two displacements and a limit fits 32 bits.
inline constexpr std::int32_t kFarthest = std::int32_t{1} << 28;
/// A limit of this size never takes effect.
inline constexpr std::int32_t kLongest = 2 * kFarthest;

/// Displacement of a node in units of 2^-16 mm along the lattice's axes.
struct Units {
  alignas(16) std::int32_t at[3];
};

/// LinkLimits in whole units.
struct LinkUnits {
  std::int32_t shortest, longest, shear;

  /// The largest amount, units, by which the displacement of the upper end along an axis may exceed that of the lower
  /// end.
  TETWARP_HD std::int32_t above(bool own_axis) const { return own_axis ? longest : shear; }
  TETWARP_HD std::int32_t below(bool own_axis) const { return own_axis ? -shortest : shear; }
};

/// Nodes and links in the form that backends read, numbered as in ChainPlan.
struct ChainView {
  std::int32_t nodes;
  const std::int32_t* around;  ///< at (2 * axis + is_up) * nodes + node: the neighbour; -1: no link
  const LinkUnits* links;      ///< at axis * nodes + node: of the link up that axis
  const std::int32_t* shares;  ///< see ChainPlan::shares
  const std::uint8_t* moves;   ///< whether links lead from the node to a placed one
};

/// How far one step of relaxation goes towards the mean, and which part of the last motion it keeps; both times 2^12.
struct Pace {
  std::int32_t towards_mean, kept;
};
inline constexpr int kPaceBits = 12, kShareBits = 16;

/// Chooses the pace of each step. The first step is plain. The others keep momentum, half of which is given up whenever
/// the motion has not fallen for some time, since limits can keep a chain swinging.
struct Pacer {
  std::int32_t full, patience;  ///< momentum times 2^12, and patience in steps
  Pace pace{std::int32_t{1} << kPaceBits, 0};
  std::int32_t steps = 0;
  std::uint64_t least = ~std::uint64_t{0}, least_before = ~std::uint64_t{0};

  TETWARP_HD Pacer(std::int32_t kept, std::int32_t patient) : full(kept), patience(patient) {}

  /// Takes note of a step. @param motion  square of the largest motion in it
  TETWARP_HD void follow(std::uint64_t motion) {
    least = motion < least ? motion : least;
    if (++steps % patience == 0) {
      if (least >= least_before) full /= 2;
      least_before = least;
      least = ~std::uint64_t{0};
    }
    pace = {(std::int32_t{1} << kPaceBits) + full, full};
  }
};

TETWARP_HD inline std::int32_t smaller(std::int32_t a, std::int32_t b) { return a < b ? a : b; }
TETWARP_HD inline std::int32_t larger(std::int32_t a, std::int32_t b) { return a > b ? a : b; }

/// value / 2^bits, rounded to nearest, halves away from 0, so that a mirrored lattice gives the mirrored result.
TETWARP_HD inline std::int64_t rounded_shift(std::int64_t value, int bits) {
  const std::int64_t half = std::int64_t{1} << (bits - 1);
  return value < 0 ? -((half - value) >> bits) : (value + half) >> bits;
}

/// Lowers `upper` and raises `lower` of a node as far as the limits of its links to its neighbours demand.
///
/// Repeated for all nodes until nothing changes, in any order, this ends at the largest displacements within all limits
/// that nowhere exceed the `upper` of the start, and at the smallest that nowhere fall below the `lower`.
/// @return whether anything changed
TETWARP_HD inline bool tighten(const ChainView& chain, Units* upper, Units* lower, std::int32_t node) {
  Units high = upper[node], low = lower[node];
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t* around = chain.around + std::int64_t{2} * axis * chain.nodes + node;
    const std::int32_t down = around[0], up = around[chain.nodes];
    const LinkUnits* links = chain.links + std::int64_t{axis} * chain.nodes;
    if (up >= 0) {
      const LinkUnits link = links[node];
      const Units most = upper[up], least = lower[up];
      for (int c = 0; c < 3; ++c) {
        high.at[c] = smaller(high.at[c], most.at[c] + link.below(c == axis));
        low.at[c] = larger(low.at[c], least.at[c] - link.above(c == axis));
      }
    }
    if (down >= 0) {
      const LinkUnits link = links[down];
      const Units most = upper[down], least = lower[down];
      for (int c = 0; c < 3; ++c) {
        high.at[c] = smaller(high.at[c], most.at[c] + link.above(c == axis));
        low.at[c] = larger(low.at[c], least.at[c] - link.below(c == axis));
      }
    }
  }
  bool changed = false;
  for (int c = 0; c < 3; ++c) changed = changed || high.at[c] != upper[node].at[c] || low.at[c] != lower[node].at[c];
  if (changed) {
    upper[node] = high;
    lower[node] = low;
  }
  return changed;
}

/// The displacements that placed nodes leave to a node: from `least` to `most`.
struct DisplacementRange {
  Units least, most;
};

/// The range between the ends to which `tighten` led from the placed nodes. Where placed nodes contradict each other
/// the ends are crossed; each of them keeps all limits, and so do their componentwise minimum and maximum.
TETWARP_HD inline DisplacementRange range_between(const Units& upper, const Units& lower) {
  DisplacementRange range{};
  for (int c = 0; c < 3; ++c) {
    range.least.at[c] = smaller(upper.at[c], lower.at[c]);
    range.most.at[c] = larger(upper.at[c], lower.at[c]);
  }
  return range;
}

TETWARP_HD inline Units clamped(const Units& value, const DisplacementRange& range) {
  Units result{};
  for (int c = 0; c < 3; ++c) {
    result.at[c] = larger(range.least.at[c], smaller(value.at[c], range.most.at[c]));
  }
  return result;
}

/// Where a node goes in a step of relaxation towards the mean of its neighbours, before limits are applied. No product
/// exceeds 2^59.
/// @param before  where the nodes were one step ago
TETWARP_HD inline Units relaxed(const ChainView& chain, const Units* now, const Units* before,
                                const DisplacementRange& range, const Pace& pace, std::int32_t node) {
  const Units own = now[node];
  if (!chain.moves[node]) return own;
  std::int64_t pull[3][3] = {};
  int links[3] = {};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t* around = chain.around + std::int64_t{2} * axis * chain.nodes + node;
    for (int side = 0; side < 2; ++side) {
      const std::int32_t other = around[side == 0 ? 0 : chain.nodes];
      if (other < 0) continue;
      ++links[axis];
      for (int c = 0; c < 3; ++c) pull[axis][c] += now[other].at[c] - own.at[c];
    }
  }
  const std::int32_t* share = chain.shares + 3 * (links[0] + 3 * links[1] + 9 * links[2]);
  Units result{};
  for (int c = 0; c < 3; ++c) {
    const std::int64_t to_mean = pull[0][c] * share[0] + pull[1][c] * share[1] + pull[2][c] * share[2];
    const std::int64_t last = std::int64_t{own.at[c] - before[node].at[c]} * (std::int64_t{1} << kShareBits);
    const std::int64_t to =
        own.at[c] + rounded_shift(to_mean * pace.towards_mean + last * pace.kept, kShareBits + kPaceBits);
    const std::int64_t low = range.least.at[c], high = range.most.at[c];
    result.at[c] = static_cast<std::int32_t>(to < low ? low : to > high ? high : to);
  }
  return result;
}

/// The state halfway between two states that keep all limits, rounded towards 0, which keeps them, too. (The halves
/// rounded down, D, and rounded up, U, keep them, and so does 0; this is max(D, min(U, 0)).)
TETWARP_HD inline Units halfway(const Units& a, const Units& b) {
  Units result{};
  for (int c = 0; c < 3; ++c) result.at[c] = (a.at[c] + b.at[c]) / 2;
  return result;
}

/// Squared length of a motion, in units squared.
TETWARP_HD inline std::uint64_t square_of_motion(const Units& from, const Units& to) {
  std::int64_t sum = 0;
  for (int c = 0; c < 3; ++c) sum += std::int64_t{to.at[c] - from.at[c]} * (to.at[c] - from.at[c]);
  return static_cast<std::uint64_t>(sum);
}

/// The whole number nearest to a value, halves away from 0.
TETWARP_HD inline std::int32_t rounded(double value) {
  return value < 0 ? -static_cast<std::int32_t>(0.5 - value) : static_cast<std::int32_t>(value + 0.5);
}

/// A placed node, where it starts, and its goal.
struct PlacedNode {
  std::int32_t node;
  Units start, goal;

  TETWARP_HD Units at(double part) const {
    Units result{};
    for (int c = 0; c < 3; ++c) {
      const double way = static_cast<double>(goal.at[c]) - static_cast<double>(start.at[c]);
      result.at[c] = rounded(static_cast<double>(start.at[c]) + part * way);
    }
    return result;
  }
};

/// More than any length of a path. With the largest limit it is still less than 2^31.
inline constexpr std::int32_t kNoPath = std::int32_t{1} << 30;

/// What placed nodes that all go the same way leave to the others: their limits where these nodes do not move, and
/// where they are now. With paths of several such sets, the chain stage need not follow paths again (chainmail.h: U is
/// the least of u_f + d(f, v), and u_f is the same for all nodes of a set).
struct SetPaths {
  static constexpr int kMost = 8;

  int count = 0;  ///< of sets
  std::int32_t nodes = 0;
  Units at[kMost];  ///< displacement of each set
  /// At set * nodes + node: the largest displacement; kNoPath where nothing holds the node.
  const Units* upper = nullptr;
  /// The smallest; -kNoPath where nothing holds the node.
  const Units* lower = nullptr;

  TETWARP_HD DisplacementRange range(std::int32_t node) const {
    Units high{{kFarthest, kFarthest, kFarthest}}, low{{-kFarthest, -kFarthest, -kFarthest}};
    for (int set = 0; set < count; ++set) {
      const Units& above = upper[std::int64_t{set} * nodes + node];
      const Units& below = lower[std::int64_t{set} * nodes + node];
      for (int c = 0; c < 3; ++c) {
        high.at[c] = smaller(high.at[c], at[set].at[c] + above.at[c]);
        low.at[c] = larger(low.at[c], at[set].at[c] + below.at[c]);
      }
    }
    return range_between(high, low);
  }
};

/// A displacement as LPS mm.
/// @param direction  directions of the lattice; if it is the identity, only the result is rounded
TETWARP_HD inline glm::vec3 to_lps(const glm::dmat3& direction, const Units& units) {
  constexpr double kMm = 1 / kUnitsPerMm;
  const double i = units.at[0] * kMm, j = units.at[1] * kMm, k = units.at[2] * kMm;
  const auto along = [&](int axis) {
    return static_cast<float>(direction[0][axis] * i + direction[1][axis] * j + direction[2][axis] * k);
  };
  return {along(0), along(1), along(2)};
}

}  // namespace tetwarp::simulate
