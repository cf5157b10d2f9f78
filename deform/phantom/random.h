// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

namespace tetwarp::phantom {

/// Counter-based random numbers: they depend on the key alone, so they are the same for any order and number of
/// threads. This is the finaliser of SplitMix64 (Steele, Lea, Flood 2014).
constexpr std::uint64_t hash(std::uint64_t key) {
  key += 0x9e3779b97f4a7c15u;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
  return key ^ (key >> 31);
}

/// A random number, uniform in [-1, 1), of 24 bits.
constexpr float uniform(std::uint64_t key) { return static_cast<float>(hash(key) >> 40) * 0x1p-23f - 1.0f; }

/// A random number, nearly normal with mean 0 and variance 1: the sum of four uniform numbers of 16 bits (Irwin-Hall),
/// within +-3.5.
constexpr float normal(std::uint64_t key) {
  const std::uint64_t bits = hash(key);
  const auto sum =
      static_cast<std::int32_t>((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48));
  constexpr float kScale = 1.7320508f / 65536.0f;  // the sum of four has the variance 4 / 12
  return static_cast<float>(sum - 2 * 65536) * kScale;
}

/// A stream of random numbers for building things one after another. Draw them in braces or one to a statement: the
/// order in which a call's arguments are evaluated differs between compilers.
class Random {
 public:
  explicit Random(std::uint64_t seed) : key_(hash(seed)) {}
  float uniform() { return phantom::uniform(++key_); }
  float between(float low, float high) { return low + (0.5f * uniform() + 0.5f) * (high - low); }

 private:
  std::uint64_t key_;
};

}  // namespace tetwarp::phantom
