// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <itkBSplineBaseTransform.h>
#include <itkDisplacementFieldTransform.h>
#include <itkTransformFactoryBase.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <mutex>

#include "deform/errors.h"
#include "itkbridge/transform_file.h"

namespace tetwarp {
namespace {

using Transform = itk::Transform<double, 3, 3>;
using Spline = itk::BSplineBaseTransform<double, 3, 3>;
using Field = itk::DisplacementFieldTransform<double, 3>;

constexpr std::size_t kGridValues = 18;  // size, origin, spacing, direction

/// A part that can be evaluated. At most one of `spline` and `field` is set; both point into `transform`.
struct Part {
  Transform::ConstPointer transform;
  const Spline* spline = nullptr;
  const Field::InterpolatorType* field = nullptr;
};

/// The class in the type of a record: `BSplineTransform` of `BSplineTransform_double_3_3`.
std::string class_of(const TransformRecord& record) { return record.type.substr(0, record.type.find('_')); }

/// The type for which ITK's factory makes a transform that computes in double.
std::string double_type(const TransformRecord& record, const std::string& file) {
  const std::string name = class_of(record), rest = record.type.substr(name.size());
  require(
      rest == "_double_3_3" || rest == "_float_3_3",
      "the transform \"" + record.type.substr(0, 80) + "\", " + file +
          "; expected a class of ITK for 3 dimensions (and order 3 of B-splines), such as AffineTransform_double_3_3");
  // The factory of ITK 5.2 does not make the base class, which ANTs writes; an AffineTransform has the same numbers.
  return (name == "MatrixOffsetTransformBase" ? "AffineTransform" : name) + "_double_3_3";
}

void require_finite(const std::vector<double>& values, const std::string& what, const std::string& file) {
  const auto bad = std::ranges::find_if(values, [](double value) { return !std::isfinite(value); });
  require(bad == values.end(), what + " " + std::to_string(bad - values.begin()) + " is " +
                                   (bad == values.end() ? "" : std::to_string(*bad)) + ", " + file +
                                   "; expected finite numbers");
}

void require_count(std::size_t found, std::size_t expected, const std::string& what, const std::string& file) {
  require(found == expected,
          std::to_string(found) + " " + what + ", " + file + "; expected " + std::to_string(expected));
}

/// Refuses a grid that cannot exist, or whose number of values differs, before ITK allocates it.
/// @param least  the smallest number of samples along each axis
void require_grid(const TransformRecord& record, double least, const std::string& file) {
  const std::string name = class_of(record);
  require_count(record.fixed.size(), kGridValues, "fixed parameters of " + name, file);
  double values = 3;
  glm::dmat3 direction;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = record.fixed[axis], spacing = record.fixed[6 + axis];
    require(size >= least && size < 2147483648.0 && size == std::floor(size),
            "a grid of " + std::to_string(size) + " samples along axis " + std::to_string(axis) + " of " + name + ", " +
                file + "; expected a whole number from " + std::to_string(static_cast<int>(least)));
    require(spacing > 0, "a grid spacing of " + std::to_string(spacing) + " mm along axis " + std::to_string(axis) +
                             " of " + name + ", " + file + "; expected more than 0");
    values *= size;
    for (std::size_t row = 0; row < 3; ++row)
      direction[static_cast<int>(axis)][static_cast<int>(row)] = record.fixed[9 + 3 * row + axis];
  }
  require(std::abs(glm::determinant(direction)) > 1e-6, "a grid direction without an inverse, " + file);
  require(values == static_cast<double>(record.parameters.size()), std::to_string(record.parameters.size()) +
                                                                       " parameters of " + name + ", " + file +
                                                                       "; its grid needs " + std::to_string(values));
}

template <class Array>
Array itk_array(const std::vector<double>& values) {
  Array array(static_cast<itk::SizeValueType>(values.size()));
  std::ranges::copy(values, array.begin());
  return array;
}

Transform::Pointer create(const std::string& type, const std::string& file) {
  const itk::LightObject::Pointer made = itk::ObjectFactoryBase::CreateInstance(type.c_str());
  const Transform::Pointer transform = dynamic_cast<Transform*>(made.GetPointer());
  require(transform.IsNotNull(), "ITK knows no transform \"" + type.substr(0, 80) + "\", " + file);
  made->UnRegister();  // a factory registers its object for the caller, and the pointer registers it again
  return transform;
}

Part make_part(const TransformRecord& record, const std::string& file) {
  const std::string name = class_of(record), type = double_type(record, file);
  const Transform::Pointer transform = create(type, file);
  require_finite(record.fixed, "fixed parameter", file);
  require_finite(record.parameters, "parameter", file);
  Part part{transform.GetPointer(), nullptr, nullptr};
  if (name == "BSplineTransform") {
    require_grid(record, 4, file);
    part.spline = dynamic_cast<const Spline*>(part.transform.GetPointer());
  } else if (name == "DisplacementFieldTransform") {
    require_grid(record, 1, file);
  } else {
    require(transform->IsLinear(),
            "the transform \"" + type + "\", " + file + "; expected an affine one, a B-spline or a displacement field");
    const std::size_t fixed = transform->GetFixedParameters().Size();
    // Files older than ITK 4.13 lack the fourth fixed parameter of Euler3DTransform, the order of its rotations. Files
    // of its inverse, a MatrixOffsetTransformBase, have it, although a matrix needs no order.
    const bool has_other_count = (name == "Euler3DTransform" && record.fixed.size() == 3) ||
                                 (name == "MatrixOffsetTransformBase" && record.fixed.size() == 4);
    if (!has_other_count) require_count(record.fixed.size(), fixed, "fixed parameters of " + name, file);
    require_count(record.parameters.size(), transform->GetNumberOfParameters(), "parameters of " + name, file);
  }
  transform->SetFixedParameters(itk_array<Transform::FixedParametersType>(record.fixed));
  transform->SetParametersByValue(itk_array<Transform::ParametersType>(record.parameters));
  if (name == "DisplacementFieldTransform") part.field = dynamic_cast<const Field&>(*part.transform).GetInterpolator();
  return part;
}

constexpr std::size_t kCoefficients = 64;  // coefficients of a B-spline that one point depends on

/// An array of `kCoefficients` values as ITK's B-splines take it, on the stack. ITK 5.4 has an itk::FixedArray, which
/// holds its values; the itk::Array of ITK 5.2 would allocate them, so it is given their place.
template <typename TArray>
struct StackArray {
  TArray array;
};

template <typename TValue>
struct StackArray<itk::Array<TValue>> {
  std::array<TValue, kCoefficients> values;
  itk::Array<TValue> array{values.data(), kCoefficients, false};
};

/// Applies one part to a point. ITK's methods are const and keep nothing between calls. A B-spline's working arrays are
/// on the stack, since the leak sanitizer of GCC 12 fails on thread-local arrays of a library that is loaded later.
Transform::OutputPointType apply(const Part& part, const Transform::InputPointType& point, bool& outside) {
  if (part.spline) {
    StackArray<Spline::WeightsType> weights;
    StackArray<Spline::ParameterIndexArrayType> indices;
    Transform::OutputPointType moved;
    bool inside = true;
    part.spline->TransformPoint(point, moved, weights.array, indices.array, inside);
    outside = outside || !inside;
    return moved;
  }
  if (part.field) outside = outside || !part.field->IsInsideBuffer(point);
  return part.transform->TransformPoint(point);
}

}  // namespace

TransformFunction make_transform(const StoredTransform& stored, const std::string& file) {
  static std::mutex mutex;  // ITK 5.2 makes its factories and singletons without a lock
  const std::lock_guard lock(mutex);
  itk::TransformFactoryBase::RegisterDefaultTransforms();
  const auto parts = std::make_shared<std::vector<Part>>();
  try {
    // The last part is applied first.
    for (auto record = stored.parts.rbegin(); record != stored.parts.rend(); ++record)
      parts->push_back(make_part(*record, file));
  } catch (const itk::ExceptionObject& error) {
    throw InputError("ITK refuses the transform, " + file + ": " + error.GetDescription());
  }
  return [parts](const glm::dvec3& point, bool& outside) {
    Transform::InputPointType at;
    for (unsigned axis = 0; axis < 3; ++axis) at[axis] = point[static_cast<int>(axis)];
    for (const Part& part : *parts) at = apply(part, at, outside);
    return glm::dvec3(at[0], at[1], at[2]);
  };
}

}  // namespace tetwarp
