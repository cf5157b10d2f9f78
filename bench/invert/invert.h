// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <span>

#include "bench/harness/known_fields.h"
#include "bench/harness/results.h"

namespace tetwarp::bench {

/// An inverse displacement field beside what is known of it. A vector that is not finite counts as none.
struct Accuracy {
  std::uint64_t with_source = 0;  ///< voxels whose undeformed place lies in the lattice
  std::uint64_t left_out = 0;     ///< of these, without a vector
  /// Distances from the known inverse, voxels, over the others of these; NaN where no inverse is known.
  double mean = 0, percentile_99 = 0, largest = 0;
  bool is_compared() const { return !std::isnan(mean); }

  /// Voxels whose undeformed place lies outside the lattice, by more than 1/1024 voxel: nearer, rounding decides, and
  /// what is found there counts nowhere.
  std::uint64_t without_source = 0;
  std::uint64_t written = 0;      ///< of these, with a vector
  std::uint64_t zero = 0;         ///< of those written, zero vectors: "what is here was here before"
  std::uint64_t pointing_in = 0;  ///< of those written, to a place in the lattice: a warp takes a value from there
};

/// @param inverse  undeformed minus deformed place, on the field's lattice, i fastest
/// @throws InputError for another number of vectors than the lattice has vertices
Accuracy compare_inverse(const KnownField& known, std::span<const glm::vec3> inverse);

/// One program's inverse of one field. @param times  "ms" and "cpu_ms"
Json inverse_json(const std::string& field, const std::string& by, const Samples& times, const Accuracy& found);

/// A row for each field and program, Tetwarp's first; all of a field on the same threads, in turn.
Json measure_invert(const Options& options);

/// What was measured of what Tetwarp's inverse is held to.
Floors find_invert_floors(const Json& document);

}  // namespace tetwarp::bench
