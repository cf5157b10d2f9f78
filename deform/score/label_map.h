// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/errors.h"
#include "deform/volume.h"

namespace tetwarp::score {

/// @throws InputError unless a view is a whole volume of whole numbers in host memory
inline void require_label_map(const ConstVolumeView& map) {
  require(map.voxels && map.memory == Memory::host && map.components == 1 && map.type != VoxelType::f32 &&
              map.type != VoxelType::f64 && map.buffered == whole(*map.geometry),
          "label maps have to be whole volumes of whole numbers in host memory");
}

/// @throws InputError unless two views are label maps of one size
inline void require_label_maps(const ConstVolumeView& first, const ConstVolumeView& second) {
  require_label_map(first);
  require_label_map(second);
  require(first.geometry->size == second.geometry->size, "label maps of " + tetwarp::to_string(first.geometry->size) +
                                                             " and " + tetwarp::to_string(second.geometry->size) +
                                                             " voxels cannot be compared");
}

/// The label of a voxel. @param voxel  its number, i fastest
inline std::int64_t label_at(const ConstVolumeView& labels, std::int64_t voxel) {
  return dispatch(labels.type, [&]<class V>(V) {
    return static_cast<std::int64_t>(reinterpret_cast<const V*>(labels.voxels)[voxel]);
  });
}

}  // namespace tetwarp::score
