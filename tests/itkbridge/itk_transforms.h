// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "deform/volume.h"

/// A transform that ITK makes and evaluates, with which this project's results are compared.
class ItkTransform {
 public:
  /// Makes a transform. @param type  name in ITK's factory, `AffineTransform_double_3_3`
  ItkTransform(const std::string& type, const std::vector<double>& fixed, const std::vector<double>& parameters);
  /// Makes ITK's composite transform, to which the parts are added one after the other.
  explicit ItkTransform(const std::vector<ItkTransform>& parts);

  glm::dvec3 operator()(const glm::dvec3& point) const;
  /// Writes the transform by ITK's TransformFileWriter: .h5 .tfm .txt.
  void write(const std::filesystem::path& path, bool compressed = false) const;

 private:
  struct Held;
  std::shared_ptr<Held> held_;
};

/// The fixed parameters of a grid: size, origin, spacing, direction row by row.
std::vector<double> grid_numbers(const tetwarp::Geometry& grid);

/// An affine transform with shear about a centre that is not the origin. It moves the centre by (3, 5, 7) mm.
ItkTransform sheared_about(const glm::dvec3& centre = {10, -20, 30});
/// The grid of the B-spline `one_bump`, along the axes of `oblique_grid`: 7 x 6 x 8 coefficients, 9, 8, 7 mm apart. One
/// of them is moved by (3, 5, 7) mm.
tetwarp::Geometry spline_grid();
ItkTransform one_bump();
/// A displacement field on an oblique grid that is at rest, except for (3, 5, 7) mm at sample (3, 1, 2).
ItkTransform one_corner(const tetwarp::Geometry& grid);
