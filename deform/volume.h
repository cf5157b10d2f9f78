// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "deform/errors.h"
#include "deform/geometry.h"

namespace tetwarp {

enum class VoxelType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };
/// Where a view's values lie. `device` is memory of the CUDA device that the resampler was made for.
enum class Memory : std::uint8_t { host, device };

std::size_t size_bytes(VoxelType type);
/// "int16", "float32" and so on.
std::string to_string(VoxelType type);
/// The VoxelType of a C++ type.
template <class V>
constexpr VoxelType voxel_type_of() {
  if constexpr (std::is_same_v<V, std::uint8_t>)
    return VoxelType::u8;
  else if constexpr (std::is_same_v<V, std::int8_t>)
    return VoxelType::i8;
  else if constexpr (std::is_same_v<V, std::uint16_t>)
    return VoxelType::u16;
  else if constexpr (std::is_same_v<V, std::int16_t>)
    return VoxelType::i16;
  else if constexpr (std::is_same_v<V, std::uint32_t>)
    return VoxelType::u32;
  else if constexpr (std::is_same_v<V, std::int32_t>)
    return VoxelType::i32;
  else if constexpr (std::is_same_v<V, float>)
    return VoxelType::f32;
  else {
    static_assert(std::is_same_v<V, double>, "not a voxel type");
    return VoxelType::f64;
  }
}

/// Calls `f(V{})` with the C++ type of `type` and returns its result.
template <class F>
decltype(auto) dispatch(VoxelType type, F&& f) {
  switch (type) {
    case VoxelType::u8: return f(std::uint8_t{});
    case VoxelType::i8: return f(std::int8_t{});
    case VoxelType::u16: return f(std::uint16_t{});
    case VoxelType::i16: return f(std::int16_t{});
    case VoxelType::u32: return f(std::uint32_t{});
    case VoxelType::i32: return f(std::int32_t{});
    case VoxelType::f32: return f(float{});
    case VoxelType::f64: return f(double{});
  }
  throw InputError("unknown voxel type " + std::to_string(static_cast<int>(type)));
}

/// Not an owner, and trivially copyable: the voxels of `buffered`, a box of `geometry`, i fastest.
/// Byte is std::byte or const std::byte. Slabs and ITK regions are views whose `buffered` is a part of the grid.
template <class Byte>
struct BasicView {
  const Geometry* geometry = nullptr;
  Region buffered;
  VoxelType type = VoxelType::i16;
  int components = 1;      ///< values a voxel, side by side
  Byte* voxels = nullptr;  ///< null: no volume
  Memory memory = Memory::host;

  template <class Other>
  requires(std::is_same_v<Other, const Byte> && !std::is_same_v<Other, Byte>) operator BasicView<Other>() const {
    return {geometry, buffered, type, components, voxels, memory};
  }
};
using VolumeView = BasicView<std::byte>;
using ConstVolumeView = BasicView<const std::byte>;

/// Owner of a whole volume, i fastest.
template <class V>
struct Volume {
  Geometry geometry;
  std::vector<V> voxels;
};

template <class V>
VolumeView view(Volume<V>& volume) {
  return {&volume.geometry,
          whole(volume.geometry),
          voxel_type_of<V>(),
          1,
          std::as_writable_bytes(std::span(volume.voxels)).data(),
          Memory::host};
}
template <class V>
ConstVolumeView view(const Volume<V>& volume) {
  return {
      &volume.geometry, whole(volume.geometry), voxel_type_of<V>(), 1, std::as_bytes(std::span(volume.voxels)).data(),
      Memory::host};
}

/// Owner of a whole volume whose voxel type is known at run time only: what a file holds.
/// Bytes are left uninitialised when it is made, so that a large output costs no pass over memory.
class AnyVolume {
 public:
  AnyVolume() = default;
  AnyVolume(Geometry geometry, VoxelType type, int components = 1);
  /// Takes the voxels over.
  template <class V>
  explicit AnyVolume(Volume<V>&& volume) : geometry_(volume.geometry), type_(voxel_type_of<V>()) {
    auto owner = std::make_shared<std::vector<V>>(std::move(volume.voxels));
    voxels_ = std::shared_ptr<std::byte>(owner, reinterpret_cast<std::byte*>(owner->data()));
  }
  AnyVolume(AnyVolume&&) noexcept = default;
  AnyVolume& operator=(AnyVolume&&) noexcept = default;

  const Geometry& geometry() const { return geometry_; }
  void set_geometry(const Geometry& geometry);  ///< same size as before, other place. @throws InputError
  VoxelType type() const { return type_; }
  int components() const { return components_; }
  std::size_t size_bytes() const;
  std::byte* data() { return voxels_.get(); }
  const std::byte* data() const { return voxels_.get(); }
  VolumeView view();
  ConstVolumeView view() const;
  /// Gives the voxels back; what it was a volume of stays known.
  void release() { voxels_.reset(); }
  /// The voxels as V. @throws InputError if V is not the type held
  template <class V>
  std::span<V> as() {
    check(voxel_type_of<V>());
    return {reinterpret_cast<V*>(data()), size_bytes() / sizeof(V)};
  }
  template <class V>
  std::span<const V> as() const {
    check(voxel_type_of<V>());
    return {reinterpret_cast<const V*>(data()), size_bytes() / sizeof(V)};
  }

 private:
  void check(VoxelType wanted) const;

  Geometry geometry_;
  VoxelType type_ = VoxelType::i16;
  int components_ = 1;
  std::shared_ptr<std::byte> voxels_;  // of this volume alone: the type lets it own a buffer or a vector
};

}  // namespace tetwarp
