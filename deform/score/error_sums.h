// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "deform/distance_histogram.h"
#include "deform/score/registration_score.h"

namespace tetwarp::score {

/// Collects errors. Those of slices are added up in their order, so the sums do not depend on threads.
class ErrorSums {
 public:
  /// Adds a distance; where it is not finite, there is no place.
  void add_or_miss(double distance, const glm::dvec3& where) {
    if (!std::isfinite(distance)) {
      ++errors_.missing;
    } else {
      add(distance, where);
    }
  }
  std::uint64_t count() const { return errors_.points + errors_.missing; }
  void add(const ErrorSums& later) {
    if (later.errors_.points > 0 && (errors_.points == 0 || later.errors_.largest > errors_.largest)) {
      errors_.largest = later.errors_.largest;
      errors_.worst = later.errors_.worst;
    }
    errors_.points += later.errors_.points;
    errors_.missing += later.errors_.missing;
    sum_ += later.sum_;
    histogram_.add(later.histogram_);
  }
  Errors errors() const {
    Errors all = errors_;
    if (all.points == 0) return all;
    all.mean = sum_ / static_cast<double>(all.points);
    const auto percentile = [&](double part) { return std::min(histogram_.percentile(part, all.points), all.largest); };
    all.median = percentile(0.5);
    all.percentile_95 = percentile(0.95);
    all.percentile_99 = percentile(0.99);
    return all;
  }

 private:
  void add(double distance, const glm::dvec3& where) {
    ++errors_.points;
    sum_ += distance;
    histogram_.add(distance);
    if (distance > errors_.largest || errors_.points == 1) errors_.largest = distance, errors_.worst = where;
  }

  Errors errors_;
  double sum_ = 0;
  DistanceHistogram histogram_;
};

}  // namespace tetwarp::score
