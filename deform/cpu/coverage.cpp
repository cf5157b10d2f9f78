// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/coverage.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "deform/core/border.h"
#include "deform/core/gather.h"

namespace tetwarp::cpu {

namespace {

/// Calls `visit(y, z, first, change)` for each row of voxels that passes through a triangle of the border.
template <class Int, class Visit>
void cross_rows(const BorderTriangle& t, const Nudge& nudge, const IntBox& rows, Visit&& visit) {
  for (int z = rows.begin.z; z < rows.end.z; ++z) {
    for (int y = rows.begin.y; y < rows.end.y; ++y) {
      int first = 0;
      const int change = cross_border<Int>(t, nudge, y, z, rows.begin.x, rows.end.x, first);
      if (change != 0 && first < rows.end.x) visit(y, z, first, change);
    }
  }
}

/// The vertices of a row of faces, snapped once, as `border_triangle` reads them.
class RowOfFaces {
 public:
  glm::ivec3 cells;

  RowOfFaces(const LatticeIndex& index, int axis, bool high, int last)
      : cells(index.steps().cells), next_((axis + 1) % 3), after_((axis + 2) % 3), last_(last) {
    glm::i64vec3 at(0);
    at[axis] = high ? cells[axis] : 0;
    for (int side = 0; side < 2; ++side) {
      at[after_] = last + side;
      for (at[next_] = 0; at[next_] <= cells[next_]; ++at[next_]) vertices_[side].push_back(index.vertex(at));
    }
  }

  /// The box around the corners of face n of the row.
  Box box(std::size_t n) const {
    Box box{vertices_[0][n].deformed, vertices_[0][n].deformed};
    box.grow(vertices_[0][n + 1].deformed);
    box.grow(vertices_[1][n].deformed);
    box.grow(vertices_[1][n + 1].deformed);
    return box;
  }
  const Vertex& vertex(const glm::ivec3& at) const {
    return vertices_[at[after_] - last_][static_cast<std::size_t>(at[next_])];
  }

 private:
  int next_, after_, last_;
  std::vector<Vertex> vertices_[2];
};

}  // namespace

void Coverage::find(const LatticeIndex& index, const Geometry& output) {
  index_ = &index;
  size_ = output.size;
  const glm::ivec3 cells = index.steps().cells;
  struct Strip {
    int axis, last;
    bool high;
  };
  std::vector<Strip> strips;  // each a row of faces
  for (int side = 0; side < 6; ++side) {
    for (int n = 0; n < cells[(side / 2 + 2) % 3]; ++n) strips.push_back({side / 2, n, side % 2 == 1});
  }
  tbb::enumerable_thread_specific<std::vector<CrossingInRow>> found;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strips.size()), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n)
      look_at_row(strips[n].axis, strips[n].high, strips[n].last, found.local());
  });
  std::vector<const std::vector<CrossingInRow>*> parts;
  for (const std::vector<CrossingInRow>& part : found) parts.push_back(&part);
  sort_into_rows(parts);
}

/// Looks at a row of faces of one side of the lattice. @param last  place of the row on the second axis after `axis`
void Coverage::look_at_row(int axis, bool high, int last, std::vector<CrossingInRow>& found) const {
  const RowOfFaces lattice(*index_, axis, high, last);
  const Nudge& nudge = index_->frame().nudge;
  const NudgeTurns turns(nudge);
  const auto rows_through = [&](const Box& around) {
    IntBox rows{glm::ivec3(0), glm::ivec3(size_)};
    for (int i = 1; i < 3; ++i) cut_to_candidates(turns, i, around.low[i], around.high[i], rows.begin[i], rows.end[i]);
    return rows;
  };
  const auto visit = [&](int y, int z, int first, int change) {
    found.push_back({std::int64_t{z} * size_.y + y, {first, change}});
  };
  const auto look_at = [&](const BorderTriangle& t) {
    Box around{t.a, t.a};
    around.grow(t.b);
    around.grow(t.c);
    const IntBox rows = rows_through(around);
    if (rows.is_empty()) return;
    if (fits_double(around)) {
      cross_rows<double>(t, nudge, rows, visit);
    } else if (fits_int64(around)) {
      cross_rows<std::int64_t>(t, nudge, rows, visit);
    } else {
      cross_rows<Wide>(t, nudge, rows, visit);
    }
  };
  for (int n = 0; n < lattice.cells[(axis + 1) % 3]; ++n) {
    // No row passes through most faces that lie along the rows of voxels.
    if (rows_through(lattice.box(static_cast<std::size_t>(n))).is_empty()) continue;
    for (int which = 0; which < 2; ++which) look_at(border_triangle(lattice, axis, high, {n, last}, which));
  }
}

void Coverage::sort_into_rows(const std::vector<const std::vector<CrossingInRow>*>& found) {
  const std::int64_t rows = size_.y * size_.z;
  first_.assign(static_cast<std::size_t>(rows) + 1, 0);
  for (const auto* part : found) {
    for (const CrossingInRow& crossing : *part) ++first_[static_cast<std::size_t>(crossing.row)];
  }
  std::int64_t count = 0;
  for (std::int64_t& first : first_) first = count += first;  // where the crossings of the next row begin
  crossings_.resize(static_cast<std::size_t>(count));
  for (const auto* part : found) {
    for (const CrossingInRow& crossing : *part)
      crossings_[static_cast<std::size_t>(--first_[static_cast<std::size_t>(crossing.row)])] = crossing.crossing;
  }
  tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t row) {
    const auto at = crossings_.begin();
    std::sort(at + first_[static_cast<std::size_t>(row)], at + first_[static_cast<std::size_t>(row) + 1],
              [](const Crossing& a, const Crossing& b) { return a.voxel < b.voxel; });
  });
}

std::int64_t Coverage::owners_of(const Region& box, Owners* owners, LatticeBlock& block) const {
  std::int64_t several = 0;
  Owners* out = owners;
  for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
      const auto row = static_cast<std::size_t>(z * size_.y + y);
      int winding = 0;
      std::int64_t x = box.begin.x;
      const auto fill_to = [&](std::int64_t end) {
        if (end <= x) return;
        const Owners value = winding == 0 ? Owners::none : (winding == 1 ? Owners::one : Owners::several);
        out = std::fill_n(out, end - x, value);
        if (value == Owners::several) several += end - x;
        x = end;
      };
      for (std::int64_t n = first_[row]; n < first_[row + 1]; ++n) {
        const Crossing& crossing = crossings_[static_cast<std::size_t>(n)];
        fill_to(std::min<std::int64_t>(crossing.voxel, box.end.x));
        winding += crossing.change;
      }
      fill_to(box.end.x);
    }
  }
  return several + add_inverted(box, owners, block);
}

/// Marks the voxels that inverted tetrahedra may own as having several owners. @return how many were not marked before
std::int64_t Coverage::add_inverted(const Region& box, Owners* owners, LatticeBlock& block) const {
  if (index_->statistics().inverted == 0) return 0;
  const NudgeTurns turns(index_->frame().nudge);
  const IntBox region{glm::ivec3(box.begin), glm::ivec3(box.end)};
  const glm::ivec3 size = region.end - region.begin;
  std::int64_t added = 0;
  index_->find_blocks(box, [&](std::size_t number) {
    if (!index_->has_inverted(number)) return;
    index_->load(number, block);
    for_each_inverted(block, [&](const Tetrahedron& t) {
      const Box around = box_of(t);
      const IntBox voxels = candidates(turns, around.low, around.high, region);
      for (int z = voxels.begin.z; z < voxels.end.z; ++z) {
        for (int y = voxels.begin.y; y < voxels.end.y; ++y) {
          for (int x = voxels.begin.x; x < voxels.end.x; ++x) {
            Owners& of = owners[((z - region.begin.z) * size.y + (y - region.begin.y)) * size.x + (x - region.begin.x)];
            added += of != Owners::several;
            of = Owners::several;
          }
        }
      }
    });
  });
  return added;
}

}  // namespace tetwarp::cpu
