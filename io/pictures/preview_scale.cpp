// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/preview_scale.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace tetwarp {

namespace {

/// The finite values in rising order.
std::vector<double> sorted(std::span<const double> values) {
  std::vector<double> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result),
               [](double value) { return std::isfinite(value); });
  std::sort(result.begin(), result.end());
  return result;
}

double percentile(const std::vector<double>& rising, double percent) {
  return rising[static_cast<std::size_t>(std::lround(percent / 100 * static_cast<double>(rising.size() - 1)))];
}

std::uint8_t byte(double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); }

Colour mix(const Colour& a, const Colour& b, double t) {
  Colour result;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = byte(a[i] + t * (b[i] - a[i]));
  return result;
}

constexpr double kSteps[] = {1, 2, 5, 10};

}  // namespace

Colour Window::operator()(double value) const {
  if (std::isnan(value)) return kNotANumber;
  const std::uint8_t grey = byte(255 * std::clamp((value - level) / width + 0.5, 0.0, 1.0));
  return {grey, grey, grey};
}

Window choose_window(std::span<const double> values, VoxelType type) {
  const std::vector<double> rising = sorted(values);
  if (rising.empty()) return {};
  const bool is_signed =
      type == VoxelType::i16 || type == VoxelType::i32 || type == VoxelType::f32 || type == VoxelType::f64;
  // HU: air is -1000, padding and metal go beyond these bounds
  constexpr double kAirAtMost = -500, kLeast = -5000, kMost = 40000;
  if (is_signed && rising.front() <= kAirAtMost && rising.front() >= kLeast && rising.back() <= kMost)
    return {1500, -200, true};
  double low = percentile(rising, 1), high = percentile(rising, 99);
  if (low == high) low = rising.front(), high = rising.back();
  if (low == high) return {1, low};
  return {high - low, 0.5 * (low + high)};
}

Colour DifferenceScale::operator()(double difference) const {
  if (std::isnan(difference)) return kNotANumber;
  constexpr Colour kNone = {0, 0, 0};
  constexpr Colour kLess = {24, 72, 224}, kLeast = {160, 240, 255}, kMore = {208, 32, 24}, kMost = {255, 236, 130};
  const double t = std::clamp(difference / range, -1.0, 1.0), size = std::abs(t);
  constexpr double kMiddle = 0.6;  // part of the way to the largest value at which black has become the full colour
  const Colour &full = t < 0 ? kLess : kMore, &end = t < 0 ? kLeast : kMost;
  return size < kMiddle ? mix(kNone, full, size / kMiddle) : mix(full, end, (size - kMiddle) / (1 - kMiddle));
}

DifferenceScale choose_difference_scale(std::span<const double> differences, bool hounsfield) {
  std::vector<double> sizes;
  for (const double difference : differences) {
    if (difference != 0) sizes.push_back(std::abs(difference));
  }
  const std::vector<double> rising = sorted(sizes);
  if (rising.empty()) return {.range = 1, .none = sizes.empty()};
  const double range = round_up_125(percentile(rising, 98));
  return {.range = hounsfield ? std::min(range, 1000.0) : range};
}

double round_down_125(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  double result = power;
  for (const double step : kSteps) {
    if (step * power <= value * (1 + 1e-9)) result = step * power;
  }
  return result;
}

double round_up_125(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double step : kSteps) {
    if (step * power >= value * (1 - 1e-9)) return step * power;
  }
  return 10 * power;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

}  // namespace tetwarp
