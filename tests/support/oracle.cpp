// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/oracle.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace tetwarp::test {

namespace {

__extension__ typedef __int128 Int;

constexpr std::int64_t kOne = 1 << 16;          // a voxel, in units of 2^-16 voxel
constexpr std::int64_t kNudge[3] = {15, 7, 4};  // the nudge, in units of 2^-16 voxel

int sign(Int x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }

/// The multiple of 2^-12 voxel nearest to an index, in units of 2^-16 voxel.
glm::i64vec3 snapped(const glm::dvec3& index) {
  glm::i64vec3 result;
  for (int axis = 0; axis < 3; ++axis)
    result[axis] = 16 * static_cast<std::int64_t>(std::nearbyint(index[axis] * 4096));
  return result;
}

/// A 4 x 4 matrix whose rows are corners in homogeneous coordinates (x, y, z, 1): the transposed matrix of Eq. 6.
struct Matrix {
  Int entry[4][4];

  explicit Matrix(const glm::i64vec3 (&corner)[4]) {
    for (int row = 0; row < 4; ++row) {
      for (int axis = 0; axis < 3; ++axis) entry[row][axis] = corner[row][axis];
      entry[row][3] = 1;
    }
  }

  Int cofactor(int row, int column) const {
    int r[3], c[3];
    for (int i = 0, n = 0, m = 0; i < 4; ++i) {
      if (i != row) r[n++] = i;
      if (i != column) c[m++] = i;
    }
    const auto at = [&](int i, int j) { return entry[r[i]][c[j]]; };
    const Int minor = at(0, 0) * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1)) -
                      at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0)) +
                      at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0));
    return (row + column) % 2 == 0 ? minor : -minor;
  }
};

/// Cramer's rule for every right-hand side: weight i of a point is (cofactor[i] . (point, 1)) / determinant.
struct Cramer {
  Int cofactor[4][4];
  Int determinant = 0;

  explicit Cramer(const glm::i64vec3 (&corner)[4]) {
    const Matrix matrix(corner);
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) cofactor[row][column] = matrix.cofactor(row, column);
    }
    for (int column = 0; column < 4; ++column) determinant += cofactor[0][column] * matrix.entry[0][column];
  }

  Int numerator(int i, const glm::i64vec3& point) const {
    return cofactor[i][0] * point.x + cofactor[i][1] * point.y + cofactor[i][2] * point.z + cofactor[i][3];
  }

  /// Sign of numerator i at point + (sx e, sy e^2, sz e^3), for an infinitesimal e > 0.
  int sign_beside(int i, const glm::i64vec3& point, const glm::i64vec3& signs) const {
    const int at_point = sign(numerator(i, point));
    if (at_point != 0) return at_point;
    for (int power = 0; power < 3; ++power) {
      if (cofactor[i][power] != 0) return sign(cofactor[i][power] * signs[power]);
    }
    return 0;
  }

  bool contains_beside(const glm::i64vec3& point, const glm::i64vec3& signs) const {
    for (int i = 0; i < 4; ++i) {
      if (sign_beside(i, point, signs) != sign(determinant)) return false;
    }
    return determinant != 0;
  }
};

glm::i64vec3 nudged(const glm::i64vec3& voxel, const glm::i64vec3& signs) {
  return voxel * kOne + glm::i64vec3(kNudge[0], kNudge[1], kNudge[2]) * signs;
}

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }

/// Sum of the absolute values of the six products of a determinant.
long double permanent(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return a.x * (b.y * c.z + b.z * c.y) + a.y * (b.x * c.z + b.z * c.x) + a.z * (b.x * c.y + b.y * c.x);
}

/// The largest factor, over the choices of the reference corner, by which a relative rounding error of the products in
/// Cramer's 3x3 rule grows in the weights of a point inside.
double condition(const glm::i64vec3 (&corner)[4], long double determinant) {
  long double worst = 0;
  for (int reference = 0; reference < 4; ++reference) {
    glm::dvec3 edge[3];
    for (int n = 0, m = 0; n < 4; ++n) {
      if (n != reference) edge[m++] = glm::abs(glm::dvec3(corner[n] - corner[reference]));
    }
    const glm::dvec3 inside = edge[0] + edge[1] + edge[2];
    worst = std::max({worst, permanent(inside, edge[1], edge[2]), permanent(edge[0], inside, edge[2]),
                      permanent(edge[0], edge[1], inside)});
  }
  return static_cast<double>(worst / std::abs(determinant));
}

/// Corners in the order A, B, C, D of `docs/design/definition.md`: edges from the reference corner D, in long double.
struct Edges {
  long double edge[3][3];

  explicit Edges(const glm::i64vec3 (&corner)[4]) {
    for (int n = 0; n < 3; ++n)
      for (int axis = 0; axis < 3; ++axis) edge[n][axis] = corner[n][axis] - corner[3][axis];
  }
  long double norm1(int n) const { return std::abs(edge[n][0]) + std::abs(edge[n][1]) + std::abs(edge[n][2]); }
};

/// Six times the volume over the product of the sum norms of the edges from D.
long double thickness_of(const glm::i64vec3 (&deformed)[4]) {
  const Edges of(deformed);
  return std::abs(static_cast<long double>(Cramer(deformed).determinant)) / of.norm1(0) / of.norm1(1) / of.norm1(2);
}

/// The largest derivative of u along an axis.
long double steepest_of(const glm::i64vec3 (&rest)[4], const glm::i64vec3 (&deformed)[4]) {
  const Cramer cramer(deformed);
  long double most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int along = 0; along < 3; ++along) {
      Int sum = 0;
      for (int n = 0; n < 4; ++n) sum += cramer.cofactor[n][along] * (rest[n][axis] - deformed[n][axis]);
      most = std::max(most, std::abs(static_cast<long double>(sum) / static_cast<long double>(cramer.determinant)));
    }
  }
  return most;
}

}  // namespace

double jacobian_tolerance(double jacobian, double condition, double rest_condition) {
  constexpr double kUnit = 1.0 / (1 << 24);
  return kUnit * (5 * condition + 5 * rest_condition + 2) * std::abs(jacobian);
}

Oracle::Oracle(const Geometry& output, const VertexField& field, const Region& region)
    : jacobian_min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()},
      jacobian_max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()},
      region_(region),
      owners_(static_cast<std::size_t>(voxel_count(region))) {
  const bool has_mesh = !field.mesh.is_empty();
  if (has_mesh) {
    take_mesh(output, field.mesh);
  } else {
    take_vertices(output, field);
  }
  const std::uint64_t tetrahedra =
      has_mesh ? tetrahedra_.size() : 5 * static_cast<std::uint64_t>(cells_.x * cells_.y * cells_.z);
  for (std::uint64_t number = 0; number < tetrahedra; ++number) visit(number);
  for (const Owners& voxel : owners_) multiply_owned += voxel.count > 1;
}

namespace {

/// Where the vertices of a lattice rest along one of its axes, as vertex index: their own numbers, except where an end
/// lies within rounding of the outermost voxels and is moved onto them.
/// @param step    voxels from one vertex to the next
/// @param places  vertex index of the output's corners on the axis
std::vector<double> places_on_axis(const glm::dvec3& step, std::int64_t vertices, const std::vector<double>& places) {
  const double cells = static_cast<double>(vertices - 1), length = glm::length(step);
  int along = 0;
  for (int axis = 0; axis < 3; ++axis) along += std::abs(step[axis]) * cells > 1e-6;
  const auto [lowest, highest] = std::minmax_element(places.begin(), places.end());
  // Up to a quarter of a step is left to snapping; a turned border needs more.
  const auto end = [&](double voxels_short) {
    if (voxels_short > 1.0 / 256) return 0.0;
    if (along == 1) return voxels_short > 0.25 / 4096 ? voxels_short / length : 0;
    return voxels_short > -1.0 / 4096 ? (voxels_short + 2.0 / 4096) / length : 0;
  };
  const double low = -end(-*lowest * length), high = cells + end((*highest - cells) * length);
  std::vector<double> at;
  for (std::int64_t n = 0; n < vertices; ++n) at.push_back(low + static_cast<double>(n) * (high - low) / cells);
  return at;
}

}  // namespace

void Oracle::take_vertices(const Geometry& output, const VertexField& field) {
  vertices_ = field.lattice.size;
  cells_ = vertices_ - std::int64_t{1};
  const AffineMap index = index_from_point(output) * point_from_index(field.lattice);
  const AffineMap back = index_from_point(field.lattice) * point_from_index(output);
  std::vector<double> along[3];
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> places;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at(corner & 1, corner >> 1 & 1, corner >> 2);
      places.push_back(back(at * glm::dvec3(output.size - std::int64_t{1}))[axis]);
    }
    along[axis] = places_on_axis(index.linear[axis], vertices_[axis], places);
  }
  for (int axis = 0; axis < 3; ++axis) coarse_ = coarse_ && glm::length(index.linear[axis]) >= 2.5;
  const glm::dmat3 linear = index_from_point(output).linear;
  vertex_.reserve(field.displacement.size());
  for (std::int64_t k = 0, n = 0; k < vertices_.z; ++k) {
    for (std::int64_t j = 0; j < vertices_.y; ++j) {
      for (std::int64_t i = 0; i < vertices_.x; ++i, ++n) {
        const auto place = [&](int axis, std::int64_t number) { return along[axis][static_cast<std::size_t>(number)]; };
        const glm::dvec3 rest = index({place(0, i), place(1, j), place(2, k)});
        const glm::dvec3 moved = linear * glm::dvec3(field.displacement[static_cast<std::size_t>(n)]);
        vertex_.push_back({snapped(rest), snapped(rest + moved)});
      }
    }
  }
  glm::i64vec3 low(INT64_MAX), high(INT64_MIN);
  for (const Vertex& vertex : vertex_) {
    low = glm::min(low, vertex.rest);
    high = glm::max(high, vertex.rest);
  }
  middle_doubled_ = low + high;
}

void Oracle::take_mesh(const Geometry& output, const TetrahedralMesh& mesh) {
  const AffineMap index = index_from_point(output);
  for (std::size_t n = 0; n < mesh.rest.size(); ++n) {
    const glm::dvec3 rest = index(mesh.rest[n]), moved = index.linear * glm::dvec3(mesh.displacement[n]);
    vertex_.push_back({snapped(rest), snapped(rest + moved)});
  }
  tetrahedra_ = mesh.tetrahedra;
  glm::i64vec3 low(INT64_MAX), high(INT64_MIN);
  for (const glm::u32vec4& tetrahedron : tetrahedra_) {
    for (int corner = 0; corner < 4; ++corner) {
      low = glm::min(low, vertex_[tetrahedron[corner]].rest);
      high = glm::max(high, vertex_[tetrahedron[corner]].rest);
    }
  }
  middle_doubled_ = low + high;
}

void Oracle::corners(std::uint64_t tetrahedron, Vertex (&result)[4]) const {
  if (!tetrahedra_.empty()) {
    for (int corner = 0; corner < 4; ++corner) result[corner] = vertex_[tetrahedra_[tetrahedron][corner]];
    return;
  }
  const auto cell = static_cast<std::int64_t>(tetrahedron / 5);
  const int number = static_cast<int>(tetrahedron % 5);
  const glm::i64vec3 first(cell % cells_.x, cell / cells_.x % cells_.y, cell / (cells_.x * cells_.y));
  const bool odd = (first.x + first.y + first.z) % 2 != 0;
  // Corners of the centre tetrahedron of even and odd cells. The corner tetrahedra stand at the other four corners,
  // which are those of the centre in a cell of the other parity.
  constexpr int kCentre[2][4] = {{1, 2, 4, 7}, {0, 3, 5, 6}};
  const int apex = kCentre[odd ? 0 : 1][number == 0 ? 0 : number - 1];
  const int around[4] = {apex, apex ^ 1, apex ^ 2, apex ^ 4};
  for (int n = 0; n < 4; ++n) {
    // The corner from which edges count, D, comes last.
    const int corner = number == 0 ? kCentre[odd ? 1 : 0][odd ? 3 - n : n] : around[3 - n];
    const glm::i64vec3 at = first + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
    result[n] = vertex_[static_cast<std::size_t>(at.x + vertices_.x * (at.y + vertices_.y * at.z))];
  }
}

glm::i64vec3 Oracle::signs(const glm::i64vec3& voxel) const {
  glm::i64vec3 result;
  for (int axis = 0; axis < 3; ++axis) result[axis] = voxel[axis] * 2 * kOne < middle_doubled_[axis] ? 1 : -1;
  return result;
}

std::size_t Oracle::offset(const glm::i64vec3& voxel) const {
  const glm::i64vec3 at = voxel - region_.begin, size = region_.end - region_.begin;
  return static_cast<std::size_t>(at.x + size.x * (at.y + size.y * at.z));
}

const Owners& Oracle::owners(const glm::i64vec3& voxel) const { return owners_.at(offset(voxel)); }

void Oracle::visit(std::uint64_t tetrahedron) {
  Vertex corner[4];
  corners(tetrahedron, corner);
  const glm::i64vec3 rest[4] = {corner[0].rest, corner[1].rest, corner[2].rest, corner[3].rest};
  const glm::i64vec3 deformed[4] = {corner[0].deformed, corner[1].deformed, corner[2].deformed, corner[3].deformed};
  const Cramer cramer(deformed);
  const Int rest_determinant = Cramer(rest).determinant;
  const int orientation = sign(cramer.determinant) * sign(rest_determinant);
  inverted += orientation < 0;
  degenerate += orientation == 0;
  const auto jacobian =
      static_cast<double>(static_cast<long double>(cramer.determinant) / static_cast<long double>(rest_determinant));
  if (rest_determinant != 0) {
    // Of a flat tetrahedron, whose condition is infinite, float finds nearly nothing.
    double tolerance = 1e-5 * (1 + std::abs(jacobian));
    if (cramer.determinant != 0) {
      tolerance += jacobian_tolerance(jacobian, condition(deformed, static_cast<long double>(cramer.determinant)),
                                      condition(rest, static_cast<long double>(rest_determinant)));
    }
    jacobian_min.low = std::min(jacobian_min.low, jacobian - tolerance);
    jacobian_min.high = std::min(jacobian_min.high, jacobian + tolerance);
    jacobian_max.low = std::max(jacobian_max.low, jacobian - tolerance);
    jacobian_max.high = std::max(jacobian_max.high, jacobian + tolerance);
  }

  glm::i64vec3 low = deformed[0], high = deformed[0];
  for (const glm::i64vec3& point : deformed) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  Region box;
  for (int axis = 0; axis < 3; ++axis) {  // a voxel more on all sides, for the nudge is shorter than that
    box.begin[axis] = std::max(region_.begin[axis], floor_div(low[axis], kOne) - 1);
    box.end[axis] = std::min(region_.end[axis], floor_div(high[axis], kOne) + 3);
  }
  const auto within = [&](const glm::i64vec3& q) {
    return glm::all(glm::lessThanEqual(low, q)) && glm::all(glm::lessThanEqual(q, high));
  };
  for (std::int64_t k = box.begin.z; k < box.end.z; ++k) {
    for (std::int64_t j = box.begin.y; j < box.end.y; ++j) {
      for (std::int64_t i = box.begin.x; i < box.end.x; ++i) {
        const glm::i64vec3 voxel(i, j, k), step = signs(voxel), q = nudged(voxel, step);
        if (!within(q) || !cramer.contains_beside(q, step)) continue;
        Owners& owners = owners_[offset(voxel)];
        ++owners.count;
        owners.lowest = std::min(owners.lowest, tetrahedron);
      }
    }
  }
}

Undeformed Oracle::undeformed(const glm::i64vec3& voxel) const {
  Vertex corner[4];
  corners(owners(voxel).lowest, corner);
  const glm::i64vec3 rest[4] = {corner[0].rest, corner[1].rest, corner[2].rest, corner[3].rest};
  const glm::i64vec3 deformed[4] = {corner[0].deformed, corner[1].deformed, corner[2].deformed, corner[3].deformed};
  const Cramer cramer(deformed);
  const auto determinant = static_cast<long double>(cramer.determinant);
  const auto u_at = [&](const glm::i64vec3& point) {
    glm::dvec3 u;
    for (int axis = 0; axis < 3; ++axis) {
      Int sum = 0;
      for (int n = 0; n < 4; ++n) sum += cramer.numerator(n, point) * (rest[n][axis] - deformed[n][axis]);
      u[axis] = static_cast<double>(static_cast<long double>(sum) / determinant / kOne);
    }
    return u;
  };
  const glm::i64vec3 p = voxel * kOne, q = nudged(voxel, signs(voxel));
  long double outside = 0;  // how far the weights at the voxel itself are below 0
  for (int n = 0; n < 4; ++n) {
    outside = std::max(outside, -static_cast<long double>(cramer.numerator(n, p)) / determinant);
  }
  constexpr long double kSlack = 1.0L / 64;
  Undeformed result;
  result.coarse = coarse_;
  const auto take = [&](bool at_q, bool unsure) {
    result.u = u_at(at_q ? q : p);
    result.alternative = unsure ? u_at(at_q ? p : q) : result.u;
  };
  const bool outside_slack = outside > kSlack, near_slack = std::abs(outside - kSlack) < 1e-3L;
  if (!coarse_) {
    take(outside_slack, near_slack);
  } else {
    const long double thickness = thickness_of(deformed), steepest = steepest_of(rest, deformed);
    const bool thin = !(thickness >= 0x1p-16L && steepest < 128);
    const bool near_thin = std::abs(thickness - 0x1p-16L) < 1e-12L || std::abs(steepest - 128) < 1e-6L;
    take(thin && outside_slack, near_thin ? outside_slack || near_slack : thin && near_slack);
    const glm::i64vec3 sum = deformed[0] + deformed[1] + deformed[2] + deformed[3];
    for (int axis = 0; axis < 3; ++axis)
      result.from_middle += std::abs(static_cast<double>(voxel[axis] - floor_div(sum[axis], 4 * kOne)));
  }
  result.jacobian = static_cast<double>(determinant / static_cast<long double>(Cramer(rest).determinant));
  result.condition = condition(deformed, determinant);
  result.rest_condition = condition(rest, static_cast<long double>(Cramer(rest).determinant));
  for (int n = 0; n < 3; ++n) {
    const glm::i64vec3 difference = glm::abs((rest[n] - deformed[n]) - (rest[3] - deformed[3]));
    for (int axis = 0; axis < 3; ++axis) {
      result.reach = std::max(result.reach, static_cast<double>(difference[axis]) / kOne);
    }
  }
  return result;
}

}  // namespace tetwarp::test
