// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/chain_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

constexpr std::int64_t kBlockRows = 4;  ///< vertices of a block along j and k; along i it has all
/// How far the scalar products of directions may differ from 0 and 1.
constexpr double kOrthonormal = 1e-6;
constexpr double kPi = 3.141592653589793;

void require_orthonormal(const glm::dmat3& direction) {
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) {
      const glm::dvec3 &u = direction[a], &v = direction[b];
      const double product = u.x * v.x + u.y * v.y + u.z * v.z, expected = a == b;
      require(std::abs(product - expected) <= kOrthonormal,
              "chainmail needs a lattice with axes at right angles: the product of its directions " +
                  std::to_string(a) + " and " + std::to_string(b) + " is " + std::to_string(product) + ", expected " +
                  std::to_string(expected));
    }
  }
}

/// Limits in whole units, rounded towards 0, so that they never allow more than in mm.
LinkUnits to_units(const LinkLimits& limits, int axis, std::size_t node) {
  if (!(limits.shortest <= 0 && limits.longest >= 0 && limits.shear >= 0)) {
    throw InputError("the limits of the link up axis " + std::to_string(axis) + " from node " + std::to_string(node) +
                     " are " + std::to_string(limits.shortest) + " to " + std::to_string(limits.longest) +
                     " mm and shear " + std::to_string(limits.shear) + " mm; 0 must be within them");
  }
  const auto whole = [](float mm) {
    const double most = kLongest;
    return static_cast<std::int32_t>(std::clamp(static_cast<double>(mm) * kUnitsPerMm, -most, most));
  };
  return {whole(limits.shortest), whole(limits.longest), whole(limits.shear)};
}

}  // namespace

ChainPlan::ChainPlan(const Model& model) : direction(model.lattice.direction) {
  require_orthonormal(direction);
  number(model);
  connect(model);
  find_islands();
  weigh(model.lattice);
}

void ChainPlan::number(const Model& model) {
  const glm::i64vec3 size = model.lattice.size, many = (size + (kBlockRows - 1)) / kBlockRows;
  const auto block_of = [&](std::size_t node) {
    const std::int64_t row = model.vertex[node] / size.x;
    return static_cast<std::size_t>(row % size.y / kBlockRows + many.y * (row / size.y / kBlockRows));
  };
  blocks.resize(static_cast<std::size_t>(many.y * many.z));
  std::vector<std::int32_t> begin(blocks.size() + 1);
  for (std::size_t n = 0; n < model.nodes(); ++n) ++begin[block_of(n) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::int64_t k = 0; k < many.z; ++k) {
    for (std::int64_t j = 0; j < many.y; ++j) {
      const std::int64_t at = j + many.y * k;
      ChainBlock& block = blocks[static_cast<std::size_t>(at)];
      block.begin = begin[static_cast<std::size_t>(at)];
      block.end = begin[static_cast<std::size_t>(at) + 1];
      block.colour = static_cast<int>((j + k) % 2);
      const auto add = [&](bool exists, std::int64_t step) {
        if (exists) block.beside.push_back(static_cast<std::int32_t>(at + step));
      };
      add(k > 0, -many.y);
      add(j > 0, -1);
      add(j + 1 < many.y, 1);
      add(k + 1 < many.z, many.y);
    }
  }
  node_of.resize(model.nodes());
  number_of.resize(model.nodes());
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    const std::int32_t to = begin[block_of(n)]++;
    node_of[static_cast<std::size_t>(to)] = static_cast<std::int32_t>(n);
    number_of[n] = to;
  }
}

void ChainPlan::connect(const Model& model) {
  const std::size_t count = model.nodes();
  around.resize(6 * count);
  links.resize(3 * count);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < count; ++n) {
      const auto node = static_cast<std::size_t>(node_of[n]);
      const auto number = [&](int to) {
        const std::int32_t other = model.neighbour[model.link(to, node)];
        return other < 0 ? -1 : number_of[static_cast<std::size_t>(other)];
      };
      const auto at = static_cast<std::size_t>(axis);
      around[2 * at * count + n] = number(opposite(direction_up(axis)));
      around[(2 * at + 1) * count + n] = number(direction_up(axis));
      links[at * count + n] = simulate::to_units(model.limits[at * count + node], axis, node);
    }
  }
}

void ChainPlan::find_islands() {
  const auto count = static_cast<std::size_t>(nodes());
  island_.assign(count, -1);
  std::vector<std::int32_t> open;
  for (std::size_t first = 0; first < count; ++first) {
    if (island_[first] >= 0) continue;
    island_[first] = islands_;
    open.push_back(static_cast<std::int32_t>(first));
    while (!open.empty()) {
      const auto node = static_cast<std::size_t>(open.back());
      open.pop_back();
      for (std::size_t side = 0; side < 6; ++side) {
        const std::int32_t other = around[side * count + node];
        if (other < 0 || island_[static_cast<std::size_t>(other)] >= 0) continue;
        island_[static_cast<std::size_t>(other)] = islands_;
        open.push_back(other);
      }
    }
    ++islands_;
  }
}

void ChainPlan::weigh(const Geometry& lattice) {
  const glm::dvec3 weight = 1.0 / (lattice.spacing * lattice.spacing);
  shares.resize(27 * 3);
  for (int kind = 1; kind < 27; ++kind) {
    const glm::dvec3 number(kind % 3, kind / 3 % 3, kind / 9);
    const double sum = number.x * weight.x + number.y * weight.y + number.z * weight.z;
    for (int axis = 0; axis < 3; ++axis) {
      if (number[axis] == 0) continue;
      const double share = std::floor(weight[axis] / sum * (1 << kShareBits));
      shares[static_cast<std::size_t>(3 * kind + axis)] = std::max(1, static_cast<std::int32_t>(share));
    }
  }
  // Of the common waves, the mean damps that one most slowly which is half a sine over the longest way through the
  // lattice, held at both ends. A step leaves the part `slowest` of it: 1 - share (1 - cos angle).
  double slowest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double angle = kPi / static_cast<double>(lattice.size[axis]);
    const double damped = weight[axis] / (weight.x + weight.y + weight.z) * angle * angle / 2;
    slowest = std::max(slowest, 1 - damped);
  }
  const double rate = 2 / (1 + std::sqrt(1 - slowest * slowest));
  momentum = rounded((rate - 1) * (1 << kPaceBits));
  patience = static_cast<std::int32_t>(4 * std::max({lattice.size.x, lattice.size.y, lattice.size.z}));
}

Units ChainPlan::to_units(const glm::vec3& lps, const char* what, std::size_t node) const {
  const double x = lps.x, y = lps.y, z = lps.z;
  Units result{};
  for (int c = 0; c < 3; ++c) {
    const double units = (direction[c].x * x + direction[c].y * y + direction[c].z * z) * kUnitsPerMm;
    if (!(std::abs(units) <= kFarthest)) {
      throw InputError(std::string(what) + " of node " + std::to_string(node) + " is " + std::to_string(x) + ", " +
                       std::to_string(y) + ", " + std::to_string(z) + " mm; expected finite numbers, within " +
                       std::to_string(std::lround(kFarthest / kUnitsPerMm)) + " mm along the lattice's axes");
    }
    result.at[c] = rounded(units);
  }
  return result;
}

std::vector<Units> ChainPlan::to_units(std::span<const glm::vec3> displacement) const {
  require(displacement.size() == node_of.size(), "one displacement a node is expected, " +
                                                     std::to_string(node_of.size()) + "; found " +
                                                     std::to_string(displacement.size()));
  std::vector<Units> result(displacement.size());
  for (std::size_t n = 0; n < displacement.size(); ++n) {
    result[static_cast<std::size_t>(number_of[n])] = to_units(displacement[n], "the displacement", n);
  }
  return result;
}

std::vector<PlacedNode> ChainPlan::read(const Loads& loads) const {
  const auto check = [&](const char* what, std::size_t found) {
    require(found == node_of.size(), std::string(what) + " a node is expected, " + std::to_string(node_of.size()) +
                                         "; found " + std::to_string(found));
  };
  check("one hold", loads.constraint.size());
  check("one goal", loads.goal.size());
  require(loads.force.empty(), "chainmail knows no forces, found " + std::to_string(loads.force.size()) +
                                   "; place nodes, or use mass-spring");
  std::vector<PlacedNode> placed;
  for (std::size_t n = 0; n < node_of.size(); ++n) {
    const auto node = static_cast<std::size_t>(node_of[n]);
    if (loads.constraint[node] != Constraint::placed) continue;
    placed.push_back({static_cast<std::int32_t>(n), {}, to_units(loads.goal[node], "the goal", node)});
  }
  return placed;
}

std::vector<PlacedSet> ChainPlan::sets_of(std::vector<PlacedNode>& placed) const {
  constexpr std::size_t kMostBytes = std::size_t{512} << 20;
  const auto way = [](const PlacedNode& one) {
    const auto& [x, y, z] = one.start.at;
    const auto& [u, v, w] = one.goal.at;
    return std::array{x, y, z, u, v, w};
  };
  std::stable_sort(placed.begin(), placed.end(),
                   [&](const PlacedNode& a, const PlacedNode& b) { return way(a) < way(b); });
  std::vector<PlacedSet> sets;
  for (std::size_t n = 0; n < placed.size(); ++n) {
    if (n == 0 || way(placed[n]) != way(placed[n - 1])) sets.push_back({n, n});
    sets.back().end = n + 1;
    if (sets.size() > SetPaths::kMost) return {};
  }
  if (sets.size() * static_cast<std::size_t>(nodes()) * 2 * sizeof(Units) > kMostBytes) return {};
  return sets;
}

std::vector<std::uint8_t> ChainPlan::moving(std::span<const PlacedNode> placed) const {
  std::vector<std::uint8_t> reached(static_cast<std::size_t>(islands_)), result(node_of.size());
  for (const PlacedNode& one : placed) {
    reached[static_cast<std::size_t>(island_[static_cast<std::size_t>(one.node)])] = 1;
  }
  for (std::size_t n = 0; n < result.size(); ++n) result[n] = reached[static_cast<std::size_t>(island_[n])];
  return result;
}

std::vector<std::byte> state_of_chain(std::span<const Units> now, std::span<const Units> shown,
                                      std::span<const glm::vec3> displacement) {
  std::vector<std::byte> bytes;
  for (const std::span<const Units>& units : {now, shown}) {
    for (const Units& of : units) put_bytes(bytes, std::span<const std::int32_t>(of.at));  // without what aligns it
  }
  put_bytes(bytes, displacement);
  return bytes;
}

void read_chain_state(std::span<const std::byte> state, std::span<Units> now, std::span<Units> shown,
                      std::span<glm::vec3> displacement) {
  const std::size_t nodes = now.size();
  StateBytes bytes(state, nodes * (2 * sizeof(Units::at) + sizeof(glm::vec3)));
  for (const std::span<Units>& units : {now, shown}) {
    const std::vector<std::int32_t> numbers = bytes.take<std::int32_t>(3 * nodes);
    for (std::size_t n = 0; n < nodes; ++n)
      std::copy_n(numbers.begin() + static_cast<std::ptrdiff_t>(3 * n), 3, units[n].at);
  }
  const std::vector<glm::vec3> shown_mm = bytes.take<glm::vec3>(nodes);
  std::copy(shown_mm.begin(), shown_mm.end(), displacement.begin());
}

void require_valid(double part, const StoppingRule& rule) {
  require(part >= 0 && part <= 1, "the part of the way is " + std::to_string(part) + ", expected 0 to 1");
  require(rule.motion_mm >= 0, "the largest motion is " + std::to_string(rule.motion_mm) + " mm, expected 0 or more");
  require(rule.steps >= 0, "the number of steps is " + std::to_string(rule.steps) + ", expected 0 or more");
}

double motion_mm(std::uint64_t square) { return std::sqrt(static_cast<double>(square)) / kUnitsPerMm; }

}  // namespace tetwarp::simulate
