// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/rigid_motion.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace tetwarp::simulate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The share of the squared ways that a rigid motion may leave over.
constexpr double kLeft = 0.25;
/// A part of the spread of points that is added in all directions, so that rotations that points leave open are not
/// made.
constexpr double kOpen = 1e-8;
/// A spread of points below this part of their squared distance from the origin is rounding of one point.
constexpr double kOnePoint = 1e-12;

Vector3d vector(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
glm::dvec3 vector(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// The best rotation minus the identity. @param spread  sum of at at^T about the mean  @param moved  sum of way at^T
/// about the mean
Matrix3d turned(const Matrix3d& spread, const Matrix3d& moved) {
  const Matrix3d sum = spread + moved + kOpen * spread.trace() * Matrix3d::Identity();
  const Eigen::JacobiSVD<Matrix3d> parts(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs(1, 1, 1);
  // The smallest singular value is the last.
  if ((parts.matrixU() * parts.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  return parts.matrixU() * signs.asDiagonal() * parts.matrixV().transpose() - Matrix3d::Identity();
}

}  // namespace

RestPlace::RestPlace(const Geometry& lattice)
    : width(static_cast<std::uint32_t>(lattice.size.x)),
      height(static_cast<std::uint32_t>(lattice.size.y)),
      middle(glm::dvec3(lattice.size - std::int64_t{1}) / 2.0),
      linear(point_from_index(lattice).linear) {}

std::optional<RigidMotion> rigid_motion(const Ways& ways) {
  if (!(ways.squares > 0)) return {};
  const Vector3d at = vector(ways.at) / ways.count, way = vector(ways.way) / ways.count;
  const Symmetric<double>& s = ways.at_at;
  Matrix3d spread, moved, turn = Matrix3d::Zero();
  spread << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  const double squares = spread.trace();
  spread -= ways.count * at * at.transpose();
  moved << vector(ways.at_by_x).transpose(), vector(ways.at_by_y).transpose(), vector(ways.at_by_z).transpose();
  moved -= ways.count * way * at.transpose();
  if (spread.trace() > kOnePoint * squares) turn = turned(spread, moved);
  const double left = ways.squares - ways.count * way.squaredNorm() - 2 * turn.cwiseProduct(moved).sum() +
                      (turn * spread * turn.transpose()).trace();
  if (!(left < kLeft * ways.squares)) return {};
  RigidMotion result{.about = vector(at), .way = vector(way)};
  for (int column = 0; column < 3; ++column) result.turned[column] = vector(Vector3d(turn.col(column)));
  return result;
}

}  // namespace tetwarp::simulate
