// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/patient.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <glm/common.hpp>

#include <tbb/parallel_for.h>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

constexpr double kPaddingHu = -1024;
constexpr double kSameGridMm = 1e-3;

/// Voxels along an axis, from `begin` up to but not including `end`.
struct Extent {
  std::int64_t begin = 0, end = 0;
};
/// For each axis, the voxels that belong to each box.
using Boxes = std::array<std::vector<Extent>, 3>;

Boxes boxes_of_cells(const glm::i64vec3& voxels, const Geometry& lattice, std::int64_t cell_size) {
  Boxes boxes;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t cells = lattice.size[axis] - 1;
    for (std::int64_t c = 0; c < cells; ++c) {
      boxes[static_cast<std::size_t>(axis)].push_back(
          {c * cell_size, c + 1 == cells ? voxels[axis] : (c + 1) * cell_size});
    }
  }
  return boxes;
}

Boxes boxes_of_vertices(const glm::i64vec3& voxels, const Geometry& lattice, std::int64_t cell_size) {
  Boxes boxes;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::int64_t v = 0; v < lattice.size[axis]; ++v) {
      const std::int64_t begin = std::clamp(v * cell_size - cell_size / 2, std::int64_t{0}, voxels[axis] - 1);
      const std::int64_t end = std::clamp(v * cell_size + (cell_size + 1) / 2, begin + 1, voxels[axis]);
      boxes[static_cast<std::size_t>(axis)].push_back({begin, end});
    }
  }
  return boxes;
}

/// Calls, for each box, i fastest, `visit(box, row)` for each of its rows of voxels, then `finish(number)`. Each layer
/// of boxes along k gets a visitor of its own from `make_visitor`, and several layers run at a time.
template <class V, class MakeVisitor>
void for_each_box(std::span<const V> values, const glm::i64vec3& size, const Boxes& boxes, const Control& control,
                  const MakeVisitor& make_visitor) {
  const std::vector<Extent>&along_i = boxes[0], &along_j = boxes[1], &along_k = boxes[2];
  tbb::parallel_for(std::size_t{0}, along_k.size(), [&](std::size_t k) {
    if (control.stop.stop_requested()) return;
    auto visitor = make_visitor();
    std::size_t number = k * along_i.size() * along_j.size();
    for (const Extent& rows : along_j) {
      for (const Extent& row : along_i) {
        for (std::int64_t z = along_k[k].begin; z < along_k[k].end; ++z) {
          for (std::int64_t y = rows.begin; y < rows.end; ++y) {
            const auto first = static_cast<std::size_t>(row.begin + size.x * (y + size.y * z));
            visitor.add(values.subspan(first, static_cast<std::size_t>(row.end - row.begin)));
          }
        }
        visitor.finish(number++);
      }
    }
  });
  if (control.stop.stop_requested()) throw Cancelled();
}

template <class V>
struct MeanVisitor {
  std::vector<float>& result;
  double sum = 0;
  std::size_t count = 0;

  void add(std::span<const V> row) {
    for (const V value : row) {
      const auto hu = static_cast<double>(value);
      sum += hu > kPaddingHu ? hu : kPaddingHu;  // NaN counts as padding, too
    }
    count += row.size();
  }
  void finish(std::size_t number) {
    result[number] = static_cast<float>(sum / static_cast<double>(count));
    sum = 0;
    count = 0;
  }
};

template <class V>
struct LabelVisitor {
  std::vector<std::int64_t>& result;
  std::vector<std::int64_t> found = {};

  void add(std::span<const V> row) {
    for (const V value : row) found.push_back(static_cast<std::int64_t>(value));
  }
  void finish(std::size_t number) {
    std::sort(found.begin(), found.end());
    std::size_t most = 0;
    for (auto begin = found.begin(); begin != found.end();) {
      const auto end = std::upper_bound(begin, found.end(), *begin);
      if (const auto count = static_cast<std::size_t>(end - begin); count > most) {
        most = count;
        result[number] = *begin;
      }
      begin = end;
    }
    found.clear();
  }
};

template <class V>
std::span<const V> voxels_of(const ConstVolumeView& volume) {
  return {reinterpret_cast<const V*>(volume.voxels), static_cast<std::size_t>(voxel_count(*volume.geometry))};
}

std::size_t count_of(const Boxes& boxes) { return boxes[0].size() * boxes[1].size() * boxes[2].size(); }

std::vector<float> means(const ConstVolumeView& ct, const Boxes& boxes, const Control& control) {
  std::vector<float> result(count_of(boxes));
  dispatch(ct.type, [&](auto voxel) {
    using V = decltype(voxel);
    for_each_box(voxels_of<V>(ct), ct.geometry->size, boxes, control, [&] { return MeanVisitor<V>{result}; });
  });
  return result;
}

std::vector<std::int64_t> most_frequent(const ConstVolumeView& labels, const Boxes& boxes, const Control& control) {
  std::vector<std::int64_t> result(count_of(boxes));
  dispatch(labels.type, [&](auto voxel) {
    using V = decltype(voxel);
    for_each_box(voxels_of<V>(labels), labels.geometry->size, boxes, control, [&] { return LabelVisitor<V>{result}; });
  });
  return result;
}

void require_whole_numbers(const ConstVolumeView& labels) {
  constexpr double kLargest = 9007199254740992;  // 2^53: beyond it not every whole number is a double
  dispatch(labels.type, [&](auto voxel) {
    using V = decltype(voxel);
    if constexpr (std::is_floating_point_v<V>) {
      for (const V value : voxels_of<V>(labels)) {
        const auto label = static_cast<double>(value);
        if (!(std::abs(label) <= kLargest && std::floor(label) == label))
          throw InputError("a label is " + std::to_string(label) +
                           "; labels are whole numbers, resample them by nearest neighbour or vote");
      }
    }
  });
}

/// Marks the cells of the largest set that is connected by faces. @param candidate  1 for cells that may belong to a
/// set
std::vector<std::uint8_t> largest_part(std::vector<std::uint8_t> candidate, const glm::i64vec3& cells) {
  std::vector<std::size_t> part, largest;
  const std::int64_t steps[3] = {1, cells.x, cells.x * cells.y};
  for (std::size_t first = 0; first < candidate.size(); ++first) {
    if (!candidate[first]) continue;
    part.assign(1, first);
    candidate[first] = 0;
    for (std::size_t n = 0; n < part.size(); ++n) {
      const auto cell = static_cast<std::int64_t>(part[n]);
      const glm::i64vec3 at(cell % cells.x, cell / cells.x % cells.y, cell / steps[2]);
      for (int axis = 0; axis < 3; ++axis) {
        for (const int way : {-1, 1}) {
          const std::int64_t there = at[axis] + way;
          const auto other = static_cast<std::size_t>(cell + way * steps[axis]);
          if (there < 0 || there >= cells[axis] || !candidate[other]) continue;
          candidate[other] = 0;
          part.push_back(other);
        }
      }
    }
    if (part.size() > largest.size()) largest.swap(part);
  }
  for (const std::size_t cell : largest) candidate[cell] = 1;
  return candidate;
}

std::optional<BodyBox> box_of(const std::vector<std::uint8_t>& body, const Geometry& lattice, const Geometry& volume,
                              std::int64_t cell_size) {
  const glm::i64vec3 cells = lattice.size - std::int64_t{1};
  const AffineMap point = point_from_index(volume);
  std::optional<BodyBox> box;
  for (std::size_t n = 0; n < body.size(); ++n) {
    if (!body[n]) continue;
    const auto cell = static_cast<std::int64_t>(n);
    const glm::i64vec3 at(cell % cells.x, cell / cells.x % cells.y, cell / (cells.x * cells.y));
    for (int corner = 0; corner < 8; ++corner) {
      const glm::i64vec3 steps(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::dvec3 x = point(glm::dvec3(glm::min((at + steps) * cell_size, volume.size - std::int64_t{1})));
      if (!box) box = BodyBox{x, x};
      box->low = glm::min(box->low, x);
      box->high = glm::max(box->high, x);
    }
  }
  return box;
}

}  // namespace

Patient examine(const ConstVolumeView& ct, const ConstVolumeView* labels, std::int64_t cell_size, double body_above_hu,
                const Control& control) {
  require(ct.components == 1, std::to_string(ct.components) + " components a voxel; expected a volume with one");
  const Geometry& volume = *ct.geometry;
  require(!is_sheared(volume) && volume.slices.empty(),
          "the volume's slices lean (gantry tilt) or lie at uneven distances; simulations need a straight one: make it "
          "with `tetwarp deform INPUT -f identity`");
  Patient patient;
  patient.lattice = lattice_over(volume, cell_size);
  const Boxes cells = boxes_of_cells(volume.size, patient.lattice, cell_size),
              vertices = boxes_of_vertices(volume.size, patient.lattice, cell_size);
  patient.cell_hu = means(ct, cells, control);
  patient.vertex_hu = means(ct, vertices, control);
  if (labels != nullptr) {
    require(labels->components == 1, "labels of " + std::to_string(labels->components) + " values a voxel; expected 1");
    const bool same_size = labels->geometry->size == volume.size;
    require(same_grid(*labels->geometry, volume, kSameGridMm),
            "the labels have a grid of " + to_string(labels->geometry->size) + " voxels, the volume one of " +
                (same_size ? "as many at another place" : to_string(volume.size)) +
                "; labels are expected on the grid of the volume, voxel by voxel");
    require_whole_numbers(*labels);
    patient.cell_label = most_frequent(*labels, cells, control);
    patient.vertex_label = most_frequent(*labels, vertices, control);
  }
  std::vector<std::uint8_t> dense(patient.cell_hu.size());
  std::transform(patient.cell_hu.begin(), patient.cell_hu.end(), dense.begin(),
                 [&](float hu) { return static_cast<std::uint8_t>(static_cast<double>(hu) > body_above_hu); });
  patient.body = largest_part(std::move(dense), patient.lattice.size - std::int64_t{1});
  patient.box = box_of(patient.body, patient.lattice, volume, cell_size);
  return patient;
}

}  // namespace tetwarp::simulate
