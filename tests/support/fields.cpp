// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/fields.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace tetwarp::test {

Geometry unit_grid(const glm::i64vec3& size) {
  Geometry geometry;
  geometry.size = size;
  return geometry;
}

Geometry oblique_grid(const glm::i64vec3& size) {
  return {size, {0.7, 0.8, 1.25}, {-101.3, 57.9, 33.1}, rotation({1, 2, 3}, 0.6)};
}

glm::dmat3 rotation(const glm::dvec3& axis, double angle) {
  const glm::dvec3 n = glm::normalize(axis);
  glm::dmat3 result;
  for (int column = 0; column < 3; ++column) {
    glm::dvec3 e(0);
    e[column] = 1;
    result[column] =
        std::cos(angle) * e + std::sin(angle) * glm::cross(n, e) + (1 - std::cos(angle)) * glm::dot(n, e) * n;
  }
  return result;
}

VertexField uniform_field(const Geometry& lattice, const glm::vec3& mm) {
  return {lattice, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(lattice)), mm)};
}

namespace {

/// A lattice over a grid whose vertices are given in voxels of output index.
struct Net {
  glm::i64vec3 size;
  std::int64_t cell;  // voxels
  std::vector<glm::dvec3> moved;

  Net(const Geometry& lattice, std::int64_t cell_size)
      : size(lattice.size), cell(cell_size), moved(static_cast<std::size_t>(voxel_count(lattice)), glm::dvec3(0)) {}

  std::size_t offset(const glm::i64vec3& vertex) const {
    return static_cast<std::size_t>(vertex.x + size.x * (vertex.y + size.y * vertex.z));
  }
  glm::dvec3 deformed(const glm::i64vec3& vertex) const { return glm::dvec3(vertex * cell) + moved[offset(vertex)]; }

  template <class Visit>
  static void for_each(const glm::i64vec3& count, Visit&& visit) {
    for (std::int64_t k = 0; k < count.z; ++k) {
      for (std::int64_t j = 0; j < count.y; ++j) {
        for (std::int64_t i = 0; i < count.x; ++i) visit(glm::i64vec3(i, j, k));
      }
    }
  }

  bool is_border(const glm::i64vec3& vertex, int axis) const {
    return vertex[axis] == 0 || vertex[axis] == size[axis] - 1;
  }
};

/// Corners of the tetrahedra of even and odd cells (docs/design/definition.md).
constexpr int kTetrahedra[2][5][4] = {{{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}},
                                      {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 3, 0, 6}, {4, 5, 6, 0}, {7, 6, 5, 3}}};

/// Puts the vertices of every tetrahedron that is flat or inverted back to rest, until there is none. Coordinates are
/// dyadic and have few bits, so the determinant in double is exact.
void unfold(Net& net) {
  const auto volume = [](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    return glm::dot(a - d, glm::cross(b - d, c - d));
  };
  for (bool again = true; again;) {
    again = false;
    Net::for_each(net.size - std::int64_t{1}, [&](const glm::i64vec3& cell) {
      for (const auto& corners : kTetrahedra[(cell.x + cell.y + cell.z) & 1]) {
        glm::i64vec3 vertex[4];
        glm::dvec3 rest[4], deformed[4];
        for (int n = 0; n < 4; ++n) {
          vertex[n] = cell + glm::i64vec3(corners[n] & 1, corners[n] >> 1 & 1, corners[n] >> 2);
          rest[n] = glm::dvec3(vertex[n] * net.cell);
          deformed[n] = net.deformed(vertex[n]);
        }
        const double before = volume(rest[0], rest[1], rest[2], rest[3]);
        const double after = volume(deformed[0], deformed[1], deformed[2], deformed[3]);
        if (before * after > 0) continue;
        again = true;
        for (const glm::i64vec3& at : vertex) net.moved[net.offset(at)] = glm::dvec3(0);
      }
    });
  }
}

/// Displaces vertices at random by multiples of `quantum`. Border vertices stay within their faces.
void shake(Net& net, Random& random, double quantum, double amplitude) {
  const double share = random.one_of<double>({0.1, 0.5, 1.0});
  const bool border_moves = random.chance(0.5);
  const glm::bvec3 moves(random.chance(0.7), random.chance(0.7), random.chance(0.7));
  const auto most = static_cast<std::int64_t>(amplitude / quantum);
  Net::for_each(net.size, [&](const glm::i64vec3& vertex) {
    if (!random.chance(share)) return;
    const bool border = net.is_border(vertex, 0) || net.is_border(vertex, 1) || net.is_border(vertex, 2);
    if (border && !border_moves) return;
    for (int axis = 0; axis < 3; ++axis) {
      if (!moves[axis] || net.is_border(vertex, axis)) continue;
      net.moved[net.offset(vertex)][axis] = static_cast<double>(random.integer(-most, most)) * quantum;
    }
  });
}

/// A random affine map that is exact: mirrored, turned by right angles, stretched or sheared, then shifted.
AffineMap random_exact_map(Random& random, const glm::dvec3& middle) {
  AffineMap map;
  if (random.chance(0.2)) map.linear[random.axis()] *= -1.0;
  if (random.chance(0.2)) std::swap(map.linear[0], map.linear[static_cast<int>(random.integer(1, 2))]);
  if (random.chance(0.2)) map.linear[random.axis()] *= random.one_of<double>({0.5, 1.5, 2.0});
  if (random.chance(0.2)) {
    const auto axis = random.axis();
    map.linear[axis] += random.one_of<double>({-1.0, -0.5, 0.5, 1.0}) * map.linear[(axis + 1) % 3];
  }
  if (map.linear != glm::dmat3(1)) map.offset = middle - map.linear * middle;
  if (random.chance(0.5)) {
    const double quantum = random.one_of<double>({1.0, 0.5, 0.25, 1.0 / 1024});
    for (int axis = 0; axis < 3; ++axis) {
      map.offset[axis] += std::nearbyint(random.real(-3, 3) / quantum) * quantum;
    }
  }
  return map;
}

/// A grid of a few voxels and the lattice over it, in cells of 1 to 16 voxels.
struct Setting {
  Geometry output, lattice;
  std::int64_t cell;

  explicit Setting(Random& random) : cell(random.one_of<std::int64_t>({1, 1, 1, 2, 2, 3, 4, 5, 8, 16})) {
    const std::int64_t largest = cell < 4 ? 8 : 14;
    const glm::i64vec3 size(random.integer(3, largest), random.integer(3, largest), random.integer(3, largest));
    output = random.chance(0.75) ? unit_grid(size) : oblique_grid(size);
    lattice = lattice_over(output, cell);
  }
};

FieldCase make_case(const Setting& setting, const Net& net, const AffineMap& image, const std::string& kind) {
  const VertexField field = field_in_voxels(setting.output, setting.lattice, [&](const glm::dvec3& rest) {
    const auto vertex = glm::i64vec3(glm::round(rest)) / net.cell;
    const glm::dvec3 deformed = image(net.deformed(vertex));
    return deformed - glm::dvec3(vertex * net.cell);
  });
  return {setting.output, field,
          kind + ", grid " + to_string(setting.output.size) + ", cells of " + std::to_string(setting.cell) +
              (setting.output.spacing == glm::dvec3(1) ? "" : ", oblique"),
          image};
}

}  // namespace

FieldCase random_injective_case(Random& random) {
  const Setting setting(random);
  Net net(setting.lattice, setting.cell);
  const double quantum = random.one_of<double>({1.0, 0.5, 0.5, 0.25, 1.0 / 16, 1.0 / 1024});
  if (random.chance(0.85)) shake(net, random, quantum, random.real(0.2, 1.2) * static_cast<double>(setting.cell));
  unfold(net);
  const glm::dvec3 middle = 0.5 * glm::dvec3((net.size - std::int64_t{1}) * net.cell);
  return make_case(setting, net, random_exact_map(random, middle), "injective");
}

FieldCase random_folding_case(Random& random) {
  const Setting setting(random);
  Net net(setting.lattice, setting.cell);
  const auto cell = static_cast<double>(setting.cell);
  const double quantum = random.one_of<double>({1.0, 0.5, 1.0 / 16, 1.0 / 4096});
  shake(net, random, quantum, random.real(0.5, 3) * cell);
  const auto axis = random.axis();
  const double middle = 0.5 * cell * static_cast<double>(net.size[axis] - 1);
  AffineMap image;
  std::string kind = "folding";
  switch (random.integer(0, 4)) {
    case 0: break;
    case 1:  // one plane through everything: all tetrahedra degenerate
      kind += ", flat";
      image.linear[axis][axis] = 0;
      image.offset[axis] = std::floor(middle);
      break;
    case 2:  // slivers: a few steps of 2^-12 voxel thick, across a plane of voxel centres
      kind += ", slivers";
      image.linear[axis][axis] = 1.0 / static_cast<double>(1 << random.integer(4, 11));
      image.offset[axis] = std::floor(middle);
      break;
    case 3:  // one half of it folded over the other
      kind += ", folded over";
      Net::for_each(net.size, [&](const glm::i64vec3& vertex) {
        const double at = net.deformed(vertex)[axis];
        if (at > middle) net.moved[net.offset(vertex)][axis] += 2 * (middle - at);
      });
      break;
    default: image = random_exact_map(random, glm::dvec3(middle)); break;
  }
  return make_case(setting, net, image, kind);
}

}  // namespace tetwarp::test
