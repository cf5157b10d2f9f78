// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/field_quality.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "deform/core/five_tetrahedra.h"
#include "deform/cpu/rows/gradient_row.h"
#include "deform/cpu/tiles.h"
#include "deform/fields/lattice_mesh.h"

namespace tetwarp {

namespace {

using glm::dmat3;
using glm::dvec3;

/// Characteristic polynomial of a symmetric 3 x 3 matrix without negative eigenvalues.
struct Characteristic {
  double trace, minors, determinant;

  explicit Characteristic(const dmat3& m)
      : trace(m[0][0] + m[1][1] + m[2][2]),
        minors(m[0][0] * m[1][1] - m[0][1] * m[1][0] + m[0][0] * m[2][2] - m[0][2] * m[2][0] + m[1][1] * m[2][2] -
               m[1][2] * m[2][1]),
        determinant(glm::determinant(m)) {}

  double value(double x) const { return ((x - trace) * x + minors) * x - determinant; }
  double slope(double x) const { return (3 * x - 2 * trace) * x + minors; }
  /// Whether no eigenvalue exceeds x (Budan's theorem).
  bool is_below(double x) const { return value(x) >= 0 && slope(x) >= 0 && 3 * x >= trace; }
  /// The largest eigenvalue, by Newton's method from the trace, which is at least as large. It uses only operations
  /// that IEEE 754 fixes, so it has the same bits everywhere.
  double largest_root() const {
    double x = trace;
    for (int step = 0; step < 60; ++step) {
      const double over = value(x), by = slope(x);
      if (!(over > 0) || !(by > 0) || !(x - over / by < x)) break;
      x -= over / by;
    }
    return x;
  }
};

/// Adds up the gradients of one part of a field, in order.
///
/// A gradient is passed over where it cannot stretch more than those before it, to within rounding. So the last bits of
/// the largest stretch depend on the order. Parts are therefore fixed, whichever thread takes them.
class StretchTally {
 public:
  /// Counts a part of the volume. @param determinant  of its gradient
  void count(double determinant, std::uint64_t part) { parts_[bin_of(determinant)] += part; }
  /// Counts the tetrahedra of a run of cells of a lattice.
  void count(const cpu::RunGradients& run, std::size_t cells) {
    const std::size_t lowest = bin_of(run.least), highest = bin_of(run.most);
    std::uint64_t in_higher = 6 * cells;
    for (std::size_t bin = lowest; bin < highest; ++bin) {
      const double edge = FieldQuality::kEdges[bin];
      std::uint64_t above = 0;
      for (std::size_t t = 0; t < run.determinant.size(); ++t) {
        std::uint64_t of_tetrahedron = 0;
        for (std::size_t n = 0; n < cells; ++n) of_tetrahedron += run.determinant[t][n] >= edge;
        above += part_of(t) * of_tetrahedron;
      }
      parts_[bin] += in_higher - above;
      in_higher = above;
    }
    parts_[highest] += in_higher;
  }
  /// Adds the stretch of one gradient. @param f  of the deformed place with respect to the undeformed place
  void stretch(const dmat3& f) {
    if (bound(f) <= limit()) return;
    const Characteristic of(glm::transpose(f) * f);
    if (!of.is_below(limit())) largest_ = std::max(largest_, of.largest_root());
  }
  /// Adds the stretch of what does not move.
  void rest() { largest_ = std::max(largest_, 1.0); }
  /// Squares of stretches up to this are no larger than the largest so far, or by rounding alone.
  double limit() const { return largest_ * (1 + 1e-9); }
  /// The part of a cell, in sixths, that a tetrahedron of it has.
  static constexpr std::uint64_t part_of(std::size_t tetrahedron) { return tetrahedron == 0 ? 2 : 1; }
  void add_to(FieldQuality& quality) const {
    for (std::size_t bin = 0; bin < parts_.size(); ++bin) quality.parts[bin] += parts_[bin];
    quality.largest_stretch = std::max(quality.largest_stretch, std::sqrt(largest_));
  }

 private:
  static std::size_t bin_of(double determinant) {
    const auto& edges = FieldQuality::kEdges;
    return static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), determinant) - edges.begin());
  }
  /// A bound on the eigenvalues of transpose(f) f (Gershgorin). For most gradients this is enough.
  static double bound(const dmat3& f) {
    const double xx = glm::dot(f[0], f[0]), yy = glm::dot(f[1], f[1]), zz = glm::dot(f[2], f[2]);
    const double xy = std::abs(glm::dot(f[0], f[1])), xz = std::abs(glm::dot(f[0], f[2])),
                 yz = std::abs(glm::dot(f[1], f[2]));
    return std::max({xx + xy + xz, yy + xy + yz, zz + xz + yz});
  }

  decltype(FieldQuality::parts) parts_{};
  double largest_ = 0;
};

/// Adds the stretches of the five tetrahedra of a cell. @param u  displacements of its corners
void stretch_cell(const dvec3 (&u)[8], bool odd, const cpu::LatticeSteps& steps, StretchTally& tally) {
  for (int t = 1; t < kTetrahedraPerCell; ++t) {
    const TetrahedronCorners of = tetrahedron_corners(t, odd);
    const auto along = [&](int neighbour, int axis) {
      return ((of.d >> axis) & 1) != 0 ? u[of.d] - u[neighbour] : u[neighbour] - u[of.d];
    };
    tally.stretch((steps.step + dmat3(along(of.a, 0), along(of.b, 1), along(of.c, 2))) * steps.inverse);
  }
  const TetrahedronCorners of = tetrahedron_corners(0, odd);
  const double half = of.d == 0 ? 0.5 : -0.5;
  const dvec3 a = half * (u[of.a] - u[of.d]), b = half * (u[of.b] - u[of.d]), c = half * (u[of.c] - u[of.d]);
  tally.stretch((steps.step + dmat3(b + c - a, a + c - b, a + b - c)) * steps.inverse);
}

/// Measures the rows of cells between two planes of vertices.
class CellRows {
 public:
  CellRows(const VertexField& field, const cpu::LatticeSteps& steps, StretchTally& tally)
      : field_(field),
        steps_(steps),
        tally_(tally),
        rows_(4, cpu::SplitRow(static_cast<std::size_t>(field.lattice.size.x))) {}

  void measure(std::int64_t z) {
    const glm::i64vec3& size = field_.lattice.size;
    for (std::int64_t y = 0; y < size.y - 1; ++y) {
      // The upper rows of vertices are the lower ones of the next row of cells.
      std::swap(rows_[0], rows_[1]);
      std::swap(rows_[2], rows_[3]);
      for (std::size_t n = y == 0 ? 0 : 1; n < 4; n += y == 0 ? 1 : 2) rows_[n].set(row(n, y, z));
      constexpr std::int64_t kCells = 2 * cpu::kGradientRun;
      for (std::int64_t x = 0; x < size.x - 1; x += kCells) measure({x, y, z}, std::min(kCells, size.x - 1 - x));
    }
  }

 private:
  using Kind = cpu::RunGradients::Kind;

  const glm::vec3* row(std::size_t n, std::int64_t y, std::int64_t z) const {
    const glm::i64vec3& size = field_.lattice.size;
    const auto up = static_cast<std::int64_t>(n);
    return field_.displacement.data() + ((z + (up >> 1)) * size.y + y + (up & 1)) * size.x;
  }
  static bool is_odd(const glm::i64vec3& cell) { return ((cell.x + cell.y + cell.z) & 1) != 0; }

  /// Measures some cells of a row. @param from  the first of them; its number along i is even
  void measure(const glm::i64vec3& from, std::int64_t cells) {
    for (std::size_t rest = 0; rest < 2; ++rest) {
      const auto count = static_cast<std::size_t>(cells + 1 - static_cast<std::int64_t>(rest)) / 2;
      if (count == 0) continue;
      const cpu::GradientRun run{.rows = {&rows_[0], &rows_[1], &rows_[2], &rows_[3]},
                                 .first = static_cast<std::size_t>(from.x / 2),
                                 .rest = rest,
                                 .count = count,
                                 .odd = is_odd(from + glm::i64vec3(rest, 0, 0))};
      cpu::measure_gradients(steps_, run, tally_.limit(), found_[rest]);
      tally_.count(found_[rest], count);
    }
    for (std::int64_t n = 0; n < cells; ++n) {
      const Kind kind = found_[n & 1].kind[static_cast<std::size_t>(n / 2)];
      if (kind == Kind::at_rest) tally_.rest();
      if (kind == Kind::beyond) stretch(from + glm::i64vec3(n, 0, 0));
    }
  }
  void stretch(const glm::i64vec3& cell) {
    dvec3 u[8];
    for (std::size_t corner = 0; corner < 8; ++corner)
      u[corner] = dvec3(row(corner >> 1, cell.y, cell.z)[cell.x + static_cast<std::int64_t>(corner & 1)]);
    stretch_cell(u, is_odd(cell), steps_, tally_);
  }

  const VertexField& field_;
  const cpu::LatticeSteps& steps_;
  StretchTally& tally_;
  std::vector<cpu::SplitRow> rows_;  ///< at (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)
  cpu::RunGradients found_[2];       ///< of the cells of even and of odd number along i
};

dmat3 edges_of(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) { return {a - d, b - d, c - d}; }

FieldQuality sum_of(const tbb::enumerable_thread_specific<FieldQuality>& found) {
  FieldQuality sum;
  for (const FieldQuality& part : found) {
    for (std::size_t bin = 0; bin < sum.parts.size(); ++bin) sum.parts[bin] += part.parts[bin];
    sum.largest_stretch = std::max(sum.largest_stretch, part.largest_stretch);
  }
  return sum;
}

FieldQuality quality_of(const TetrahedralMesh& mesh, const Limits& limits, const Control& control) {
  constexpr std::size_t kAtOnce = 4096;
  constexpr double kParts = std::uint64_t{1} << 40;
  const auto rest_edges = [&](const glm::u32vec4& t) {
    return edges_of(mesh.rest[t.x], mesh.rest[t.y], mesh.rest[t.z], mesh.rest[t.w]);
  };
  double volume = 0;
  for (const glm::u32vec4& t : mesh.tetrahedra) volume += std::abs(glm::determinant(rest_edges(t)));
  tbb::enumerable_thread_specific<FieldQuality> found;
  cpu::Arena arena(limits);
  const std::size_t count = mesh.tetrahedra.size();
  cpu::WorkProgress progress(control, static_cast<std::int64_t>(count));
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, (count + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
      StretchTally tally;
      const std::size_t begin = part * kAtOnce, end = std::min(begin + kAtOnce, count);
      for (std::size_t n = begin; n < end; ++n) {
        const glm::u32vec4& t = mesh.tetrahedra[n];
        const dmat3 rest = rest_edges(t);
        const double determinant = glm::determinant(rest);
        if (determinant == 0) continue;
        const auto by = [&](std::uint32_t vertex) { return dvec3(mesh.displacement[vertex]); };
        const dmat3 f = (rest + edges_of(by(t.x), by(t.y), by(t.z), by(t.w))) * glm::inverse(rest);
        tally.count(glm::determinant(f),
                    static_cast<std::uint64_t>(std::rint(std::abs(determinant) / volume * kParts)));
        tally.stretch(f);
      }
      tally.add_to(found.local());
      progress.done(static_cast<std::int64_t>(end - begin));
    });
  });
  return sum_of(found);
}

/// The tetrahedron with the least Jacobian determinant of those that were looked at, the first of several.
struct Worst {
  double jacobian = std::numeric_limits<double>::infinity();
  std::optional<dvec3> place;  ///< its deformed middle, LPS mm

  /// @param before  undeformed corners, LPS mm  @param by  displacements
  void add(const glm::dmat4x3& before, const glm::dmat4x3& by) {
    const auto volume = [](const glm::dmat4x3& p) { return glm::determinant(edges_of(p[0], p[1], p[2], p[3])); };
    const glm::dmat4x3 after = before + by;
    const double of_this = volume(after) / volume(before);
    if (!(of_this < jacobian)) return;
    jacobian = of_this;
    place = 0.25 * (after[0] + after[1] + after[2] + after[3]);
  }
};

/// Looks at the five tetrahedra of a cell of a lattice.
void add_cell(const VertexField& field, const AffineMap& point, const glm::i64vec3& cell, Worst& worst) {
  const glm::i64vec3& size = field.lattice.size;
  const bool odd = ((cell.x + cell.y + cell.z) & 1) != 0;
  for (int t = 0; t < kTetrahedraPerCell; ++t) {
    const TetrahedronCorners corners = tetrahedron_corners(t, odd);
    const int corner[] = {corners.a, corners.b, corners.c, corners.d};
    glm::dmat4x3 before, by;
    for (int n = 0; n < 4; ++n) {
      const glm::i64vec3 vertex = cell + glm::i64vec3(corner[n] & 1, corner[n] >> 1 & 1, corner[n] >> 2);
      before[n] = point(glm::dvec3(vertex));
      by[n] = field.displacement[static_cast<std::size_t>((vertex.z * size.y + vertex.y) * size.x + vertex.x)];
    }
    worst.add(before, by);
  }
}

std::string format(const char* form, double value) {
  char text[96];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

}  // namespace

std::array<double, FieldQuality::kEdges.size() + 1> FieldQuality::shares() const {
  std::uint64_t all = 0;
  for (const std::uint64_t count : parts) all += count;
  std::array<double, kEdges.size() + 1> shares{};
  for (std::size_t bin = 0; bin < shares.size() && all != 0; ++bin)
    shares[bin] = static_cast<double>(parts[bin]) / static_cast<double>(all);
  return shares;
}

FieldQuality measure_quality(const VertexField& field, const Limits& limits, const Control& control) {
  if (!field.replaced.empty()) return quality_of(mesh_of(field), limits, control);
  if (!field.mesh.is_empty()) return quality_of(field.mesh, limits, control);
  const glm::i64vec3 size = field.lattice.size;
  require(std::min({size.x, size.y, size.z}) >= 2, "a field of " + to_string(size) + " vertices has no cell");
  const cpu::LatticeSteps steps(point_from_index(field.lattice).linear);
  tbb::enumerable_thread_specific<FieldQuality> found;
  cpu::Arena arena(limits);
  cpu::WorkProgress progress(control, size.z - 1);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z - 1, [&](std::int64_t z) {
      StretchTally tally;
      CellRows(field, steps, tally).measure(z);
      tally.add_to(found.local());
      progress.done(1);
    });
  });
  return sum_of(found);
}

std::optional<glm::dvec3> worst_place(const VertexField& field, const Limits& limits, const Control& control) {
  Worst worst;
  if (!field.mesh.is_empty()) {
    const TetrahedralMesh mesh = field.replaced.empty() ? field.mesh : mesh_of(field);
    for (const glm::u32vec4& corners : mesh.tetrahedra) {
      if (control.stop.stop_requested()) throw Cancelled();
      glm::dmat4x3 before, by;
      for (int n = 0; n < 4; ++n) {
        before[n] = mesh.rest[corners[n]];
        by[n] = mesh.displacement[corners[n]];
      }
      worst.add(before, by);
    }
    return worst.place;
  }
  const glm::i64vec3 size = field.lattice.size;
  const AffineMap point = point_from_index(field.lattice);
  std::vector<Worst> of_layer(static_cast<std::size_t>(std::max<std::int64_t>(size.z - 1, 0)));
  cpu::Arena arena(limits);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z - 1, [&](std::int64_t k) {
      if (control.stop.stop_requested()) return;
      for (std::int64_t j = 0; j + 1 < size.y; ++j)
        for (std::int64_t i = 0; i + 1 < size.x; ++i)
          add_cell(field, point, {i, j, k}, of_layer[static_cast<std::size_t>(k)]);
    });
  });
  if (control.stop.stop_requested()) throw Cancelled();
  for (const Worst& layer : of_layer)
    if (layer.jacobian < worst.jacobian) worst = layer;
  return worst.place;
}

std::string verdict(const Report& report, const FieldQuality& quality, const RoundTrip& trip) {
  const double voxels = static_cast<double>(report.covered + report.uncovered);
  std::string text = format("%.2f %% of the voxels are covered",
                            voxels > 0 ? 100.0 * static_cast<double>(report.covered) / voxels : 0) +
                     format("; the largest stretch is %.2f times", quality.largest_stretch);
  if (trip.inverse_after_forward.points > 0) {
    text += format("; a vertex sent there and back by the inverse ends at most %.2g mm from its place",
                   trip.inverse_after_forward.largest);
  }
  const double folded = 100 * quality.shares().front();
  if (report.inverted + report.degenerate > 0) {
    return "Do not trust it where it folds: " + std::to_string(report.inverted) + " tetrahedra are inverted and " +
           std::to_string(report.degenerate) + " flat, " + format("%.3g %% of the volume; ", folded) + text + ".";
  }
  const double beside = trip.forward_after_inverse.largest, rounding = (1 + quality.largest_stretch) * trip.step_mm;
  if (beside > rounding) {
    return "Do not trust it: the inverse leads up to " +
           format("%.2g mm beside a voxel, where rounding explains ", beside) + format("%.2g; ", rounding) + text + ".";
  }
  return "No tetrahedron folds; " + text + ".";
}

}  // namespace tetwarp
