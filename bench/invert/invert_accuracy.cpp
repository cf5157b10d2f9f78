// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>

namespace tetwarp::bench {

namespace {

constexpr double kRounding = 1.0 / 1024;

/// What one slice holds.
struct Slice {
  Accuracy counts;
  std::vector<double> errors = {};
};

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool is_inside(const glm::dvec3& place, const Geometry& lattice) {
  const glm::dvec3 last(lattice.size - std::int64_t{1});
  return place == glm::clamp(place, glm::dvec3(0), last);
}

void look_at(const Origin& origin, const glm::dvec3& voxel, const glm::vec3& found, const Geometry& lattice,
             Slice& slice) {
  Accuracy& counts = slice.counts;
  const bool written = is_finite(found);
  if (origin.outside <= 0) {
    ++counts.with_source;
    if (written)
      slice.errors.push_back(glm::distance(glm::dvec3(found), origin.displacement));
    else
      ++counts.left_out;
  } else if (origin.outside > kRounding) {
    ++counts.without_source;
    counts.written += written;
    counts.zero += found == glm::vec3(0);
    counts.pointing_in += written && is_inside(voxel + glm::dvec3(found), lattice);
  }
}

}  // namespace

Accuracy compare_inverse(const KnownField& known, std::span<const glm::vec3> inverse) {
  const Geometry& lattice = known.field.lattice;
  const glm::i64vec3 size = lattice.size;
  require(inverse.size() == static_cast<std::size_t>(voxel_count(lattice)),
          std::to_string(inverse.size()) + " vectors for a lattice of " + to_string(size) + " vertices");
  std::vector<Slice> slices(static_cast<std::size_t>(size.z));
  tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
    Slice& slice = slices[static_cast<std::size_t>(k)];
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const glm::dvec3 voxel(i, j, k);
        const std::size_t n = static_cast<std::size_t>((k * size.y + j) * size.x + i);
        look_at(known.origin(voxel), voxel, inverse[n], lattice, slice);
      }
    }
  });
  Accuracy all;
  std::vector<double> errors;
  for (Slice& slice : slices) {
    all.with_source += slice.counts.with_source;
    all.left_out += slice.counts.left_out;
    all.without_source += slice.counts.without_source;
    all.written += slice.counts.written;
    all.zero += slice.counts.zero;
    all.pointing_in += slice.counts.pointing_in;
    errors.insert(errors.end(), slice.errors.begin(), slice.errors.end());
    slice.errors = {};
  }
  if (errors.empty() || std::isnan(errors.front())) {
    all.mean = all.percentile_99 = all.largest = NAN;
    return all;
  }
  tbb::parallel_sort(errors.begin(), errors.end());
  all.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  all.percentile_99 = quantile(errors, 0.99);
  all.largest = errors.back();
  return all;
}

}  // namespace tetwarp::bench
