// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/geometry.h"

#include "deform/errors.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <vector>

#include "python/src/module.h"

namespace tetwarp::python {

namespace nb = nanobind;

namespace {

using Triple = std::array<double, 3>;
using Whole = std::array<std::int64_t, 3>;

Triple triple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// @param direction  rows of the matrix whose columns are the axes of i, j, k
Geometry make(const Whole& size, const Triple& spacing, const Triple& origin, const std::array<double, 9>& direction,
              std::vector<double> slices) {
  Geometry geometry;
  geometry.size = {size[0], size[1], size[2]};
  geometry.spacing = {spacing[0], spacing[1], spacing[2]};
  geometry.origin = {origin[0], origin[1], origin[2]};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      geometry.direction[column][row] = direction[static_cast<std::size_t>(3 * row + column)];
  geometry.slices = std::move(slices);
  require_valid(geometry, "the geometry");
  constexpr std::int64_t kMost = std::int64_t{1}
                                 << 40;  // of samples: more fits no memory, and products stay in 64 bits
  require(geometry.size.x <= kMost && geometry.size.y <= kMost / geometry.size.x &&
              geometry.size.z <= kMost / geometry.size.x / geometry.size.y,
          "the geometry has a size of " + to_string(geometry.size) + ", more than 2^40 samples");
  return geometry;
}

std::array<double, 9> rows_of(const glm::dmat3& matrix) {
  std::array<double, 9> rows{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rows[static_cast<std::size_t>(3 * row + column)] = matrix[column][row];
  return rows;
}

}  // namespace

void add_geometry(nb::module_& core) {
  nb::class_<Geometry>(core, "Grid")
      .def(nb::new_(&make), nb::arg("size"), nb::arg("spacing"), nb::arg("origin"), nb::arg("direction"),
           nb::arg("slices"))
      .def_prop_ro("size",
                   [](const Geometry& grid) {
                     return Whole{grid.size.x, grid.size.y, grid.size.z};
                   })
      .def_prop_ro("spacing", [](const Geometry& grid) { return triple(grid.spacing); })
      .def_prop_ro("origin", [](const Geometry& grid) { return triple(grid.origin); })
      .def_prop_ro("direction", [](const Geometry& grid) { return rows_of(grid.direction); })
      .def_prop_ro("slices", [](const Geometry& grid) { return grid.slices; })
      .def(
          "lattice",
          [](const Geometry& grid, std::int64_t cell_size) { return lattice_over(straightened(grid), cell_size); },
          nb::arg("cell_size"))
      .def("straightened", &straightened)
      .def(
          "__eq__", [](const Geometry& one, const Geometry& other) { return one == other; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("centre", [](const Geometry& grid) { return triple(centre(grid)); })
      .def("orientation", &orientation_code);
}

}  // namespace tetwarp::python
