// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp::simulate {

/// Cells of a lattice as tetrahedra that fit together face by face. They are split along cuts, one cut after the other,
/// so that in the end no tetrahedron lies on both sides of a cut. Numbers of vertices and tetrahedra are indices of
/// `vertices` and `tetrahedra`.
///
/// Where a cut goes through an edge a vertex is put. All tetrahedra at the edge are split, also where the cut ends
/// there, so that every vertex is a corner of all tetrahedra around it: no gap opens where vertices are rounded later.
class TetrahedronSplitter {
 public:
  /// A place given as a mean of lattice vertices, all of one of the lattice's tetrahedra.
  struct Vertex {
    std::array<std::uint32_t, 4> corner{kNone, kNone, kNone, kNone};  ///< lattice vertices, rising
    std::array<double, 4> weight{};                                   ///< they add up to 1

    /// The mean, by the weights, of what `of_corner` gives for each corner.
    double mean(const std::function<double(std::uint32_t)>& of_corner) const;
    /// Whether it is a vertex of the lattice itself.
    bool is_corner() const { return corner[1] == kNone; }
  };
  /// A tetrahedron, or a part of one that a cut split.
  struct Tetrahedron {
    std::array<std::uint32_t, 4> vertex;  ///< numbers of its corners
    std::uint64_t cell;                   ///< number of the lattice's cell in which it lies, i fastest
  };
  using Triangle = std::array<std::uint32_t, 3>;      ///< numbers of vertices, rising
  static constexpr std::uint32_t kNone = UINT32_MAX;  ///< no vertex

  /// Makes the tetrahedra of some cells, five of each.
  /// @param lattice  vertices of the lattice along i, j, k
  /// @param cells    numbers of the cells on the lattice, i fastest, rising
  TetrahedronSplitter(const glm::i64vec3& lattice, std::span<const std::uint64_t> cells);

  /// Makes a cut.
  /// @param side        signed distance, mm, of a lattice vertex from the cut, which goes where the sign changes
  /// @param nearest     mm; a vertex that is nearer to the cut counts as this far away, so that no sliver is cut off
  /// @param is_through  whether the cut goes through a cell; elsewhere only what touches it is split
  void cut(const std::function<double(std::uint32_t)>& side, double nearest,
           const std::function<bool(std::uint64_t)>& is_through);

  /// All vertices: those of the lattice that the cells have, and those that cuts put on edges.
  const std::vector<Vertex>& vertices() const { return vertices_; }
  /// All tetrahedra. Those of a cell follow each other, and cells rise.
  const std::vector<Tetrahedron>& tetrahedra() const { return tetrahedra_; }
  /// Whether a cut separates the two tetrahedra at a face.
  bool is_severed(const Triangle& face) const { return severed_.contains(face); }

 private:
  struct Hash {
    std::size_t operator()(const Triangle& t) const {
      return (t[0] * 0x9E3779B97F4A7C15u ^ t[1]) * 0xC2B2AE3D27D4EB4Fu ^ t[2] * 0x165667B19E3779F9u;
    }
  };
  /// Triangles that bound a part of a tetrahedron.
  using Skin = std::vector<Triangle>;

  /// The vertex where the present cut goes through an edge, or kNone.
  std::uint32_t on_edge(std::uint32_t a, std::uint32_t b) const;
  /// Adds a vertex at the weighted mean of others and returns its number.
  std::uint32_t add_mean(std::span<const std::uint32_t> of, std::span<const double> weights);
  void mark_edges(const std::function<bool(std::uint64_t)>& is_through);
  void split(const Tetrahedron& whole, bool is_through, std::vector<Tetrahedron>& result);
  void split_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, Skin& above, Skin& below);
  void sever(const Tetrahedron& whole, Skin& above, Skin& below);
  void fill(const Skin& skin, std::uint64_t cell, std::vector<Tetrahedron>& result);

  std::vector<Vertex> vertices_;
  std::vector<Tetrahedron> tetrahedra_;
  std::unordered_set<Triangle, Hash> severed_;
  std::vector<double> side_;  ///< by vertex: the side of the present cut on which it lies
  /// By edge, as (a, b, 0): the vertex where the present cut goes through it.
  std::unordered_map<Triangle, std::uint32_t, Hash> on_edge_;
};

}  // namespace tetwarp::simulate
