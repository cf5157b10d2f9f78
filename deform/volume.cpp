// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/volume.h"

namespace tetwarp {

std::size_t size_bytes(VoxelType type) {
  return dispatch(type, [](auto voxel) { return sizeof(voxel); });
}

std::string to_string(VoxelType type) {
  constexpr const char* kNames[] = {"uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"};
  return kNames[static_cast<int>(type)];
}

AnyVolume::AnyVolume(Geometry geometry, VoxelType type, int components)
    : geometry_(geometry), type_(type), components_(components) {
  voxels_ = std::shared_ptr<std::byte>(new std::byte[size_bytes()], std::default_delete<std::byte[]>());
}

void AnyVolume::set_geometry(const Geometry& geometry) {
  require(geometry.size == geometry_.size,
          "a volume of " + to_string(geometry_.size) + " voxels cannot take a grid of " + to_string(geometry.size));
  geometry_ = geometry;
}

std::size_t AnyVolume::size_bytes() const {
  return static_cast<std::size_t>(voxel_count(geometry_)) * static_cast<std::size_t>(components_) *
         tetwarp::size_bytes(type_);
}

VolumeView AnyVolume::view() { return {&geometry_, whole(geometry_), type_, components_, data()}; }

ConstVolumeView AnyVolume::view() const { return {&geometry_, whole(geometry_), type_, components_, data()}; }

void AnyVolume::check(VoxelType wanted) const {
  require(wanted == type_, [&] { return "the volume holds " + to_string(type_) + ", not " + to_string(wanted); });
}

}  // namespace tetwarp
