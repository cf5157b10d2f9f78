// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkTransformToVertexFieldFilter_hxx
#define itkTransformToVertexFieldFilter_hxx

#include "deform/fields/point_map.h"
#include "itkbridge/image_geometry.h"
#include "itkbridge/itkTransformToVertexFieldFilter.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace itk {

template <typename TParametersValueType>
TransformToVertexFieldFilter<TParametersValueType>::TransformToVertexFieldFilter() {
  m_Size.Fill(0);
  m_OutputSpacing.Fill(1);
  m_OutputOrigin.Fill(0);
  m_OutputDirection.SetIdentity();
  this->AddRequiredInputName("Transform");
  this->AddOptionalInputName("ReferenceImage");
}

template <typename TParametersValueType>
tetwarp::Geometry TransformToVertexFieldFilter<TParametersValueType>::GetLattice() const {
  if (m_Size == SizeType::Filled(0)) {
    const ReferenceImageBaseType* const reference = this->GetReferenceImage();
    if (!reference) itkExceptionMacro(<< "no lattice: set a reference image, or size, spacing, origin and direction");
    return tetwarp::lattice_over(tetwarp::geometry_of(*reference), static_cast<std::int64_t>(m_CellSize));
  }
  tetwarp::Geometry lattice;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<int>(axis);
    lattice.size[along] = static_cast<std::int64_t>(m_Size[axis]);
    lattice.spacing[along] = m_OutputSpacing[axis];
    lattice.origin[along] = m_OutputOrigin[axis];
    for (unsigned row = 0; row < 3; ++row)
      lattice.direction[along][static_cast<int>(row)] = m_OutputDirection(row, axis);
  }
  return lattice;
}

template <typename TParametersValueType>
void TransformToVertexFieldFilter<TParametersValueType>::GenerateData() {
  const TransformType* const transform = this->GetTransform();
  const auto map = [transform](const glm::dvec3& rest) {
    typename TransformType::InputPointType point;
    for (unsigned axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<TParametersValueType>(rest[static_cast<int>(axis)]);
    const auto moved = transform->TransformPoint(point);
    return glm::dvec3(moved[0], moved[1], moved[2]) - rest;
  };
  tetwarp::VertexField field;
  tetwarp::run_for(*this, {}, [&](const tetwarp::Control& control) {
    field = tetwarp::sample_on(this->GetLattice(), map, {.threads = tetwarp::threads_of(*this)}, control);
  });
  this->GetOutput()->SetField(std::move(field));
}

template <typename TParametersValueType>
void TransformToVertexFieldFilter<TParametersValueType>::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "CellSize: " << m_CellSize << std::endl;
  os << indent << "Size: " << m_Size << std::endl;
  os << indent << "OutputSpacing: " << m_OutputSpacing << std::endl;
  os << indent << "OutputOrigin: " << m_OutputOrigin << std::endl;
  os << indent << "OutputDirection: " << m_OutputDirection << std::endl;
}

}  // namespace itk

#endif
