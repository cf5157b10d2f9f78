// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/model.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

constexpr std::size_t kCorners = 8;

std::int64_t cell_count(const Geometry& lattice) {
  const glm::i64vec3 cells = lattice.size - std::int64_t{1};
  return cells.x * cells.y * cells.z;
}

glm::ivec3 corner_steps(std::size_t corner) { return {corner & 1, corner >> 1 & 1, corner >> 2}; }

/// How many cells a link belongs to: 4 along an axis, 2 across a face, 1 across a cell.
int cells_round(const glm::ivec3& steps) {
  const int along = std::abs(steps.x) + std::abs(steps.y) + std::abs(steps.z);
  return along == 1 ? 4 : along == 2 ? 2 : 1;
}

void require_tissue(const Tissue& tissue) {
  const auto check = [&](const char* what, double value, double low, double high) {
    require(std::isfinite(value) && value >= low && value <= high,
            "the tissue \"" + tissue.name + "\" has " + what + " " + std::to_string(value) + "; expected " +
                std::to_string(low) + " to " + std::to_string(high));
  };
  check("a Young's modulus of", tissue.youngs_modulus_kpa, 1e-6, 1e9);
  check("a compression of", tissue.compression, 0, 1);
  check("a stretch of", tissue.stretch, 0, 100);
  check("a shear of", tissue.shear, 0, 100);
}

class Builder {
 public:
  Builder(Model& model, std::span<const Tissue> tissues)
      : model_(model),
        tissues_(tissues),
        springs_(spring_constants(model.lattice.spacing)),
        vertices_(static_cast<std::size_t>(voxel_count(model.lattice))) {
    const std::size_t nodes = model.nodes();
    model.neighbour.assign(kDirections * nodes, -1);
    model.stiffness.assign(kDirections * nodes, 0);
    model.limits.assign(3 * nodes, {});
  }

  /// Adds the links of a cell or of a piece of one: between vertices of the lattice, or, if `of_copies`, those with a
  /// copy at an end.
  void add(const std::array<std::uint32_t, kCorners>& node, std::uint8_t tissue, double volume, bool of_copies) {
    for (std::size_t a = 0; a < kCorners; ++a) {
      for (std::size_t b = a + 1; b < kCorners; ++b) {
        const bool has_copy = node[a] >= vertices_ || node[b] >= vertices_;
        if (has_copy == of_copies) add(node[a], node[b], corner_steps(b) - corner_steps(a), tissue, volume);
      }
    }
  }

 private:
  void add(std::uint32_t a, std::uint32_t b, const glm::ivec3& steps, std::uint8_t tissue, double volume) {
    const int direction = direction_of(steps.x, steps.y, steps.z);
    const std::size_t there = model_.link(direction, a), back = model_.link(opposite(direction), b);
    const auto is_free_or = [&](std::size_t link, std::uint32_t node) {
      return model_.neighbour[link] < 0 || model_.neighbour[link] == static_cast<std::int32_t>(node);
    };
    if (!is_free_or(there, b) || !is_free_or(back, a)) return;  // at the rim of a cut
    const bool is_new = model_.neighbour[there] < 0;
    model_.neighbour[there] = static_cast<std::int32_t>(b);
    model_.neighbour[back] = static_cast<std::int32_t>(a);
    const double newton_per_mm2 = tissues_[tissue].youngs_modulus_kpa * 1e-3;
    const auto stiffness = static_cast<float>(springs_.along[static_cast<std::size_t>(direction)] * newton_per_mm2 *
                                              volume / cells_round(steps));
    model_.stiffness[there] += stiffness;
    model_.stiffness[back] += stiffness;
    if (cells_round(steps) != 4) return;
    const bool is_up = steps.x + steps.y + steps.z == 1;
    limit(glm::abs(steps), is_up ? a : b, tissues_[tissue], is_new);
  }

  void limit(const glm::ivec3& steps, std::size_t node, const Tissue& tissue, bool is_new) {
    const int axis = steps.x ? 0 : steps.y ? 1 : 2;
    const double length = model_.lattice.spacing[axis];
    LinkLimits& limits = model_.limits[static_cast<std::size_t>(axis) * model_.nodes() + node];
    const LinkLimits own{static_cast<float>(-tissue.compression * length), static_cast<float>(tissue.stretch * length),
                         static_cast<float>(tissue.shear * length)};
    limits = is_new ? own
                    : LinkLimits{std::max(limits.shortest, own.shortest), std::min(limits.longest, own.longest),
                                 std::min(limits.shear, own.shear)};
  }

  Model& model_;
  std::span<const Tissue> tissues_;
  SpringConstants springs_;
  std::size_t vertices_;
};

}  // namespace

SpringConstants spring_constants(const glm::dvec3& h) {
  constexpr double kShear = 1 / 2.5;      // part of Young's modulus, at Poisson's ratio 1/4
  constexpr double kBodyShare = 4.0 / 7;  // part of the shear modulus that body diagonals give
  const glm::dvec3 square = h * h;
  const double volume = h.x * h.y * h.z, across_cell = square.x + square.y + square.z;
  const double largest_pair = std::max({square.x * square.y, square.y * square.z, square.x * square.z});
  const double body = kBodyShare * kShear * volume * across_cell / (4 * largest_pair);
  const auto face = [&](int a, int b) {
    const double pair = square[a] * square[b];
    return (kShear * volume - 4 * body * pair / across_cell) * (square[a] + square[b]) / (2 * pair);
  };
  const auto axial = [&](int a, int b, int c) {
    const double fourth = square[a] * square[a];
    const double by_diagonals = 2 * face(a, b) * fourth / (square[a] + square[b]) +
                                2 * face(a, c) * fourth / (square[a] + square[c]) + 4 * body * fourth / across_cell;
    return std::max(0.0, (3 * kShear * volume - by_diagonals) / square[a]);
  };
  SpringConstants result;
  for (int d = 0; d < kDirections; ++d) {
    const glm::ivec3 steps = link_steps(d);
    double& k = result.along[static_cast<std::size_t>(d)];
    if (cells_round(steps) == 1) {
      k = body;
    } else if (cells_round(steps) == 2) {
      k = steps.x == 0 ? face(1, 2) : steps.y == 0 ? face(0, 2) : face(0, 1);
    } else {
      k = steps.x != 0 ? axial(0, 1, 2) : steps.y != 0 ? axial(1, 0, 2) : axial(2, 0, 1);
    }
  }
  return result;
}

Model make_model(const Geometry& lattice, std::span<const std::uint8_t> tissue_of_cell, std::span<const Tissue> tissues,
                 std::span<const std::uint32_t> copies_of, std::span<const CellPiece> pieces) {
  require_valid(lattice, "the lattice");
  const std::int64_t vertices = voxel_count(lattice), cells = cell_count(lattice);
  require(cells > 0, "a lattice of " + to_string(lattice.size) + " vertices has no cell");
  require(vertices + static_cast<std::int64_t>(copies_of.size()) < INT32_MAX,
          "a lattice of " + to_string(lattice.size) + " vertices is too large to simulate; choose larger cells");
  require(
      tissue_of_cell.size() == static_cast<std::size_t>(cells),
      "one tissue a cell is expected, " + std::to_string(cells) + "; found " + std::to_string(tissue_of_cell.size()));
  for (const Tissue& tissue : tissues) require_tissue(tissue);

  Model model{.lattice = lattice, .vertex = {}, .neighbour = {}, .stiffness = {}, .limits = {}};
  for (std::int64_t v = 0; v < vertices; ++v) model.vertex.push_back(static_cast<std::uint32_t>(v));
  model.vertex.insert(model.vertex.end(), copies_of.begin(), copies_of.end());
  Builder builder(model, tissues);
  auto piece = pieces.begin();
  const glm::i64vec3 size = lattice.size;
  std::uint64_t cell = 0;
  for (std::int64_t k = 0; k + 1 < size.z; ++k) {
    for (std::int64_t j = 0; j + 1 < size.y; ++j) {
      for (std::int64_t i = 0; i + 1 < size.x; ++i, ++cell) {
        const std::uint8_t tissue = tissue_of_cell[cell];
        if (tissue >= tissues.size()) {
          throw InputError("the cell " + std::to_string(cell) + " is of the tissue " + std::to_string(tissue) +
                           "; there are " + std::to_string(tissues.size()));
        }
        if (piece != pieces.end() && piece->cell == cell) {
          for (; piece != pieces.end() && piece->cell == cell; ++piece)
            builder.add(piece->node, tissue, piece->volume, false);
          continue;
        }
        std::array<std::uint32_t, kCorners> node;
        for (std::size_t c = 0; c < kCorners; ++c) {
          const glm::ivec3 at = corner_steps(c);
          node[c] = static_cast<std::uint32_t>(i + at.x + size.x * (j + at.y + size.y * (k + at.z)));
        }
        builder.add(node, tissue, 1, false);
      }
    }
  }
  require(piece == pieces.end(), "pieces of cells are expected by rising number of a cell of the lattice");
  for (const CellPiece& of_copies : pieces)
    builder.add(of_copies.node, tissue_of_cell[of_copies.cell], of_copies.volume, true);
  return model;
}

glm::dvec3 rest_link(const Geometry& lattice, int direction) {
  return lattice.direction * (lattice.spacing * glm::dvec3(link_steps(direction)));
}

std::ptrdiff_t link_distance(const Geometry& lattice, int direction) {
  const glm::i64vec3 steps(link_steps(direction));
  return steps.x + lattice.size.x * (steps.y + lattice.size.y * steps.z);
}

}  // namespace tetwarp::simulate
