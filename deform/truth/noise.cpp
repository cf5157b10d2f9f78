// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/noise.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "deform/cpu/tiles.h"
#include "deform/errors.h"
#include "deform/fields/sincos.h"
#include "deform/phantom/random.h"

namespace tetwarp::truth {

namespace {

/// The smoothed noise of one slice, of variance 1.
class SliceNoise {
 public:
  SliceNoise(const Noise& noise, const glm::i64vec3& size, std::int64_t slice, std::uint64_t seed)
      : noise_(noise), columns_(size.x + 2 * noise.radius) {
    // More voxels on each side, so that the rim is smoothed as the rest is.
    const std::int64_t rows = size.y + 2 * noise.radius;
    std::uint64_t key = phantom::hash(seed) + static_cast<std::uint64_t>(slice * columns_ * rows);
    white_.resize(static_cast<std::size_t>(columns_ * rows));
    for (float& number : white_) number = phantom::normal(key++);
  }

  /// The noise of row j: the sum over the kernel, weight by weight in its order.
  void row(std::int64_t j, std::span<float> sum) const {
    std::fill(sum.begin(), sum.end(), 0.0f);
    const std::int64_t width = 2 * noise_.radius + 1;
    for (std::int64_t n = 0; n < width * width; ++n) {
      const float weight = noise_.kernel[static_cast<std::size_t>(n)];
      const float* white = white_.data() + (j + n / width) * columns_ + n % width;
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * white[i];
    }
  }

 private:
  const Noise& noise_;
  std::int64_t columns_;
  std::vector<float> white_;
};

/// Sums over pairs of slices, from which the autocovariance follows.
struct LagSums {
  static constexpr int kMost = 4;  ///< largest lag along an axis
  static constexpr int kLags = 2 * kMost + 1;

  std::uint64_t voxels = 0;
  double sum = 0;
  /// By lag (dx, dy), of which dy >= 0: products of differences, and how many there are.
  std::array<double, std::size_t{kLags} * (kMost + 1)> products{};
  std::array<std::uint64_t, std::size_t{kLags} * (kMost + 1)> counts{};

  static std::size_t at(int dx, int dy) { return static_cast<std::size_t>(dx + kMost + kLags * dy); }

  void add(const LagSums& other) {
    voxels += other.voxels;
    sum += other.sum;
    for (std::size_t n = 0; n < products.size(); ++n) {
      products[n] += other.products[n];
      counts[n] += other.counts[n];
    }
  }
  /// Half the autocovariance of the differences: that of one slice.
  double covariance(int dx, int dy) const {
    if (dy < 0) return covariance(-dx, -dy);
    const std::size_t n = at(dx, dy);
    const double mean = sum / static_cast<double>(voxels);
    return counts[n] == 0 ? 0 : 0.5 * (products[n] / static_cast<double>(counts[n]) - mean * mean);
  }
};

/// Looks at a slice and the next one.
template <class V>
LagSums look_at_pair(const V* slice, const V* next, const glm::i64vec3& size) {
  constexpr double kLow = -50, kHigh = 150;
  const auto area = static_cast<std::size_t>(size.x * size.y);
  std::vector<std::uint8_t> is_soft(area), counts(area);
  std::vector<double> difference(area);
  for (std::size_t n = 0; n < area; ++n) {
    const auto a = static_cast<double>(slice[n]), b = static_cast<double>(next[n]);
    is_soft[n] = a >= kLow && a <= kHigh && b >= kLow && b <= kHigh;
    difference[n] = b - a;
  }
  const auto at = [&](std::int64_t i, std::int64_t j) { return static_cast<std::size_t>(i + size.x * j); };
  LagSums sums;
  for (std::int64_t j = 1; j + 1 < size.y; ++j) {
    for (std::int64_t i = 1; i + 1 < size.x; ++i) {
      bool all = true;
      for (std::int64_t dy = -1; dy <= 1; ++dy)
        for (std::int64_t dx = -1; dx <= 1; ++dx) all = all && is_soft[at(i + dx, j + dy)];
      counts[at(i, j)] = all;
      sums.voxels += all;
      if (all) sums.sum += difference[at(i, j)];
    }
  }
  for (int dy = 0; dy <= LagSums::kMost; ++dy) {
    for (int dx = -LagSums::kMost; dx <= LagSums::kMost; ++dx) {
      double products = 0;
      std::uint64_t count = 0;
      for (std::int64_t j = 0; j + dy < size.y; ++j) {
        for (std::int64_t i = std::max(0, -dx); i < size.x - std::max(0, dx); ++i) {
          const std::size_t here = at(i, j), there = at(i + dx, j + dy);
          if (!counts[here] || !counts[there]) continue;
          products += difference[here] * difference[there];
          ++count;
        }
      }
      sums.products[LagSums::at(dx, dy)] = products;
      sums.counts[LagSums::at(dx, dy)] = count;
    }
  }
  return sums;
}

/// The kernel of zero phase whose power spectrum is that of an autocovariance.
std::vector<float> kernel_of(const LagSums& sums) {
  constexpr int kFrequencies = 16, kMost = LagSums::kMost;
  constexpr double kTurn = 2 * 3.14159265358979323846 / kFrequencies;
  std::array<double, kFrequencies> cosine{};
  for (int n = 0; n < kFrequencies; ++n) cosine[static_cast<std::size_t>(n)] = sin_cos(kTurn * n).cos;
  const auto wave = [&](int turns) {
    return cosine[static_cast<std::size_t>((turns % kFrequencies + kFrequencies) % kFrequencies)];
  };
  // Near lags count whole, far ones less, so that the spectrum has no ripples.
  const auto taper = [](int lag) { return std::min(1.0, (kMost + 1 - std::abs(lag)) / 3.0); };
  std::array<double, std::size_t{kFrequencies} * kFrequencies> amplitude{};
  for (int v = 0; v < kFrequencies; ++v) {
    for (int u = 0; u < kFrequencies; ++u) {
      double power = 0;
      for (int dy = -kMost; dy <= kMost; ++dy) {
        for (int dx = -kMost; dx <= kMost; ++dx) {
          power += taper(dx) * taper(dy) * sums.covariance(dx, dy) * wave(u * dx + v * dy);
        }
      }
      amplitude[static_cast<std::size_t>(u + kFrequencies * v)] = std::sqrt(std::max(power, 0.0));
    }
  }
  std::vector<double> weights;
  double squares = 0;
  for (int y = -kMost; y <= kMost; ++y) {
    for (int x = -kMost; x <= kMost; ++x) {
      double weight = 0;
      for (int v = 0; v < kFrequencies; ++v)
        for (int u = 0; u < kFrequencies; ++u)
          weight += amplitude[static_cast<std::size_t>(u + kFrequencies * v)] * wave(u * x + v * y);
      weights.push_back(weight);
      squares += weight * weight;
    }
  }
  std::vector<float> kernel;
  for (const double weight : weights) kernel.push_back(static_cast<float>(weight / std::sqrt(squares)));
  return kernel;
}

void require_whole(const ConstVolumeView& volume) {
  require(volume.voxels && volume.memory == Memory::host && volume.components == 1 &&
              volume.buffered == whole(*volume.geometry),
          "noise is that of a whole volume of one value a voxel in host memory");
}

template <class V>
V stored(double value) {
  if constexpr (std::is_floating_point_v<V>) return static_cast<V>(value);
  constexpr auto kLow = static_cast<double>(std::numeric_limits<V>::min()),
                 kHigh = static_cast<double>(std::numeric_limits<V>::max());
  return static_cast<V>(std::nearbyint(std::clamp(value, kLow, kHigh)));
}

}  // namespace

std::uint64_t noise_seed(std::uint64_t seed, std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return phantom::hash(hash ^ phantom::hash(seed));
}

Noise smoothed_noise(double deviation) {
  Noise noise{deviation, 1, {}};
  for (const float across : {1.0f, 2.0f, 1.0f})
    for (const float along : {1.0f, 2.0f, 1.0f}) noise.kernel.push_back(across * along * (1.0f / 6));
  return noise;
}

Noise measure_noise(const ConstVolumeView& volume, const Limits& limits, const Control& control) {
  constexpr std::int64_t kMostPairs = 32;
  constexpr std::uint64_t kFewest = 1000;
  require_whole(volume);
  const glm::i64vec3 size = volume.geometry->size;
  const std::int64_t area = size.x * size.y, pairs = std::min(size.z - 1, kMostPairs);
  std::vector<LagSums> sums(static_cast<std::size_t>(std::max<std::int64_t>(pairs, 0)));
  cpu::WorkProgress progress(control, pairs);
  cpu::Arena arena(limits);
  dispatch(volume.type, [&]<class V>(V) {
    const V* voxels = reinterpret_cast<const V*>(volume.voxels);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, pairs, [&](std::int64_t pair) {
        const V* slice = voxels + (2 * pair + 1) * (size.z - 1) / (2 * pairs) * area;
        sums[static_cast<std::size_t>(pair)] = look_at_pair(slice, slice + area, size);
        progress.done(1);
      });
    });
  });
  LagSums all;
  for (const LagSums& one : sums) all.add(one);
  require(all.voxels >= kFewest, "noise is measured in soft tissue, -50 to 150 HU, of which neighbouring slices have " +
                                     std::to_string(all.voxels) + " voxels in common; expected at least " +
                                     std::to_string(kFewest));
  const double variance = all.covariance(0, 0);
  if (variance <= 0) return smoothed_noise(0);
  return {std::sqrt(variance), LagSums::kMost, kernel_of(all)};
}

void add_noise(const ConstVolumeView& volume, const Noise& noise, std::uint64_t seed, const VolumeView& output,
               const Limits& limits) {
  constexpr double kAirHu = -1000;
  require_whole(volume);
  require(output.voxels && output.memory == Memory::host && output.components == 1 && volume.type == output.type &&
              output.buffered == volume.buffered,
          "noise is added into a volume of the same size and type in host memory");
  const glm::i64vec3 size = volume.geometry->size;
  cpu::Arena arena(limits);
  dispatch(volume.type, [&]<class V>(V) {
    const V* from = reinterpret_cast<const V*>(volume.voxels);
    V* to = reinterpret_cast<V*>(output.voxels);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
        const SliceNoise slice(noise, size, k, seed);
        std::vector<float> row(static_cast<std::size_t>(size.x));
        std::int64_t voxel = k * size.x * size.y;
        for (std::int64_t j = 0; j < size.y; ++j) {
          slice.row(j, row);
          for (const float grain : row) {
            const auto hu = static_cast<double>(from[voxel]);
            to[voxel] = hu < kAirHu ? from[voxel] : stored<V>(hu + noise.deviation * static_cast<double>(grain));
            ++voxel;
          }
        }
      });
    });
  });
}

}  // namespace tetwarp::truth
