// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkMeshToVertexFieldFilter_hxx
#define itkMeshToVertexFieldFilter_hxx

#include <itkDefaultConvertPixelTraits.h>

#include <limits>

#include "itkbridge/itkMeshToVertexFieldFilter.h"

namespace itk {

template <typename TMesh, typename TDeformedMesh>
MeshToVertexFieldFilter<TMesh, TDeformedMesh>::MeshToVertexFieldFilter() {
  this->SetNumberOfRequiredInputs(1);
  this->AddOptionalInputName("DeformedMesh");
}

template <typename TMesh, typename TDeformedMesh>
glm::vec3 MeshToVertexFieldFilter<TMesh, TDeformedMesh>::GetDisplacement(
    typename MeshType::PointIdentifier id, const typename MeshType::PointType& rest) const {
  if (const DeformedMeshType* const deformed = this->GetDeformedMesh()) {
    typename DeformedMeshType::PointType moved;
    if (!deformed->GetPoint(id, &moved)) itkExceptionMacro(<< "the deformed mesh has no point " << id);
    const auto by = [&](unsigned axis) {
      return static_cast<float>(static_cast<double>(moved[axis]) - static_cast<double>(rest[axis]));
    };
    return {by(0), by(1), by(2)};
  }
  using PixelType = typename MeshType::PixelType;
  using Traits = DefaultConvertPixelTraits<PixelType>;
  PixelType value;
  if (!this->GetInput()->GetPointData(id, &value))
    itkExceptionMacro(<< "point " << id << " has no displacement; give point data of vectors, or a deformed mesh");
  if (Traits::GetNumberOfComponents(value) != 3)
    itkExceptionMacro(<< "the data of point " << id << " has " << Traits::GetNumberOfComponents(value)
                      << " components, expected 3; give displacements, or a deformed mesh");
  const auto component = [&](int axis) { return static_cast<float>(Traits::GetNthComponent(axis, value)); };
  return {component(0), component(1), component(2)};
}

template <typename TMesh, typename TDeformedMesh>
auto MeshToVertexFieldFilter<TMesh, TDeformedMesh>::CopyPoints(tetwarp::TetrahedralMesh& mesh) const -> Numbers {
  Numbers numbers;
  const auto* const points = this->GetInput()->GetPoints();
  if (!points) return numbers;
  if (points->Size() > std::numeric_limits<std::uint32_t>::max())
    itkExceptionMacro(<< "a mesh of " << points->Size() << " points, expected fewer than 2^32");
  for (auto at = points->Begin(); at != points->End(); ++at) {
    const auto& rest = at.Value();
    numbers.emplace_hint(numbers.end(), at.Index(), static_cast<std::uint32_t>(mesh.rest.size()));
    mesh.rest.emplace_back(rest[0], rest[1], rest[2]);
    mesh.displacement.push_back(this->GetDisplacement(at.Index(), rest));
  }
  return numbers;
}

template <typename TMesh, typename TDeformedMesh>
void MeshToVertexFieldFilter<TMesh, TDeformedMesh>::CopyTetrahedra(const Numbers& numbers,
                                                                   tetwarp::TetrahedralMesh& mesh) const {
  const auto* const cells = this->GetInput()->GetCells();
  if (!cells) return;
  for (auto at = cells->Begin(); at != cells->End(); ++at) {
    const auto& cell = *at.Value();
    if (cell.GetDimension() < 3) continue;
    if (cell.GetType() != CellGeometryEnum::TETRAHEDRON_CELL)
      itkExceptionMacro(<< "cell " << at.Index() << " is of type " << cell.GetType()
                        << ", expected tetrahedra; split it before");
    glm::u32vec4 corners;
    int corner = 0;
    for (auto id = cell.PointIdsBegin(); id != cell.PointIdsEnd(); ++id, ++corner) {
      const auto number = numbers.find(*id);
      if (number == numbers.end())
        itkExceptionMacro(<< "cell " << at.Index() << " has a point " << *id << " that is not there");
      corners[corner] = number->second;
    }
    mesh.tetrahedra.push_back(corners);
  }
}

template <typename TMesh, typename TDeformedMesh>
void MeshToVertexFieldFilter<TMesh, TDeformedMesh>::GenerateData() {
  tetwarp::VertexField field;
  this->CopyTetrahedra(this->CopyPoints(field.mesh), field.mesh);
  if (field.mesh.is_empty()) itkExceptionMacro(<< "the mesh has no tetrahedra");
  this->GetOutput()->SetField(std::move(field));
}

}  // namespace itk

#endif
