// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/overlap.h"

#include "deform/score/label_map.h"

namespace tetwarp::score {

std::map<std::int64_t, Overlap> compare_labels(const ConstVolumeView& first, const ConstVolumeView& second) {
  require_label_maps(first, second);
  const auto count = static_cast<std::size_t>(voxel_count(*first.geometry));
  std::map<std::int64_t, Overlap> overlaps;
  dispatch(first.type, [&]<class A>(A) {
    dispatch(second.type, [&]<class B>(B) {
      const A* a = reinterpret_cast<const A*>(first.voxels);
      const B* b = reinterpret_cast<const B*>(second.voxels);
      for (std::size_t n = 0; n < count; ++n) {
        const auto left = static_cast<std::int64_t>(a[n]), right = static_cast<std::int64_t>(b[n]);
        if (left == 0 && right == 0) continue;
        if (left != 0) ++overlaps[left].first;
        if (right != 0) ++overlaps[right].second;
        if (left == right) ++overlaps[left].both;
      }
    });
  });
  return overlaps;
}

}  // namespace tetwarp::score
