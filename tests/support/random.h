// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

namespace tetwarp::test {

/// A whole number from the environment; `otherwise` if it is not there.
inline std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// The seed of this run: $TETWARP_TEST_SEED, or another one each time. Random tests show it when they fail:
/// SCOPED_TRACE(seed_text(seed)).
inline std::uint64_t test_seed() {
  static const std::uint64_t seed = [] { return number_from("TETWARP_TEST_SEED", std::random_device{}()); }();
  return seed;
}

/// How many cases a random test looks at: `usual`, or $TETWARP_TEST_CASES if that is less, for tools that make tests
/// slow.
inline std::uint64_t test_cases(std::uint64_t usual) {
  const std::uint64_t wanted = number_from("TETWARP_TEST_CASES", usual);
  return wanted == 0 || wanted > usual ? usual : wanted;
}

inline std::string seed_text(std::uint64_t seed) { return "TETWARP_TEST_SEED=" + std::to_string(seed); }

/// Random numbers for case number `stream` of a test.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : engine_(seed * 0x9E3779B97F4A7C15u + stream) {}

  /// A whole number from low to high, both included.
  std::int64_t integer(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(engine_);
  }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  int axis() { return static_cast<int>(integer(0, 2)); }
  bool chance(double probability) { return real(0, 1) < probability; }
  template <class T, std::size_t kCount>
  T one_of(const T (&values)[kCount]) {
    return values[integer(0, static_cast<std::int64_t>(kCount) - 1)];
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace tetwarp::test
