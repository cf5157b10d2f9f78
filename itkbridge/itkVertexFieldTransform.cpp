// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/itkVertexFieldTransform.h"

#include "itkbridge/image_geometry.h"

namespace itk {

namespace {

glm::dvec3 vector_of(const VertexFieldTransform::InputPointType& point) { return {point[0], point[1], point[2]}; }

}  // namespace

void VertexFieldTransform::SetVertexField(const VertexField* field, const ImageBase<3>* grid) {
  if (!field || !grid) itkExceptionMacro(<< "SetVertexField takes a field and an image that has the grid, found none");
  const tetwarp::FieldView view = field->GetView(tetwarp::Outside::rest);
  try {
    m_Mover = std::make_shared<const tetwarp::PointMover>(tetwarp::geometry_of(*grid), view);
  } catch (const tetwarp::Error& error) {
    itkExceptionMacro(<< error.what());
  }
  m_Owner = field->GetOwner();
  this->Modified();
}

tetwarp::PointStatus VertexFieldTransform::Move(glm::dvec3& point) const {
  if (!m_Mover) itkExceptionMacro(<< "there is no field: call SetVertexField");
  try {
    return m_Mover->move(point);
  } catch (const tetwarp::Error& error) {
    itkExceptionMacro(<< error.what());
  }
}

VertexFieldTransform::OutputPointType VertexFieldTransform::TransformPoint(const InputPointType& point) const {
  glm::dvec3 at = vector_of(point);
  this->Move(at);
  OutputPointType moved;
  for (unsigned axis = 0; axis < 3; ++axis) moved[axis] = at[static_cast<int>(axis)];
  return moved;
}

bool VertexFieldTransform::IsInside(const InputPointType& point) const {
  glm::dvec3 at = vector_of(point);
  return this->Move(at) == tetwarp::PointStatus::moved;
}

VertexFieldTransform::OutputVectorType VertexFieldTransform::TransformVector(const InputVectorType&) const {
  itkExceptionMacro(<< "a vector has no image without its place; transform the two points");
}

void VertexFieldTransform::ComputeJacobianWithRespectToParameters(const InputPointType&, JacobianType&) const {
  itkExceptionMacro(<< "a vertex field has no parameters to optimise");
}

LightObject::Pointer VertexFieldTransform::InternalClone() const {
  const Pointer clone = New();
  clone->m_Owner = m_Owner;
  clone->m_Mover = m_Mover;
  return clone.GetPointer();
}

void VertexFieldTransform::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "VertexField: " << (m_Mover ? "set" : "(none)") << std::endl;
}

}  // namespace itk
