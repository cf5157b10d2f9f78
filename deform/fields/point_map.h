// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <concepts>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "deform/resampler.h"

namespace tetwarp {

/// A map that knows a faster way for many points than one after the other: neighbours in a row often share most of the
/// work. `of_row` gives the same bits, and throws what the first point throws that is refused.
template <class Map>
concept HasRows = requires(const Map& map, std::span<const glm::dvec3> points, glm::dvec3* displacement) {
  map.of_row(points, displacement);
};

/// Displacement (LPS mm, deformed minus undeformed) of a point (LPS mm) of the undeformed volume. It may be called from
/// several threads at a time. Copies share the function that they were made of.
class PointMap {
 public:
  /// No map: it must not be called.
  PointMap() = default;
  /// @param map  `map(point)` returns the displacement of a point
  template <class Map>
  requires(!std::same_as<Map, PointMap> && std::is_invocable_r_v<glm::dvec3, const Map&, const glm::dvec3&>)
      PointMap(Map map)
      : map_(std::make_shared<const Of<Map>>(std::move(map))) {}

  /// The displacement of a point.
  glm::dvec3 operator()(const glm::dvec3& point) const { return map_->at(point); }
  /// The displacements of some points, with the same bits.
  /// @param points        LPS mm
  /// @param displacement  LPS mm, one for each point
  void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const {
    map_->of_row(points, displacement);
  }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual glm::dvec3 at(const glm::dvec3& point) const = 0;
    virtual void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const = 0;
  };
  template <class Map>
  struct Of final : Any {
    explicit Of(Map given) : map(std::move(given)) {}
    glm::dvec3 at(const glm::dvec3& point) const override { return map(point); }
    void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const override {
      if constexpr (HasRows<Map>) {
        map.of_row(points, displacement);
      } else {
        for (std::size_t n = 0; n < points.size(); ++n) displacement[n] = map(points[n]);
      }
    }
    Map map;
  };

  std::shared_ptr<const Any> map_;
};

/// The values of a map at the vertices of a lattice, computed in parallel.
/// @throws Cancelled; an InputError of the map, of several that for the first vertex, whatever the threads do
VertexField sample_on(const Geometry& lattice, const PointMap& map, Limits limits = {}, const Control& control = {});

/// The map of a field between its vertices: affine in the same five tetrahedra of each cell that the resampler uses.
/// The field must outlive the map. A call of the map throws InputError for a point outside the lattice.
PointMap piecewise_affine(const VertexField& field);

/// Appends a second deformation to a field: each vertex is moved on by the displacement that `next` has at the place to
/// which `field` moved it. The lattice stays.
/// @throws Cancelled; an InputError of `next`, of several that for the first vertex, and the field is of no use then
void compose(VertexField& field, const PointMap& next, Limits limits = {}, const Control& control = {});

/// The map of a pull field between its samples, trilinear. The field must outlive the map. For a point outside the
/// grid, or near a sample without a source, a call gives NaN.
PointMap between_samples(const PullField& field);

/// Appends a second map to a pull field: what an output point takes from where `field` leads, it takes from where
/// `next` leads from there. The grid stays. Samples without a source stay so, and those become so for which `next`
/// gives NaN.
/// @throws Cancelled; an InputError of `next`, of several that for the first sample, and the field is of no use then
void compose(PullField& field, const PointMap& next, Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
