// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/itkbridge/itk_transforms.h"

#include <itkCompositeTransform.h>
#include <itkHDF5TransformIO.h>
#include <itkTransformFactoryBase.h>
#include <itkTransformFileWriter.h>
#include <itkTxtTransformIO.h>

#include <algorithm>

#include "tests/support/image_samples.h"

using Transform = itk::Transform<double, 3, 3>;

struct ItkTransform::Held {
  Transform::Pointer transform;
};

namespace {

template <class Array>
Array itk_array(const std::vector<double>& values) {
  Array array(values.size());
  std::ranges::copy(values, array.begin());
  return array;
}

}  // namespace

ItkTransform::ItkTransform(const std::string& type, const std::vector<double>& fixed,
                           const std::vector<double>& parameters)
    : held_(std::make_shared<Held>()) {
  itk::TransformFactoryBase::RegisterDefaultTransforms();
  const itk::LightObject::Pointer made = itk::ObjectFactoryBase::CreateInstance(type.c_str());
  held_->transform = dynamic_cast<Transform*>(made.GetPointer());
  if (!held_->transform) throw std::invalid_argument(type);
  made->UnRegister();
  held_->transform->SetFixedParameters(itk_array<Transform::FixedParametersType>(fixed));
  held_->transform->SetParametersByValue(itk_array<Transform::ParametersType>(parameters));
}

ItkTransform::ItkTransform(const std::vector<ItkTransform>& parts) : held_(std::make_shared<Held>()) {
  const auto composite = itk::CompositeTransform<double, 3>::New();
  for (const ItkTransform& part : parts) composite->AddTransform(part.held_->transform);
  held_->transform = composite.GetPointer();
}

glm::dvec3 ItkTransform::operator()(const glm::dvec3& point) const {
  Transform::InputPointType at;
  for (unsigned axis = 0; axis < 3; ++axis) at[axis] = point[static_cast<int>(axis)];
  const auto moved = held_->transform->TransformPoint(at);
  return {moved[0], moved[1], moved[2]};
}

void ItkTransform::write(const std::filesystem::path& path, bool compressed) const {
  const auto writer = itk::TransformFileWriterTemplate<double>::New();
  if (path.extension() == ".h5") {
    writer->SetTransformIO(itk::HDF5TransformIO::New());
  } else {
    writer->SetTransformIO(itk::TxtTransformIO::New());
  }
  writer->SetFileName(path.string());
  writer->SetInput(held_->transform);
  writer->SetUseCompression(compressed);
  writer->Update();
}

std::vector<double> grid_numbers(const tetwarp::Geometry& grid) {
  std::vector<double> numbers;
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<double>(grid.size[axis]));
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(grid.origin[axis]);
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(grid.spacing[axis]);
  for (int row = 0; row < 3; ++row) {
    for (int axis = 0; axis < 3; ++axis) numbers.push_back(grid.direction[axis][row]);
  }
  return numbers;
}

ItkTransform sheared_about(const glm::dvec3& centre) {
  return {"AffineTransform_double_3_3",
          {centre.x, centre.y, centre.z},
          {1.1, 0.2, -0.1, 0.05, 0.9, 0.15, -0.2, 0.1, 1.05, 3, 5, 7}};
}

tetwarp::Geometry spline_grid() {
  tetwarp::Geometry grid = oblique_grid();
  grid.size = {7, 6, 8};
  grid.spacing = {9, 8, 7};
  return grid;
}

ItkTransform one_bump() {
  const tetwarp::Geometry grid = spline_grid();
  const auto count = static_cast<std::size_t>(tetwarp::voxel_count(grid));
  std::vector<double> parameters(3 * count, 0.0);
  const std::size_t bump = 3 + 7 * (2 + 6 * 4);
  for (std::size_t axis = 0; axis < 3; ++axis) parameters[axis * count + bump] = 3.0 + 2.0 * static_cast<double>(axis);
  return {"BSplineTransform_double_3_3", grid_numbers(grid), parameters};
}

ItkTransform one_corner(const tetwarp::Geometry& grid) {
  const auto count = static_cast<std::size_t>(tetwarp::voxel_count(grid));
  std::vector<double> parameters(3 * count, 0.0);
  const auto corner = static_cast<std::size_t>(3 + grid.size.x * (1 + grid.size.y * 2));
  for (std::size_t axis = 0; axis < 3; ++axis) parameters[3 * corner + axis] = 3.0 + 2.0 * static_cast<double>(axis);
  return {"DisplacementFieldTransform_double_3_3", grid_numbers(grid), parameters};
}
