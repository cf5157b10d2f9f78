// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/zone.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

const BodyBox& box_of(const Patient& patient) {
  require(patient.box.has_value(),
          "no cell of the volume is of a body, so that nothing can be measured by its box; give mm, or another "
          "body_above_hu");
  return *patient.box;
}

template <class Inside>
std::vector<std::uint8_t> where_point(const Patient& patient, const Inside& inside) {
  const AffineMap point = point_from_index(patient.lattice);
  const glm::i64vec3& size = patient.lattice.size;
  std::vector<std::uint8_t> result;
  result.reserve(static_cast<std::size_t>(voxel_count(patient.lattice)));
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        result.push_back(static_cast<std::uint8_t>(inside(point(glm::dvec3(i, j, k)))));
      }
    }
  }
  return result;
}

/// Marks the vertices of a zone, with one overload for each kind of shape.
struct Selector {
  const Patient& patient;

  std::vector<std::uint8_t> operator()(const Sphere& sphere) const {
    const glm::dvec3 middle = point_of(sphere.at, patient);
    const double radius = mm_of(sphere.radius, patient);
    return where_point(patient, [&](const glm::dvec3& x) { return glm::distance(x, middle) <= radius; });
  }
  std::vector<std::uint8_t> operator()(const AlignedBox& box) const {
    const glm::dvec3 a = point_of(box.from, patient), b = point_of(box.to, patient);
    const glm::dvec3 low = glm::min(a, b), high = glm::max(a, b);
    return where_point(patient, [&](const glm::dvec3& x) { return glm::clamp(x, low, high) == x; });
  }
  std::vector<std::uint8_t> operator()(const HalfSpace& half) const {
    const glm::dvec3 at = point_of(half.at, patient);
    return where_point(patient, [&](const glm::dvec3& x) { return glm::dot(x - at, half.normal) >= 0; });
  }
  std::vector<std::uint8_t> operator()(const HuRange& range) const {
    std::vector<std::uint8_t> result;
    for (const float hu : patient.vertex_hu) result.push_back(range.contains(static_cast<double>(hu)));
    return result;
  }
  std::vector<std::uint8_t> operator()(const Labels& labels) const {
    require(!patient.vertex_label.empty(), "a region is given by labels, but there is no label volume; give --labels");
    std::vector<std::uint8_t> result;
    for (const std::int64_t label : patient.vertex_label)
      result.push_back(std::find(labels.values.begin(), labels.values.end(), label) != labels.values.end());
    return result;
  }
  std::vector<std::uint8_t> operator()(const Border&) const {
    const glm::i64vec3& size = patient.lattice.size;
    std::vector<std::uint8_t> result;
    for (std::int64_t n = 0; n < voxel_count(patient.lattice); ++n) {
      const glm::i64vec3 at(n % size.x, n / size.x % size.y, n / (size.x * size.y));
      result.push_back(glm::any(glm::equal(at, glm::i64vec3(0))) || glm::any(glm::equal(at, size - std::int64_t{1})));
    }
    return result;
  }
  std::vector<std::uint8_t> operator()(const Body&) const {
    const glm::i64vec3 &size = patient.lattice.size, cells = size - std::int64_t{1};
    std::vector<std::uint8_t> result(static_cast<std::size_t>(voxel_count(patient.lattice)));
    for (std::size_t n = 0; n < patient.body.size(); ++n) {
      if (!patient.body[n]) continue;
      const auto cell = static_cast<std::int64_t>(n);
      const glm::i64vec3 at(cell % cells.x, cell / cells.x % cells.y, cell / (cells.x * cells.y));
      for (int corner = 0; corner < 8; ++corner) {
        const glm::i64vec3 vertex = at + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
        result[static_cast<std::size_t>(vertex.x + size.x * (vertex.y + size.y * vertex.z))] = 1;
      }
    }
    return result;
  }
  std::vector<std::uint8_t> operator()(const AllOf& all) const {
    std::vector<std::uint8_t> result(patient.vertex_hu.size(), 1);
    for (const Zone& part : all.parts) {
      const std::vector<std::uint8_t> one = select(part, patient);
      for (std::size_t n = 0; n < result.size(); ++n) result[n] &= one[n];
    }
    return result;
  }
  std::vector<std::uint8_t> operator()(const AnyOf& any) const {
    std::vector<std::uint8_t> result(patient.vertex_hu.size(), 0);
    for (const Zone& part : any.parts) {
      const std::vector<std::uint8_t> one = select(part, patient);
      for (std::size_t n = 0; n < result.size(); ++n) result[n] |= one[n];
    }
    return result;
  }
  std::vector<std::uint8_t> operator()(const Not& negation) const {
    std::vector<std::uint8_t> result = select(negation.part.at(0), patient);
    for (std::uint8_t& inside : result) inside = !inside;
    return result;
  }
};

}  // namespace

glm::dvec3 point_of(const ScenarioPoint& place, const Patient& patient) {
  if (place.unit == Unit::mm) return place.at;
  const BodyBox& box = box_of(patient);
  return box.low + place.at * (box.high - box.low);
}

double mm_of(const Length& length, const Patient& patient) {
  if (length.unit == Unit::mm) return length.value;
  const BodyBox& box = box_of(patient);
  const glm::dvec3 sides = box.high - box.low;
  return length.value * std::max({sides.x, sides.y, sides.z});
}

glm::dvec3 mm_of(const Shift& shift, const Patient& patient) {
  if (shift.unit == Unit::mm) return shift.by;
  const BodyBox& box = box_of(patient);
  return shift.by * (box.high - box.low);
}

std::vector<std::uint8_t> select(const Zone& zone, const Patient& patient) {
  return std::visit(Selector{patient}, zone.shape);
}

std::vector<std::size_t> grasp(const glm::dvec3& point, double radius_mm, const Patient& patient) {
  const AffineMap vertex_point = point_from_index(patient.lattice);
  const glm::i64vec3& size = patient.lattice.size;
  std::vector<std::size_t> within;
  std::size_t nearest = 0;
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (std::int64_t n = 0; n < voxel_count(patient.lattice); ++n) {
    const glm::dvec3 index(n % size.x, n / size.x % size.y, n / (size.x * size.y));
    const double distance = glm::distance(vertex_point(index), point);
    if (distance <= radius_mm) within.push_back(static_cast<std::size_t>(n));
    if (distance < nearest_mm) {
      nearest_mm = distance;
      nearest = static_cast<std::size_t>(n);
    }
  }
  if (!within.empty()) return within;
  require(nearest_mm <= glm::length(patient.lattice.spacing),
          "a handle is " + std::to_string(nearest_mm) + " mm from the nearest vertex, its radius is " +
              std::to_string(radius_mm) + " mm; place it in the volume");
  return {nearest};
}

}  // namespace tetwarp::simulate
