// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "python/src/arrays.h"

#include <nanobind/stl/string.h>

namespace tetwarp::python {

namespace {

std::string text_of(const std::vector<std::int64_t>& lengths) {
  std::string text = "[";
  for (std::size_t n = 0; n < lengths.size(); ++n) {
    if (n > 0) text += ", ";
    text += lengths[n] < 0 ? "any" : std::to_string(lengths[n]);
  }
  return text + "]";
}

template <class A>
std::vector<std::int64_t> shape_of(const A& array) {
  std::vector<std::int64_t> shape(array.ndim());
  for (std::size_t axis = 0; axis < shape.size(); ++axis) shape[axis] = static_cast<std::int64_t>(array.shape(axis));
  return shape;
}

std::string name_of(nb::dlpack::dtype type) {
  using Code = nb::dlpack::dtype_code;
  const char* kind = type.code == static_cast<std::uint8_t>(Code::Int)     ? "int"
                     : type.code == static_cast<std::uint8_t>(Code::UInt)  ? "uint"
                     : type.code == static_cast<std::uint8_t>(Code::Float) ? "float"
                     : type.code == static_cast<std::uint8_t>(Code::Bool)  ? "bool"
                                                                           : "a type of code ";
  return kind + std::to_string(type.bits);
}

/// @throws InputError for values with gaps between them, or in another order
template <class A>
void require_dense(const A& array, const std::string& name) {
  std::int64_t expected = 1;
  for (std::size_t axis = array.ndim(); axis-- > 0;) {
    const auto length = static_cast<std::int64_t>(array.shape(axis));
    require(length <= 1 || array.stride(axis) == expected, [&] {
      return name +
             " does not lie in memory as [k, j, i] with i fastest; pass a copy, numpy.ascontiguousarray(...), or " +
             "order=\"ijk\" for an array [i, j, k] in Fortran order";
    });
    expected *= std::max<std::int64_t>(length, 1);
  }
}

template <class A>
VoxelType type_of(const A& array, const std::string& name) {
  const nb::dlpack::dtype type = array.dtype();
  for (const VoxelType one : {VoxelType::u8, VoxelType::i8, VoxelType::u16, VoxelType::i16, VoxelType::u32,
                              VoxelType::i32, VoxelType::f32, VoxelType::f64}) {
    if (dispatch(one, [&](auto voxel) { return nb::dtype<decltype(voxel)>() == type; })) return one;
  }
  throw InputError(name + " holds " + name_of(type) +
                   "; expected int8, uint8, int16, uint16, int32, uint32, float32 or float64");
}

template <class A>
Memory where(const A& array, const std::string& name) {
  switch (array.device_type()) {
    case nb::device::cpu::value:
    case nb::device::cuda_host::value: return Memory::host;
    case nb::device::cuda::value:
    case nb::device::cuda_managed::value: return Memory::device;
    default:
      throw InputError(name + " lies on a device of type " + std::to_string(array.device_type()) +
                       "; expected host memory or CUDA");
  }
}

template <class View, class A>
View view_of(const A& array, const Geometry& grid, const std::string& name) {
  const std::vector<std::int64_t> shape = shape_of(array);
  const glm::i64vec3 size = grid.size;
  require((shape.size() == 3 || shape.size() == 4) && shape[0] == size.z && shape[1] == size.y && shape[2] == size.x,
          [&] {
            return name + " has the shape " + text_of(shape) + "; its geometry has " +
                   text_of({size.z, size.y, size.x}) + " (k, j, i)";
          });
  const std::int64_t components = shape.size() == 4 ? shape[3] : 1;
  require(components >= 1 && components <= INT16_MAX,
          [&] { return name + " has " + std::to_string(components) + " values a voxel; expected 1 to 32767"; });
  require_dense(array, name);
  View view{.geometry = &grid,
            .buffered = whole(grid),
            .type = type_of(array, name),
            .components = static_cast<int>(components),
            .memory = where(array, name)};
  view.voxels = static_cast<decltype(view.voxels)>(array.data());
  return view;
}

}  // namespace

ConstVolumeView voxels_of(const ConstArray& array, const Geometry& grid, const std::string& name) {
  return view_of<ConstVolumeView>(array, grid, name);
}

VolumeView voxels_of(const Array& array, const Geometry& grid, const std::string& name) {
  return view_of<VolumeView>(array, grid, name);
}

Memory memory_of(const ConstArray& array, const std::string& name) { return where(array, name); }

template <class V>
const V* values_of(const ConstArray& array, const std::vector<std::int64_t>& shape, const std::string& name,
                   bool may_be_on_device) {
  const std::vector<std::int64_t> found = shape_of(array);
  bool fits = found.size() == shape.size();
  for (std::size_t axis = 0; fits && axis < shape.size(); ++axis) fits = shape[axis] < 0 || shape[axis] == found[axis];
  require(fits, [&] { return name + " has the shape " + text_of(found) + "; expected " + text_of(shape); });
  const auto type = nb::dtype<V>();
  require(array.dtype() == type,
          [&] { return name + " holds " + name_of(array.dtype()) + "; expected " + name_of(type); });
  require_dense(array, name);
  require(may_be_on_device || where(array, name) == Memory::host,
          [&] { return name + " lies on a device; expected host memory"; });
  return static_cast<const V*>(array.data());
}

template const float* values_of(const ConstArray&, const std::vector<std::int64_t>&, const std::string&, bool);
template const double* values_of(const ConstArray&, const std::vector<std::int64_t>&, const std::string&, bool);
template const std::uint32_t* values_of(const ConstArray&, const std::vector<std::int64_t>&, const std::string&, bool);
template const std::uint64_t* values_of(const ConstArray&, const std::vector<std::int64_t>&, const std::string&, bool);
template const std::int64_t* values_of(const ConstArray&, const std::vector<std::int64_t>&, const std::string&, bool);

nb::object as_numpy(AnyVolume&& volume) {
  const glm::i64vec3 size = volume.geometry().size;
  std::vector<std::size_t> shape{static_cast<std::size_t>(size.z), static_cast<std::size_t>(size.y),
                                 static_cast<std::size_t>(size.x)};
  if (volume.components() > 1) shape.push_back(static_cast<std::size_t>(volume.components()));
  auto* owned = new AnyVolume(std::move(volume));
  const nb::capsule owner(owned, [](void* held) noexcept { delete static_cast<AnyVolume*>(held); });
  return dispatch(owned->type(), [&](auto voxel) {
    return nb::cast(nb::ndarray<nb::numpy, decltype(voxel)>(owned->data(), shape.size(), shape.data(), owner));
  });
}

nb::object as_numpy(const Geometry& grid, std::vector<glm::vec3>&& vectors) {
  return as_numpy<float>(std::move(vectors),
                         {static_cast<std::size_t>(grid.size.z), static_cast<std::size_t>(grid.size.y),
                          static_cast<std::size_t>(grid.size.x), 3});
}

}  // namespace tetwarp::python
