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

/// Type of one value of a voxel.
enum class VoxelType : std::uint8_t {
  u8,   ///< unsigned integer of 8 bits
  i8,   ///< signed integer of 8 bits
  u16,  ///< unsigned integer of 16 bits
  i16,  ///< signed integer of 16 bits, which CT in HU has
  u32,  ///< unsigned integer of 32 bits
  i32,  ///< signed integer of 32 bits
  f32,  ///< float
  f64   ///< double
};
/// Where the values of a view lie.
enum class Memory : std::uint8_t {
  host,   ///< memory of the CPU
  device  ///< memory of the device for which the resampler was made
};

/// Bytes of one value of a type.
std::size_t size_bytes(VoxelType type);
/// Name of a type, as NumPy has it: "int16", "float32".
std::string to_string(VoxelType type);
/// The VoxelType of the C++ type V.
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

/// Calls `f(V{})`, where V is the C++ type of `type`, and returns its result.
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

/// Voxels that something else owns: those of the box `buffered` of a grid, i fastest. A view is trivially copyable.
///
/// `Byte` is std::byte or const std::byte. Slabs and regions of ITK are views that buffer a part of the grid.
template <class Byte>
struct BasicView {
  const Geometry* geometry = nullptr;  ///< the whole grid
  Region buffered;                     ///< the part of the grid whose voxels are here
  VoxelType type = VoxelType::i16;     ///< type of one value
  int components = 1;                  ///< values of a voxel, side by side
  Byte* voxels = nullptr;              ///< first value; null: there is no volume
  Memory memory = Memory::host;        ///< where the voxels lie

  /// A view for writing converts to one for reading.
  template <class Other>
  requires(std::is_same_v<Other, const Byte> && !std::is_same_v<Other, Byte>) operator BasicView<Other>() const {
    return {geometry, buffered, type, components, voxels, memory};
  }
};
/// View of voxels that may be written.
using VolumeView = BasicView<std::byte>;
/// View of voxels that may only be read.
using ConstVolumeView = BasicView<const std::byte>;

/// Owner of a whole volume of one value a voxel.
template <class V>
struct Volume {
  Geometry geometry;      ///< grid of the voxels
  std::vector<V> voxels;  ///< values, i fastest
};

/// A view for writing of a whole volume.
template <class V>
VolumeView view(Volume<V>& volume) {
  return {&volume.geometry,
          whole(volume.geometry),
          voxel_type_of<V>(),
          1,
          std::as_writable_bytes(std::span(volume.voxels)).data(),
          Memory::host};
}
/// A view for reading of a whole volume.
template <class V>
ConstVolumeView view(const Volume<V>& volume) {
  return {
      &volume.geometry, whole(volume.geometry), voxel_type_of<V>(), 1, std::as_bytes(std::span(volume.voxels)).data(),
      Memory::host};
}

/// Owner of a whole volume whose voxel type is known at run time only, such as what a file holds.
/// Its bytes are uninitialised at first, so that a large output costs no pass over memory.
class AnyVolume {
 public:
  /// A volume without voxels.
  AnyVolume() = default;
  /// A volume of `components` values a voxel, uninitialised.
  AnyVolume(Geometry geometry, VoxelType type, int components = 1);
  /// Takes over the voxels of a volume.
  template <class V>
  explicit AnyVolume(Volume<V>&& volume) : geometry_(volume.geometry), type_(voxel_type_of<V>()) {
    auto owner = std::make_shared<std::vector<V>>(std::move(volume.voxels));
    voxels_ = std::shared_ptr<std::byte>(owner, reinterpret_cast<std::byte*>(owner->data()));
  }
  /// Takes over the voxels of another volume.
  AnyVolume(AnyVolume&&) noexcept = default;
  /// Takes over the voxels of another volume.
  AnyVolume& operator=(AnyVolume&&) noexcept = default;

  /// Grid of the voxels.
  const Geometry& geometry() const { return geometry_; }
  /// Moves the grid in space; its size stays.
  /// @throws InputError for a grid of another size
  void set_geometry(const Geometry& geometry);
  /// Type of one value.
  VoxelType type() const { return type_; }
  /// Values of a voxel, side by side.
  int components() const { return components_; }
  /// Bytes of all voxels together.
  std::size_t size_bytes() const;
  /// First byte of the voxels, or null.
  std::byte* data() { return voxels_.get(); }
  /// First byte of the voxels, or null.
  const std::byte* data() const { return voxels_.get(); }
  /// A view for writing of the whole volume.
  VolumeView view();
  /// A view for reading of the whole volume.
  ConstVolumeView view() const;
  /// Frees the voxels; grid, type and components stay known.
  void release() { voxels_.reset(); }
  /// All values as the C++ type V.
  /// @throws InputError if the volume holds another type
  template <class V>
  std::span<V> as() {
    check(voxel_type_of<V>());
    return {reinterpret_cast<V*>(data()), size_bytes() / sizeof(V)};
  }
  /// All values as the C++ type V.
  /// @throws InputError if the volume holds another type
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
