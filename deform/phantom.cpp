// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom.h"

#include <oneapi/tbb/parallel_for.h>

#include <array>

#include "deform/fields/sincos.h"
#include "deform/phantom/grain.h"
#include "deform/phantom/painter.h"
#include "deform/phantom/random.h"

namespace tetwarp {

namespace {

using namespace phantom;

// Sides in mm of the field of view for which the anatomy is written.
constexpr glm::dvec3 kBodySpace(410, 410, 300);
constexpr double kPi = 3.14159265358979323846;

/// How far each axis of the body is bent at each voxel: sums of two sine waves, in one table for each axis of the grid.
class Bending {
 public:
  Bending(const glm::i64vec3& size, std::uint64_t seed) {
    Random random(seed);
    for (int axis = 0; axis < 3; ++axis) {
      tables_[axis].resize(static_cast<std::size_t>(size[axis]), Point(0));
      for (const float waves : {1.1f, 2.7f}) add_wave(axis, size[axis], waves, 4.2f / (waves * waves + 1), random);
    }
  }
  Point at(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return tables_[0][static_cast<std::size_t>(i)] + tables_[1][static_cast<std::size_t>(j)] +
           tables_[2][static_cast<std::size_t>(k)];
  }

 private:
  void add_wave(int axis, std::int64_t size, double waves, double amplitude_mm, Random& random) {
    const glm::dvec3 phase{random.uniform(), random.uniform(), random.uniform()};
    for (std::int64_t i = 0; i < size; ++i) {
      const double turn = 2 * kPi * waves * (static_cast<double>(i) + 0.5) / static_cast<double>(size);
      for (int moved = 0; moved < 3; ++moved) {
        if (moved == axis) continue;  // an axis is bent by the two others, so lengths along it stay
        const double strength = moved == 2 ? 0.6 : 1.0;
        tables_[axis][static_cast<std::size_t>(i)][moved] +=
            static_cast<float>(strength * amplitude_mm * sin_cos(turn + kPi * phase[moved]).sin);
      }
    }
  }

  std::array<std::vector<Point>, 3> tables_;
};

/// Smooth random numbers, about -1 to 1: trilinear between the points of a lattice with distance `pitch_mm`.
class Texture {
 public:
  Texture(float pitch_mm, std::uint64_t seed) : pitch_mm_(pitch_mm), seed_(seed) {}

  /// Adds `weight` times the texture of a row to `sum`. The row is first cut into the cells of the lattice.
  void add(std::span<const float> x, float y, float z, float weight, std::span<float> sum) const {
    const Cell at_y = cell(y), at_z = cell(z);
    std::int32_t held = INT32_MIN;
    float left = 0, right = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Cell at_x = cell(x[i]);
      if (at_x.index != held) {
        held = at_x.index;
        left = edge(held, at_y, at_z);
        right = edge(held + 1, at_y, at_z);
      }
      sum[i] += weight * (left + at_x.part * (right - left));
    }
  }

 private:
  struct Cell {
    std::int32_t index;
    float part;  ///< place in the cell, eased so that the lattice does not show
  };
  Cell cell(float position) const {
    const float scaled = position / pitch_mm_, down = std::floor(scaled), t = scaled - down;
    return {static_cast<std::int32_t>(down), t * t * (3 - 2 * t)};
  }
  float value(std::int32_t i, std::int32_t j, std::int32_t k) const {
    const auto part = [](std::int32_t n) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(n) & 0xfffffu);
    };
    return uniform(seed_ ^ (part(i) | part(j) << 20 | part(k) << 40));
  }
  float edge(std::int32_t i, Cell y, Cell z) const {
    const float near = glm::mix(value(i, y.index, z.index), value(i, y.index + 1, z.index), y.part);
    const float far = glm::mix(value(i, y.index, z.index + 1), value(i, y.index + 1, z.index + 1), y.part);
    return glm::mix(near, far, z.part);
  }

  float pitch_mm_;
  std::uint64_t seed_;
};

/// The HU of a place in tissue whose mean is `hu`. `texture`, about -1 to 1, is the random number of that place.
float textured(float hu, float texture) {
  if (hu < -950) return hu;
  if (hu < -400) return hu + 26 * texture;                                             // lung
  if (hu < -40) return hu + 9 * texture;                                               // fat
  if (hu > 160) return hu + 55 * texture;                                              // bone
  const float marbling = hu > 46 && hu < 58 ? std::max(texture - 0.45f, 0.0f) : 0.0f;  // fat within muscle
  return hu + 7 * texture - 110 * marbling;
}

/// What all slices share.
struct Scene {
  Geometry geometry;
  std::uint64_t seed;
  Trunk trunk;
  std::vector<Organ> organs;
  Bending bending;
  Texture coarse, fine;
  float noise_hu;
  std::vector<float> x;  ///< body space, by column
  float edge;

  Scene(const Geometry& grid, std::uint64_t seed_, const PhantomLook& look)
      : geometry(grid),
        seed(seed_),
        organs(make_organs(trunk, seed_)),
        bending(grid.size, seed_ + 21),
        coarse(17, seed_ + 22),
        fine(3.4f, seed_ + 23),
        noise_hu(static_cast<float>(look.noise_hu)) {
    for (std::int64_t i = 0; i < grid.size.x; ++i) x.push_back(position(0, i));
    edge = 1.4f * static_cast<float>(std::max(kBodySpace.x / static_cast<double>(grid.size.x),
                                              kBodySpace.y / static_cast<double>(grid.size.y)));
  }
  /// The place of a voxel's centre along one axis in body space.
  float position(int axis, std::int64_t voxel) const {
    const double size = static_cast<double>(geometry.size[axis]);
    return static_cast<float>(((static_cast<double>(voxel) + 0.5) / size - 0.5) * kBodySpace[axis]);
  }
};

Bounds box_of(std::span<const Point> points) {
  Bounds box{points[0], points[0]};
  for (const Point& p : points) box = {glm::min(box.low, p), glm::max(box.high, p)};
  return box;
}

std::int16_t stored(float hu) { return static_cast<std::int16_t>(std::nearbyint(std::clamp(hu, -1024.0f, 3071.0f))); }

/// @param labels  those of the slice; empty: not wanted
void paint_slice(const Scene& scene, std::int64_t k, std::span<std::int16_t> slice, std::span<std::uint8_t> labels) {
  constexpr float kBendingMost = 14;
  const auto columns = static_cast<std::size_t>(scene.geometry.size.x);
  const float z = scene.position(2, k);
  std::vector<const Organ*> near;
  for (const Organ& organ : scene.organs) {
    const Bounds box = reach(organ, scene.edge);
    if (box.low.z < z + kBendingMost && box.high.z > z - kBendingMost) near.push_back(&organ);
  }
  std::vector<float> hu(columns), texture(columns), grain(columns);
  std::vector<Point> points(columns);
  std::vector<PhantomLabel> label(columns);
  GrainRows grain_rows(scene.geometry.size, k, scene.seed + 24);
  for (std::int64_t j = 0; j < scene.geometry.size.y; ++j) {
    const float y = scene.position(1, j);
    for (std::size_t i = 0; i < columns; ++i)
      points[i] = Point(scene.x[i], y, z) + scene.bending.at(static_cast<std::int64_t>(i), j, k);
    const PaintedRow row{scene.x, y, points, box_of(points), scene.edge, hu, label};
    paint_surroundings(row);
    paint_trunk(row, scene.trunk);
    for (const Organ* organ : near) paint_organ(row, *organ, scene.trunk);
    std::fill(texture.begin(), texture.end(), 0.0f);
    scene.coarse.add(scene.x, y, z, 0.8f, texture);
    scene.fine.add(scene.x, y, z, 0.9f, texture);
    grain_rows.next(grain);
    const std::size_t begin = static_cast<std::size_t>(j) * columns;
    for (std::size_t i = 0; i < columns; ++i)
      slice[begin + i] = stored(textured(hu[i], texture[i]) + scene.noise_hu * grain[i]);
    if (labels.empty()) continue;
    for (std::size_t i = 0; i < columns; ++i) labels[begin + i] = static_cast<std::uint8_t>(label[i]);
  }
}

/// @param labels  whether the labels are wanted
LabelledPhantom make(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed, const PhantomLook& look,
                     bool labels) {
  Geometry geometry{.size = size, .spacing = spacing};
  require_valid(geometry, "phantom");
  for (int axis = 0; axis < 3; ++axis) {
    require(size[axis] >= 2, "phantom: size " + to_string(size) + ", expected at least 2 voxels on every axis");
  }
  require(look.noise_hu >= 0 && look.noise_hu <= 1000,
          "phantom: noise of " + std::to_string(look.noise_hu) + " HU, expected 0 to 1000");
  geometry.origin = -0.5 * spacing * glm::dvec3(size - std::int64_t{1});
  const auto voxels = static_cast<std::size_t>(voxel_count(geometry));
  LabelledPhantom made{{geometry, std::vector<std::int16_t>(voxels)},
                       {geometry, std::vector<std::uint8_t>(labels ? voxels : 0)}};
  const Scene scene(geometry, seed, look);
  const auto area = static_cast<std::size_t>(size.x * size.y);
  oneapi::tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
    const std::size_t begin = static_cast<std::size_t>(k) * area;
    paint_slice(scene, k, std::span(made.ct.voxels).subspan(begin, area),
                labels ? std::span(made.labels.voxels).subspan(begin, area) : std::span<std::uint8_t>());
  });
  return made;
}

}  // namespace

std::span<const std::string_view> phantom_label_names() {
  static constexpr std::array<std::string_view, 14> kNames{"nothing", "body",    "lung",       "bone",  "heart",
                                                           "vessel",  "airway",  "oesophagus", "liver", "spleen",
                                                           "kidney",  "stomach", "bowel",      "cord"};
  return kNames;
}

Volume<std::int16_t> make_phantom(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed,
                                  const PhantomLook& look) {
  return make(size, spacing, seed, look, false).ct;
}

LabelledPhantom make_labelled_phantom(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed,
                                      const PhantomLook& look) {
  return make(size, spacing, seed, look, true);
}

}  // namespace tetwarp
