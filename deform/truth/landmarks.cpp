// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/landmarks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <tuple>

#include "deform/cpu/tiles.h"
#include "deform/errors.h"

namespace tetwarp::truth {

namespace {

constexpr std::int64_t kBlock = 4, kWindow = 2;  // voxels: side of a block, and half of the side of a window

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
using Tensor = std::array<double, 6>;

/// det S / trace adj S; 0 for a tensor without an inverse.
double corner_strength(const Tensor& s) {
  const double a = s[1] * s[2] - s[5] * s[5], b = s[0] * s[2] - s[4] * s[4], c = s[0] * s[1] - s[3] * s[3];
  const double determinant = s[0] * a - s[3] * (s[3] * s[2] - s[5] * s[4]) + s[4] * (s[3] * s[5] - s[1] * s[4]);
  const double trace = a + b + c;
  return trace > 0 && determinant > 0 ? determinant / trace : 0;
}

/// A candidate.
struct Corner {
  double strength = 0;
  glm::i64vec3 at{0};
};

/// Gradients of a volume.
template <class V>
class Gradients {
 public:
  explicit Gradients(const ConstVolumeView& ct)
      : voxels_(reinterpret_cast<const V*>(ct.voxels)), size_(ct.geometry->size), half_(0.5 / ct.geometry->spacing) {}

  /// Adds the outer product of the gradient at a voxel that is not on a face.
  void add_to(Tensor& sum, const glm::i64vec3& at) const {
    const std::int64_t n = at.x + size_.x * (at.y + size_.y * at.z), row = size_.x, slice = size_.x * size_.y;
    const double x = half_.x * (hu(n + 1) - hu(n - 1)), y = half_.y * (hu(n + row) - hu(n - row)),
                 z = half_.z * (hu(n + slice) - hu(n - slice));
    sum[0] += x * x, sum[1] += y * y, sum[2] += z * z;
    sum[3] += x * y, sum[4] += x * z, sum[5] += y * z;
  }

 private:
  double hu(std::int64_t n) const { return std::clamp(static_cast<double>(voxels_[n]), -1000.0, 1000.0); }

  const V* voxels_;
  glm::i64vec3 size_;
  glm::dvec3 half_;
};

/// The best corner of a block. Every second voxel along each axis is looked at: windows of neighbours differ little.
template <class V>
Corner best_of_block(const Gradients<V>& gradients, const glm::i64vec3& block, const glm::i64vec3& size,
                     const std::vector<std::uint8_t>& body) {
  Corner best;
  const glm::i64vec3 first = glm::max(block * kBlock, glm::i64vec3(kWindow + 1)),
                     end = glm::min(block * kBlock + kBlock, size - (kWindow + 1));
  for (std::int64_t k = first.z; k < end.z; k += 2) {
    for (std::int64_t j = first.y; j < end.y; j += 2) {
      for (std::int64_t i = first.x; i < end.x; i += 2) {
        if (!body[static_cast<std::size_t>(i + size.x * (j + size.y * k))]) continue;
        Tensor sum{};
        for (std::int64_t dk = -kWindow; dk <= kWindow; ++dk) {
          for (std::int64_t dj = -kWindow; dj <= kWindow; ++dj) {
            for (std::int64_t di = -kWindow; di <= kWindow; ++di) gradients.add_to(sum, {i + di, j + dj, k + dk});
          }
        }
        const double strength = corner_strength(sum);
        if (strength > best.strength) best = {strength, {i, j, k}};
      }
    }
  }
  return best;
}

std::vector<Corner> candidates(const ConstVolumeView& ct, const std::vector<std::uint8_t>& body, const Limits& limits,
                               const Control& control) {
  const glm::i64vec3 size = ct.geometry->size, blocks = (size + (kBlock - 1)) / kBlock;
  std::vector<std::vector<Corner>> layers(static_cast<std::size_t>(blocks.z));
  cpu::WorkProgress progress(control, blocks.z);
  cpu::Arena arena(limits);
  dispatch(ct.type, [&]<class V>(V) {
    const Gradients<V> gradients(ct);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, blocks.z, [&](std::int64_t k) {
        for (std::int64_t j = 0; j < blocks.y; ++j) {
          for (std::int64_t i = 0; i < blocks.x; ++i) {
            const Corner best = best_of_block(gradients, {i, j, k}, size, body);
            if (best.strength > 0) layers[static_cast<std::size_t>(k)].push_back(best);
          }
        }
        progress.done(1);
      });
    });
  });
  std::vector<Corner> all;
  for (const std::vector<Corner>& layer : layers) all.insert(all.end(), layer.begin(), layer.end());
  return all;
}

/// Places that are far enough from each other, in a grid of cells as wide as that distance.
class Spread {
 public:
  explicit Spread(double apart_mm) : apart_(apart_mm) {}

  /// Takes a place unless one is near. @return whether it was taken
  bool take(const glm::dvec3& place) {
    const glm::i64vec3 cell(glm::floor(place / apart_));
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto found = cells_.find(key(cell + glm::i64vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const glm::dvec3& other : found->second) {
        const glm::dvec3 between = other - place;
        if (glm::dot(between, between) < apart_ * apart_) return false;
      }
    }
    cells_[key(cell)].push_back(place);
    return true;
  }

 private:
  using Key = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
  static Key key(const glm::i64vec3& cell) { return {cell.x, cell.y, cell.z}; }

  double apart_;
  std::map<Key, std::vector<glm::dvec3>> cells_;
};

}  // namespace

std::vector<glm::dvec3> find_landmarks(const ConstVolumeView& ct, const std::vector<std::uint8_t>& body,
                                       const LandmarkRules& rules, const Limits& limits, const Control& control) {
  require(ct.voxels && ct.memory == Memory::host && ct.components == 1 && ct.buffered == whole(*ct.geometry),
          "landmarks are sought in a whole volume of one value a voxel in host memory");
  require(std::ssize(body) == voxel_count(*ct.geometry), "landmarks want one mark a voxel");
  require(rules.apart_mm > 0, "landmarks have to be apart");
  std::vector<Corner> corners = candidates(ct, body, limits, control);
  // Of equal ones the first counts, so that the order is the same whatever sorts.
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.strength > b.strength; });
  const AffineMap point = point_from_index(*ct.geometry);
  Spread spread(rules.apart_mm);
  std::vector<glm::dvec3> landmarks;
  for (const Corner& corner : corners) {
    if (landmarks.size() == rules.most) break;
    const glm::dvec3 place = point(glm::dvec3(corner.at));
    if (spread.take(place)) landmarks.push_back(place);
  }
  return landmarks;
}

}  // namespace tetwarp::truth
