// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <sstream>

#include "tests/support/foreign_field.h"

/// Lets VTK write a dataset (tests/support/make_vtk.py lists the kinds). @return false: Python, or a library that the
/// script needs, is missing
inline bool make_vtk(const std::string& kind, const std::string& encoding, const std::filesystem::path& output,
                     const tetwarp::Geometry& grid) {
  std::ostringstream numbers;
  numbers.precision(17);
  numbers << grid.size.x << ',' << grid.size.y << ',' << grid.size.z;
  for (const glm::dvec3& triple : {grid.spacing, grid.origin}) {
    numbers << ',' << triple.x << ',' << triple.y << ',' << triple.z;
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers << ',' << grid.direction[column][row];
  }
  return run_python("'" TETWARP_MAKE_VTK "' '" + kind + "' '" + encoding + "' '" + output.string() + "' ' " +
                    numbers.str() + "'");
}
