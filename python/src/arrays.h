// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deform/volume.h"

/// The binding of Python's package `tetwarp`: the module `tetwarp._core`. Its functions take arrays and plain values;
/// what people call is written in Python around it (python/tetwarp).
namespace tetwarp::python {

namespace nb = nanobind;

/// Any array that may be read: NumPy's, or one that comes by DLPack, in host or device memory.
using ConstArray = nb::ndarray<nb::ro>;
/// Any array that may be written.
using Array = nb::ndarray<>;

/// The voxels of an array [k, j, i] or, with several values a voxel, [k, j, i, c].
/// @param array  values lie without gaps, i fastest; the view does not keep it
/// @param grid   grid of the voxels; the view refers to it
/// @param name   what messages call the array
/// @throws InputError for another shape, order or type of values
ConstVolumeView voxels_of(const ConstArray& array, const Geometry& grid, const std::string& name);
/// The voxels of an array that may be written; otherwise as the other overload.
VolumeView voxels_of(const Array& array, const Geometry& grid, const std::string& name);

/// The values of an array whose type and shape are known, such as displacements [k, j, i, 3] of float.
/// @param shape  expected lengths, -1 for any
/// @throws InputError for another shape, order, type or memory
template <class V>
const V* values_of(const ConstArray& array, const std::vector<std::int64_t>& shape, const std::string& name,
                   bool may_be_on_device = false);

/// Where the values of an array lie.
/// @throws InputError for a device that is neither the CPU's nor CUDA's
Memory memory_of(const ConstArray& array, const std::string& name);

/// A NumPy array [k, j, i] or [k, j, i, c] that takes over the voxels of a volume.
nb::object as_numpy(AnyVolume&& volume);
/// A NumPy array of this shape that takes over values.
template <class V, class Stored>
nb::object as_numpy(std::vector<Stored>&& values, std::vector<std::size_t> shape) {
  auto* owned = new std::vector<Stored>(std::move(values));
  const nb::capsule owner(owned, [](void* held) noexcept { delete static_cast<std::vector<Stored>*>(held); });
  return nb::cast(nb::ndarray<nb::numpy, V>(owned->data(), shape.size(), shape.data(), owner));
}
/// The array of one vector of three floats for each sample of a grid, [k, j, i, 3].
nb::object as_numpy(const Geometry& grid, std::vector<glm::vec3>&& vectors);

}  // namespace tetwarp::python
