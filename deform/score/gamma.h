// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/resampler.h"

namespace tetwarp::score {

/// When two doses agree. The defaults are those of AAPM TG-218 (Miften et al., Med. Phys. 45, 2018).
struct GammaCriterion {
  double dose_percent = 3;        ///< of the largest dose of the reference (global normalisation)
  double distance_mm = 2;         ///< distance to agreement
  double threshold_percent = 10;  ///< of the largest dose: lower doses of the reference are not compared
};

/// How many doses agree.
struct GammaScore {
  std::uint64_t points = 0;   ///< voxels of the reference that were compared
  std::uint64_t passing = 0;  ///< of these, those with a gamma index of at most 1
  double largest_dose = 0;    ///< of the reference, in its unit
  /// Share that passes, %; 100 where nothing was compared.
  double passing_percent() const {
    return points == 0 ? 100 : 100.0 * static_cast<double>(passing) / static_cast<double>(points);
  }
};

/// The gamma index of a dose (Low et al., Med. Phys. 25, 1998, equation 4): a voxel passes if within the distance to
/// agreement there is a place whose dose differs so little that (distance / most)^2 + (difference / most)^2 <= 1. The
/// evaluated dose is looked up between its voxels, trilinearly, at places a tenth of the distance apart.
/// @param reference  doses, one component, the whole volume
/// @param evaluated  doses on the same grid
/// @param criterion  what passes
/// @param limits     number of threads
/// @param control    progress and stop
/// @throws InputError for views that do not fit, a reference without a dose above 0, or criteria that are not above 0
/// @throws Cancelled
GammaScore gamma_score(const ConstVolumeView& reference, const ConstVolumeView& evaluated,
                       const GammaCriterion& criterion = {}, const Limits& limits = {}, const Control& control = {});

}  // namespace tetwarp::score
