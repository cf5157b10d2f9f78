// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/cpu/distance_map.h"
#include "deform/errors.h"
#include "deform/simulate/divided_lattice.h"
#include "deform/truth/levels.h"
#include "deform/truth/motions.h"
#include "deform/truth/shapes.h"
#include "deform/truth/slip_tube.h"

namespace tetwarp::truth {

namespace {

/// Twice the area of a triangle, above 0 where a, b, c turn left.
double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The corners of the convex hull, turning left (Andrew's monotone chain).
std::vector<glm::dvec2> convex_hull(std::vector<glm::dvec2> points) {
  const auto before = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<glm::dvec2> hull;
  const auto add = [&](const glm::dvec2& point, std::size_t keep) {
    while (hull.size() >= keep + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0) hull.pop_back();
    hull.push_back(point);
  };
  for (const glm::dvec2& point : points) add(point, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t n = points.size() - 1; n-- > 0;) add(points[n], lower);
  hull.pop_back();
  return hull;
}

/// How deep each column of a lattice lies inside the tube, mm, i fastest.
std::vector<double> column_depths(const SlipTube& tube, const Geometry& lattice) {
  std::vector<double> depths;
  for (std::int64_t j = 0; j < lattice.size.y; ++j)
    for (std::int64_t i = 0; i < lattice.size.x; ++i) depths.push_back(tube.depth_mm(glm::dvec2(i, j)));
  return depths;
}

/// On which side of the tube each node of a divided lattice lies: 1 inside, 0 outside. Copies lie where their piece
/// does.
/// @param depths  of the columns
std::vector<std::uint8_t> sides_of_nodes(const simulate::DividedLattice& divided, const std::vector<double>& depths,
                                         const Geometry& lattice) {
  const auto vertices = static_cast<std::size_t>(voxel_count(lattice));
  std::vector<std::uint8_t> inside(vertices + divided.copies_of.size());
  for (std::size_t n = 0; n < vertices; ++n) inside[n] = depths[n % depths.size()] > 0;
  // Which sign of a piece means inside: that of a piece most of whose own vertices lie there.
  std::int64_t agree = 0;
  for (std::size_t piece = 0; piece < divided.pieces.size(); ++piece) {
    for (const std::uint32_t node : divided.pieces[piece].node)
      if (node < vertices) agree += divided.sides[piece][0] * (inside[node] ? 1 : -1);
  }
  const int sign = agree > 0 ? 1 : -1;
  for (std::size_t piece = 0; piece < divided.pieces.size(); ++piece) {
    const int side = divided.sides[piece][0] * sign;
    if (side == 0) continue;
    for (const std::uint32_t node : divided.pieces[piece].node) inside[node] = side > 0;
  }
  return inside;
}

/// How far the bands reach, mm.
std::vector<double> band_ends_mm(const Geometry& lattice) {
  const double diagonal = std::sqrt(lattice.spacing.x * lattice.spacing.x + lattice.spacing.y * lattice.spacing.y);
  return {diagonal, diagonal + 10, diagonal + 20};
}

/// Bands of one slice of a volume. The third axes of the volume and the lattice are the same, so all slices are alike.
std::vector<std::uint8_t> bands_of_slice(const SlipTube& tube, const Geometry& lattice, const Geometry& volume) {
  const std::vector<double> ends = band_ends_mm(lattice);
  const AffineMap index = index_from_point(lattice) * point_from_index(volume);
  std::vector<std::uint8_t> bands;
  for (std::int64_t j = 0; j < volume.size.y; ++j) {
    for (std::int64_t i = 0; i < volume.size.x; ++i) {
      const double distance = std::abs(tube.depth_mm(glm::dvec2(index(glm::dvec3(i, j, 0)))));
      const auto band = std::lower_bound(ends.begin(), ends.end(), distance) - ends.begin();
      bands.push_back(band == std::ssize(ends) ? std::uint8_t{0} : static_cast<std::uint8_t>(band + 1));
    }
  }
  return bands;
}

/// Refuses a slip that opens or overlaps: near it more than a thousandth of all voxels of the volume have no owner or
/// several. Slices from which tissue goes out of the volume do not count.
void check_slip(const Subject& subject, const SlipTube& tube, const VertexField& field, double amplitude,
                const Limits& limits, const Control& control) {
  constexpr double kMost = 1e-3;
  const Geometry& grid = subject.volume();
  const std::vector<std::uint8_t> bands = bands_of_slice(tube, subject.lattice(), grid);
  const auto margin = static_cast<std::int64_t>(std::ceil(amplitude / grid.spacing.z)) + 1;
  const std::int64_t area = grid.size.x * grid.size.y;
  const auto resampler = make_cpu_resampler(grid, limits);
  resampler->set_field(view(field, Outside::rest), {.jacobian_range = false}, {.stop = control.stop});
  std::vector<std::uint16_t> owners(static_cast<std::size_t>(area));
  std::int64_t bad = 0;
  for (std::int64_t k = margin; k < grid.size.z - margin; ++k) {
    const Region slice{{0, 0, k}, {grid.size.x, grid.size.y, k + 1}};
    const VolumeView map{&grid, slice, VoxelType::u16, 1, std::as_writable_bytes(std::span(owners)).data()};
    resampler->resample(slice, {}, {.owners = map}, {.stop = control.stop});
    for (std::int64_t n = 0; n < area; ++n)
      bad += bands[static_cast<std::size_t>(n)] == 1 && owners[static_cast<std::size_t>(n)] != 1;
  }
  const double share = static_cast<double>(bad) / static_cast<double>(voxel_count(grid));
  require(share <= kMost, "the slip opens or overlaps at " + std::to_string(bad) + " voxels, " +
                              std::to_string(100 * share) + " % of all; at most 0.1 % may");
}

}  // namespace

SlipTube::SlipTube(const Subject& subject) : lattice_(subject.lattice()) {
  const std::vector<std::uint8_t> lung = subject.vertices("lung");
  std::vector<glm::dvec2> columns;
  std::size_t vertex = 0;
  for (std::int64_t k = 0; k < lattice_.size.z; ++k) {
    for (std::int64_t j = 0; j < lattice_.size.y; ++j) {
      for (std::int64_t i = 0; i < lattice_.size.x; ++i, ++vertex)
        if (lung[vertex]) columns.emplace_back(i, j);
    }
  }
  corners_ = convex_hull(std::move(columns));
  require(corners_.size() >= 3, "the lungs are too small for a tube around them");
  require(std::abs(lattice_.direction[2].z) > 0.9,
          "slip runs along the third axis of the grid, which has to lead from feet to head; this one is " +
              orientation_code(lattice_));
  // Each side goes outwards by half a cell, so that the tube holds the lungs: a corner goes along the middle of the
  // normals of its two sides. A little more than half keeps sides along an axis away from vertices.
  constexpr double kOutwards = 0.53;
  const std::size_t count = corners_.size();
  const auto normal = [&](const glm::dvec2& a, const glm::dvec2& b) {
    const glm::dvec2 along = b - a;
    return glm::dvec2(along.y, -along.x) / std::sqrt(glm::dot(along, along));
  };
  std::vector<glm::dvec2> moved;
  for (std::size_t n = 0; n < count; ++n) {
    const glm::dvec2 &before = corners_[(n + count - 1) % count], &here = corners_[n],
                     &after = corners_[(n + 1) % count];
    const glm::dvec2 sum = normal(before, here) + normal(here, after);
    moved.push_back(here + 2 * kOutwards / glm::dot(sum, sum) * sum);
  }
  corners_ = std::move(moved);
}

double SlipTube::depth_mm(const glm::dvec2& at) const {
  double nearest = 1e300;
  bool is_inside = true;
  const glm::dvec2 step(lattice_.spacing);
  for (std::size_t n = 0; n < corners_.size(); ++n) {
    const glm::dvec2 a = corners_[n] * step, b = corners_[(n + 1) % corners_.size()] * step, p = at * step;
    const glm::dvec2 along = b - a;
    const double part = std::clamp(glm::dot(p - a, along) / glm::dot(along, along), 0.0, 1.0);
    const glm::dvec2 off = p - (a + part * along);
    const double distance = std::sqrt(glm::dot(off, off));
    if (turn(a, b, p) < 0) is_inside = false;
    nearest = std::min(nearest, distance);
  }
  return is_inside ? nearest : -nearest;
}

simulate::Cut SlipTube::cut() const {
  const AffineMap point = point_from_index(lattice_);
  simulate::SweptCut tube{.path = {}, .sweep = point.linear * glm::dvec3(0, 0, lattice_.size.z), .is_closed = true};
  for (const glm::dvec2& corner : corners_) tube.path.push_back(point(glm::dvec3(corner, -0.5)));
  return {"chest wall", tube};
}

Bands slip_bands(const Subject& subject, const Geometry& volume) {
  const std::vector<std::uint8_t> slice = bands_of_slice(SlipTube(subject), subject.lattice(), volume);
  Bands bands{band_ends_mm(subject.lattice()), {volume, {}}};
  std::vector<std::uint8_t>& voxels = bands.voxels.voxels;
  voxels.reserve(static_cast<std::size_t>(voxel_count(volume)));
  for (std::int64_t k = 0; k < volume.size.z; ++k) voxels.insert(voxels.end(), slice.begin(), slice.end());
  return bands;
}

VertexField slip_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control) {
  const Geometry& lattice = subject.lattice();
  const SlipTube tube(subject);
  const BreathingLevels levels(subject);
  const double amplitude = values.find("amplitude")->second;
  // Bones deep inside, such as the spine between the lungs, stay; those beside the wall are outside, or slid along.
  constexpr double kDeepMm = 15;
  const std::vector<double> depths = column_depths(tube, lattice);
  std::vector<std::uint8_t> held = levels.held();
  for (std::size_t n = 0; n < held.size(); ++n) held[n] = held[n] && depths[n % depths.size()] > kDeepMm;
  const std::vector<double> from_held = distance_mm(lattice, held, limits);
  const double fade = std::max(3 * amplitude, 1.0);
  const glm::dvec3 down = lattice.direction[2] * (lattice.direction[2].z > 0 ? -1.0 : 1.0);
  const VertexField inner = on_vertices(lattice, limits, control, [&](std::size_t vertex, const glm::dvec3& point) {
    return amplitude * levels.hill_at(point.z) * smooth_step(from_held[vertex] / fade) * down;
  });
  const simulate::Cut cut = tube.cut();
  const simulate::DividedLattice divided = simulate::divide(lattice, {&cut, 1});
  const std::vector<std::uint8_t> inside = sides_of_nodes(divided, depths, lattice);
  std::vector<glm::vec3> displacement(inside.size(), glm::vec3(0));
  for (std::size_t n = 0; n < inside.size(); ++n) {
    const std::size_t vertex = n < inner.displacement.size() ? n : divided.copies_of[n - inner.displacement.size()];
    if (inside[n]) displacement[n] = inner.displacement[vertex];
  }
  VertexField field = simulate::field_of(lattice, divided, displacement);
  check_slip(subject, tube, field, amplitude, limits, control);
  return field;
}

}  // namespace tetwarp::truth
