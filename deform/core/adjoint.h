// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/coarse_map.h"
#include "deform/core/lattice_vertex.h"
#include "deform/core/sample_voxel.h"

/// The transpose of a deformation and its gradients, voxel by voxel: what every backend runs
/// (docs/design/definition.md, "The transpose and the gradients").
namespace tetwarp {

/// Sums that do not depend on the order of their terms: each term is rounded to a whole number of 2^-q, and whole
/// numbers are added.
struct Quantum {
  int q = 0;         ///< -log2 of the quantum
  double scale = 1;  ///< 2^q

  Quantum() = default;
  /// @param terms    how many terms a sum may have, at most
  /// @param largest  none is twice as large in size; finite
  TETWARP_HD Quantum(double terms, double largest) {
    if (largest == 0) return;
    constexpr int kMost = 1023;  // 2^q is a double
    int of_terms = 0, of_largest = 0;
    const double product = std::frexp(terms, &of_terms) * std::frexp(largest, &of_largest);  // from 1/4 to 1
    // The power of two that is not below terms times largest, which as a product might be too large for a double.
    const int above = of_terms + of_largest - (product <= 0.5) - (product == 0.25);
    q = 62 - above < kMost ? 62 - above : kMost;
    scale = std::ldexp(1.0, q);
  }

  /// A term as a whole number of quanta, to nearest, ties to even. @param term  finite, not larger than was said.
  /// Weights of vertices are at most 1 + 3/64, so that terms exceed the largest they are made of by less than twice.
  TETWARP_HD std::int64_t steps(double term) const {
#ifdef TETWARP_ON_DEVICE
    return __double2ll_rn(term * scale);
#else
    return std::llrint(term * scale);
#endif
  }
  /// A sum of such numbers.
  TETWARP_HD double value(std::int64_t sum) const { return std::ldexp(static_cast<double>(sum), -q); }
};

/// A tetrahedron of a field, and the numbers of its vertices A, B, C and D: those of the lattice, i fastest, then those
/// of the mesh.
struct NumberedTetrahedron {
  Tetrahedron t;
  std::uint32_t vertex[4];
};

/// The tetrahedra of a lattice, by the numbers of `Maps::tetrahedra`.
struct LatticeTetrahedra {
  LatticeFrame frame;
  const glm::vec3* displacement;

  /// @return its vertices were snapped before, so that none is out of reach
  TETWARP_HD NumberedTetrahedron operator()(std::uint32_t number) const {
    const auto cells_x = static_cast<std::uint32_t>(frame.cells.x), cells_y = static_cast<std::uint32_t>(frame.cells.y);
    const std::uint32_t cell = number / kTetrahedraPerCell, row = cell / cells_x;
    const glm::i64vec3 at(cell % cells_x, row % cells_y, row / cells_y);
    const bool odd = ((at.x + at.y + at.z) & 1) != 0;
    const TetrahedronCorners corners = tetrahedron_corners(static_cast<int>(number % kTetrahedraPerCell), odd);
    NumberedTetrahedron result;
    const auto take = [&](int corner, Vertex& vertex, std::uint32_t& of) {
      const glm::i64vec3 v = at + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
      of = static_cast<std::uint32_t>((v.z * (frame.cells.y + 1) + v.y) * (frame.cells.x + 1) + v.x);
      frame.snap_vertex(v, displacement[of], vertex);
    };
    take(corners.a, result.t.a, result.vertex[0]);
    take(corners.b, result.t.b, result.vertex[1]);
    take(corners.c, result.t.c, result.vertex[2]);
    take(corners.d, result.t.d, result.vertex[3]);
    return result;
  }
};

/// The tetrahedra of a mesh, or of a lattice with replaced cells that was made into one (`SnappedMesh`). Where both are
/// snapped to one vertex they are two all the same: a tetrahedron of the mesh has the vertices of the mesh.
struct MeshTetrahedra {
  const Vertex* vertices;          ///< of `SnappedMesh`
  const glm::u32vec4* tetrahedra;  ///< of `SnappedMesh`
  std::uint32_t of_lattice;        ///< how many come before those of the mesh
  const glm::u32vec4* of_mesh;     ///< as the field has them
  std::uint32_t lattice_vertices;  ///< which come before those of the mesh

  TETWARP_HD NumberedTetrahedron operator()(std::uint32_t number) const {
    const glm::u32vec4 at = tetrahedra[number];
    glm::u32vec4 of = at;
    if (number >= of_lattice) of = of_mesh[number - of_lattice] + lattice_vertices;
    return {{vertices[at.x], vertices[at.y], vertices[at.z], vertices[at.w]}, {of.x, of.y, of.z, of.w}};
  }
};

/// The edges of a deformed tetrahedron about D, as weights are computed from them, in double.
struct TetrahedronEdges {
  glm::dvec3 across[3]{};  ///< b x c, c x a and a x b, 2^-24 voxel squared
  double inverse = 0;      ///< 1 / determinant

  TetrahedronEdges() = default;
  TETWARP_HD explicit TetrahedronEdges(const Tetrahedron& t) {
    const glm::dvec3 a(t.a.deformed - t.d.deformed), b(t.b.deformed - t.d.deformed), c(t.c.deformed - t.d.deformed);
    const auto cross = [](const glm::dvec3& p, const glm::dvec3& q) {
      return glm::dvec3(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
    };
    across[0] = cross(b, c);
    across[1] = cross(c, a);
    across[2] = cross(a, b);
    inverse = 1.0 / ((a.x * across[0].x + a.y * across[0].y) + a.z * across[0].z);
  }
};

/// What a gradient with respect to the undeformed place is with respect to the deformed place of its tetrahedron as a
/// whole: -(I + G)^T g, where G = du/dp; output index.
/// @param steepness  du along i, j, k
TETWARP_HD inline glm::vec3 pull_back(const glm::vec3 (&steepness)[3], const glm::vec3& g) {
  const auto dot = [](const glm::vec3& p, const glm::vec3& q) { return (p.x * q.x + p.y * q.y) + p.z * q.z; };
  return {-(g.x + dot(steepness[0], g)), -(g.y + dot(steepness[1], g)), -(g.z + dot(steepness[2], g))};
}

// Rarely called, so out of line, with everything by value.

/// Where a voxel of a thin tetrahedron of a coarse field comes from.
TETWARP_NOINLINE_HD inline FixedOffset thin_offset(Tetrahedron t, glm::ivec3 voxel, glm::i32vec3 signs) {
  return fixed_offset(thin_u(t, voxel, signs));
}
/// Where a voxel comes from for which float has too few digits.
TETWARP_NOINLINE_HD inline glm::vec3 exact_offset(Tetrahedron t, glm::i32vec3 steps, glm::i32vec3 signs) {
  return interpolate_u_exactly(t, steps, signs);
}
/// The weights of a voxel for which float has too few digits, or which is outside but for its nudge.
TETWARP_NOINLINE_HD inline ExactWeights exact_weights_of(Tetrahedron t, glm::ivec3 voxel, glm::i32vec3 signs) {
  return exact_weights(t, voxel * kStepsPerVoxel, signs);
}

/// Where the voxels of a tetrahedron come from, with the derivative of that: made once for all of them.
/// @tparam kCoarse  whether the field is coarse
template <bool kCoarse>
class PlaceMap {
 public:
  using Offset = std::conditional_t<kCoarse, FixedOffset, glm::vec3>;

  /// One that is not to be used.
  TETWARP_HD PlaceMap() : map_(Tetrahedron{}) {}
  TETWARP_HD explicit PlaceMap(const Tetrahedron& t) : map_(t) {
    if constexpr (kCoarse) {
      if (!map_.is_thin) {
        for (int along = 0; along < 3; ++along) steepness_[along] = glm::vec3(glm::dvec3(map_.slope[along]) * 0x1p-23);
        return;
      }
    }
    const TetrahedronEdges edges(t);
    const glm::dvec3 ua(t.a.u - t.d.u), ub(t.b.u - t.d.u), uc(t.c.u - t.d.u);
    for (int along = 0; along < 3; ++along) {
      steepness_[along] = glm::vec3(
          ((ua * edges.across[0][along] + ub * edges.across[1][along]) + uc * edges.across[2][along]) * edges.inverse);
    }
  }

  /// Undeformed minus deformed place of a voxel that the tetrahedron owns, as the forward pass has it.
  /// @param signs  directions in which it is nudged
  /// @param again  gives the tetrahedron, where its map is not enough
  template <class Again>
  TETWARP_HD Offset offset(const glm::i64vec3& voxel, const glm::i32vec3& signs, Again&& again) const {
    const glm::ivec3 at(voxel);
    if constexpr (kCoarse) {
      return map_.is_thin ? thin_offset(again(), at, signs) : fixed_offset(map_.u(at));
    } else {
      const glm::i32vec3 steps = at * kStepsPerVoxel;
      return map_.u(steps, [&] { return exact_offset(again(), steps, signs); });
    }
  }

  /// See `tetwarp::pull_back`.
  TETWARP_HD glm::vec3 pull_back(const glm::vec3& g) const { return tetwarp::pull_back(steepness_, g); }

 private:
  std::conditional_t<kCoarse, CoarseMap, TetrahedronMap> map_;
  glm::vec3 steepness_[3]{};  ///< du along i, j, k
};

/// Weights of the vertices of a tetrahedron at the voxels that it owns: affine maps, made in double and rounded to
/// float, about a voxel in the middle of the tetrahedron.
struct WeightMap {
  bool is_thin = true;   ///< whether float has too few digits for the maps; then `exact_weights` serves
  glm::ivec3 origin{0};  ///< the voxel nearest to its middle
  float at_origin[3]{};  ///< the weights of A, B and C there
  glm::vec3 slope[3]{};  ///< how each changes from voxel to voxel along i, j, k

  /// One that is not to be used.
  WeightMap() = default;
  TETWARP_HD explicit WeightMap(const Tetrahedron& t) {
    const glm::vec3 a = detail::to_voxels(t.a.deformed - t.d.deformed),
                    b = detail::to_voxels(t.b.deformed - t.d.deformed),
                    c = detail::to_voxels(t.c.deformed - t.d.deformed);
    is_thin = tetwarp::is_thin(Cramer(a, b, c), a, b, c);
    if (is_thin) return;
    const TetrahedronEdges edges(t);
    glm::dvec3 from;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t corners =
          std::int64_t{t.a.deformed[axis]} + t.b.deformed[axis] + t.c.deformed[axis] + t.d.deformed[axis];
      constexpr int kHalf = 1 << 13;
      origin[axis] = static_cast<int>((corners + kHalf) >> 14);  // four corners, 2^12 steps a voxel
      from[axis] = static_cast<double>(std::int64_t{origin[axis]} * kStepsPerVoxel - t.d.deformed[axis]);
    }
    for (int n = 0; n < 3; ++n) {
      const glm::dvec3& across = edges.across[n];
      at_origin[n] = static_cast<float>(((from.x * across.x + from.y * across.y) + from.z * across.z) * edges.inverse);
      slope[n] = glm::vec3(across * (edges.inverse * kStepsPerVoxel));
    }
  }

  /// Weights of A, B, C and D at the voxel; or at the nudged voxel, where one is below -kWeightSlack.
  /// @param signs  directions in which it is nudged
  /// @param again  gives the tetrahedron, where the maps are not enough
  template <class Again>
  TETWARP_HD void weights(const glm::i64vec3& voxel, const glm::i32vec3& signs, Again&& again,
                          float (&weight)[4]) const {
    constexpr float kLeast = -static_cast<float>(kWeightSlack);
    if (!is_thin) {
      const glm::vec3 from(glm::ivec3(voxel) - origin);
      for (int n = 0; n < 3; ++n)
        weight[n] = at_origin[n] + ((slope[n].x * from.x + slope[n].y * from.y) + slope[n].z * from.z);
      weight[3] = ((1 - weight[0]) - weight[1]) - weight[2];
      if (weight[0] >= kLeast && weight[1] >= kLeast && weight[2] >= kLeast && weight[3] >= kLeast) return;
    }
    const ExactWeights w = exact_weights_of(again(), glm::ivec3(voxel), signs);
    weight[0] = static_cast<float>(w.a);
    weight[1] = static_cast<float>(w.b);
    weight[2] = static_cast<float>(w.c);
    weight[3] = static_cast<float>(w.d());
  }
};

/// One volume of a call: what the transpose and the gradients read and write of it. The values of a voxel are side by
/// side.
template <class V>
struct AdjointPlan {
  SourceVoxels<V> source;   ///< its voxels are null where nothing asks for the displacement
  SourceRelation relation;  ///< how it lies relative to the output
  int components;           ///< values of a voxel
  Interpolation interpolation;
  const V* given;      ///< dL/d(output), i fastest
  std::int64_t* sums;  ///< dL/d(source) in quanta, i fastest; null: not wanted
};

/// A place in a source, and on which axes it was moved onto the outermost centres.
struct ClampedPlace {
  Place place;
  bool inside;
  bool clamped[3];
};

template <class V, class Offset>
TETWARP_HD ClampedPlace clamped_place(const AdjointPlan<V>& plan, const glm::i64vec3& voxel, const Offset& offset) {
  ClampedPlace found;
  found.place = plan.relation.same_grid ? place_at(voxel, offset)
                                        : place_at(plan.relation(glm::dvec3(voxel) + in_double(offset)));
  const Place before = found.place;
  found.inside = clamp_to_grid(found.place, plan.source.size);
  for (int axis = 0; axis < 3; ++axis) {
    found.clamped[axis] =
        before.base[axis] != found.place.base[axis] || before.fraction[axis] != found.place.fraction[axis];
  }
  return found;
}

/// Slope of the trilinear interpolant along an axis, per step of the grid, uneven slices being as far apart as they
/// are. Where the place is a centre on that axis it is the mean of the slopes to both sides, that beyond the outermost
/// centre being 0.
/// @param slices  where uneven slices lie; null: evenly
template <int kAxis, class V>
TETWARP_HD Working<V> slope_at(const SourceVoxels<V>& source, const double* slices, const Place& place) {
  using W = Working<V>;
  const auto on_axis = [&](int axis, auto&& value) -> W {
    const W t = static_cast<W>(place.fraction[axis]);
    if (axis != kAxis) return t == 0 ? value(0) : lerp(Lerp::separate, t, value(0), value(1));
    const auto per_step = [&](W difference, std::int64_t low) {
      if (kAxis != 2 || !slices) return difference;
      return difference / static_cast<W>(slices[low + 1] - slices[low]);
    };
    const std::int64_t base = place.base[axis];
    if (t != 0) return per_step(value(1) - value(0), base);
    const W here = value(0), high = base + 1 < source.size[axis] ? per_step(value(1) - here, base) : W(0),
            low = base > 0 ? per_step(here - value(-1), base - 1) : W(0);
    return W(0.5) * (high + low);
  };
  return on_axis(2, [&](int z) {
    return on_axis(1, [&](int y) {
      return on_axis(
          0, [&](int x) { return static_cast<W>(source.at(place.base.x + x, place.base.y + y, place.base.z + z)); });
    });
  });
}

/// Slopes of the trilinear interpolant along i, j and k, as `slope_at` has them.
template <class V>
TETWARP_HD void slopes_at(const SourceVoxels<V>& source, const double* slices, const Place& place,
                          Working<V> (&slope)[3]) {
  using W = Working<V>;
  const W t[3] = {static_cast<W>(place.fraction.x), static_cast<W>(place.fraction.y), static_cast<W>(place.fraction.z)};
  if (slices || t[0] == 0 || t[1] == 0 || t[2] == 0) {
    slope[0] = slope_at<0>(source, slices, place);
    slope[1] = slope_at<1>(source, slices, place);
    slope[2] = slope_at<2>(source, slices, place);
    return;
  }
  // Between centres on every axis eight voxels serve all three, by the same operations.
  W along[2], across[2], value[2];  // of the two slices: slopes along i and j, and the value
  for (int z = 0; z < 2; ++z) {
    W low[2], high[2], middle[2];
    for (int y = 0; y < 2; ++y) {
      low[y] = static_cast<W>(source.at(place.base.x, place.base.y + y, place.base.z + z));
      high[y] = static_cast<W>(source.at(place.base.x + 1, place.base.y + y, place.base.z + z));
      middle[y] = lerp(Lerp::separate, t[0], low[y], high[y]);
    }
    along[z] = lerp(Lerp::separate, t[1], high[0] - low[0], high[1] - low[1]);
    across[z] = middle[1] - middle[0];
    value[z] = lerp(Lerp::separate, t[1], middle[0], middle[1]);
  }
  slope[0] = lerp(Lerp::separate, t[2], along[0], along[1]);
  slope[1] = lerp(Lerp::separate, t[2], across[0], across[1]);
  slope[2] = value[1] - value[0];
}

/// Adds the gradient of a volume's values at an output voxel with respect to its undeformed place, output index.
/// @param n  the voxel, i fastest
template <class V>
TETWARP_HD void add_place_gradient(const AdjointPlan<V>& plan, std::int64_t n, const ClampedPlace& at,
                                   glm::dvec3& sum) {
  using W = Working<V>;
  W along[3] = {};
  SourceVoxels<V> source = plan.source;
  for (int c = 0; c < plan.components; ++c, ++source.voxels) {
    const W given = static_cast<W>(plan.given[n * plan.components + c]);
    W slope[3];
    slopes_at(source, plan.relation.slices.at, at.place, slope);
    for (int axis = 0; axis < 3; ++axis)
      if (!at.clamped[axis]) along[axis] += given * slope[axis];
  }
  glm::dvec3 g(along[0], along[1], along[2]);
  if (!plan.relation.same_grid) {
    const glm::dmat3& m = plan.relation.source_from_output.linear;
    g = {(m[0].x * g.x + m[0].y * g.y) + m[0].z * g.z, (m[1].x * g.x + m[1].y * g.y) + m[1].z * g.z,
         (m[2].x * g.x + m[2].y * g.y) + m[2].z * g.z};
  }
  sum += g;
}

/// Calls `visit(voxel of the source, weight)` for what a value at a place is made of.
template <class V, class Visit>
TETWARP_HD void for_each_weight(Interpolation interpolation, const glm::i64vec3& size, const Place& place,
                                Visit&& visit) {
  using W = Working<V>;
  const glm::vec3& t = place.fraction;
  if (interpolation == Interpolation::nearest) {
    visit(place.base + glm::i64vec3(t.x >= 0.5f, t.y >= 0.5f, t.z >= 0.5f), W(1));
  } else if (interpolation == Interpolation::cubic) {
    const CubicTaps<W> x = cubic_taps<W>(t.x), y = cubic_taps<W>(t.y), z = cubic_taps<W>(t.z);
    for (int k = z.first; k <= z.last; ++k) {
      for (int j = y.first; j <= y.last; ++j) {
        for (int i = x.first; i <= x.last; ++i) {
          visit(glm::i64vec3(clamp_index(place.base.x + i, size.x), clamp_index(place.base.y + j, size.y),
                             clamp_index(place.base.z + k, size.z)),
                (x.weight[i + 1] * y.weight[j + 1]) * z.weight[k + 1]);
        }
      }
    }
  } else {
    const W x[2] = {W(1) - static_cast<W>(t.x), static_cast<W>(t.x)},
            y[2] = {W(1) - static_cast<W>(t.y), static_cast<W>(t.y)},
            z[2] = {W(1) - static_cast<W>(t.z), static_cast<W>(t.z)};
    for (int k = 0; k <= (t.z != 0); ++k) {
      for (int j = 0; j <= (t.y != 0); ++j) {
        for (int i = 0; i <= (t.x != 0); ++i) visit(place.base + glm::i64vec3(i, j, k), (x[i] * y[j]) * z[k]);
      }
    }
  }
}

/// The largest finite value of an output voxel's dL/d(output), in size.
/// @param n  the output voxel, i fastest
template <class V>
TETWARP_HD double largest_given(const AdjointPlan<V>& plan, std::int64_t n) {
  double largest = 0;
  for (int c = 0; c < plan.components; ++c) {
    const double size = std::fabs(static_cast<double>(plan.given[n * plan.components + c]));
    if (size - size == 0 && size > largest) largest = size;
  }
  return largest;
}

/// Gives each voxel of the source its part of dL/d(output) of an output voxel.
/// @param n    the output voxel, i fastest
/// @param add  `add(sum, steps)` adds to a sum
/// @return whether all parts were finite; others are not added
template <class V, class Offset, class Add>
TETWARP_HD bool add_to_source(const AdjointPlan<V>& plan, std::int64_t n, const glm::i64vec3& output_voxel,
                              const Offset& offset, const Quantum& quantum, Add&& add) {
  const ClampedPlace from = clamped_place(plan, output_voxel, offset);
  if (!from.inside) return true;
  bool all_finite = true;
  const glm::i64vec3& size = plan.source.size;
  for_each_weight<V>(plan.interpolation, size, from.place, [&](const glm::i64vec3& voxel, Working<V> weight) {
    const std::int64_t at = ((voxel.z * size.y + voxel.y) * size.x + voxel.x) * plan.components;
    for (int c = 0; c < plan.components; ++c) {
      const double part = static_cast<double>(weight * static_cast<Working<V>>(plan.given[n * plan.components + c]));
      if (part - part != 0) {  // infinite, or no number
        all_finite = false;
      } else {
        add(plan.sums[at + c], quantum.steps(part));
      }
    }
  });
  return all_finite;
}

/// The volumes of a call.
template <class V>
struct AdjointPlans {
  const AdjointPlan<V>* plans;
  int count;

  /// The gradient with respect to the undeformed place of a voxel, of all volumes; output index.
  /// @param n  the voxel, i fastest
  template <class Offset>
  TETWARP_HD glm::vec3 of_place(std::int64_t n, const glm::i64vec3& voxel, const Offset& offset) const {
    glm::dvec3 g(0);
    for (int p = 0; p < count; ++p) {
      const ClampedPlace at = clamped_place(plans[p], voxel, offset);
      if (at.inside) add_place_gradient(plans[p], n, at, g);
    }
    return glm::vec3(g);
  }
};

/// A gradient per mm, of one per voxel of output index.
TETWARP_HD inline glm::vec3 per_mm(const glm::dmat3& output_from_mm, const glm::dvec3& g) {
  const glm::dmat3& m = output_from_mm;
  return {static_cast<float>((m[0].x * g.x + m[0].y * g.y) + m[0].z * g.z),
          static_cast<float>((m[1].x * g.x + m[1].y * g.y) + m[1].z * g.z),
          static_cast<float>((m[2].x * g.x + m[2].y * g.y) + m[2].z * g.z)};
}

}  // namespace tetwarp
