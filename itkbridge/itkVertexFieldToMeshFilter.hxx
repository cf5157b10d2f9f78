// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToMeshFilter_hxx
#define itkVertexFieldToMeshFilter_hxx

#include <itkTetrahedronCell.h>

#include "deform/fields/lattice_mesh.h"
#include "itkbridge/itkVertexFieldToMeshFilter.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace itk {

template <typename TOutputMesh>
void VertexFieldToMeshFilter<TOutputMesh>::GenerateData() {
  tetwarp::TetrahedralMesh mesh;
  tetwarp::translate_errors(*this, [&] { mesh = tetwarp::mesh_of(this->GetVertexField()->GetView()); });
  MeshType* const output = this->GetOutput();
  const auto points = MeshType::PointsContainer::New();
  const auto displacements = MeshType::PointDataContainer::New();
  points->Reserve(mesh.rest.size());
  displacements->Reserve(mesh.rest.size());
  for (std::size_t n = 0; n < mesh.rest.size(); ++n) {
    typename MeshType::PointType point;
    typename MeshType::PixelType displacement;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto along = static_cast<int>(axis);
      const double by = mesh.displacement[n][along];
      point[axis] = static_cast<typename MeshType::CoordRepType>(mesh.rest[n][along] + (m_Deformed ? by : 0));
      displacement[axis] = static_cast<typename MeshType::PixelType::ValueType>(by);
    }
    points->SetElement(n, point);
    displacements->SetElement(n, displacement);
  }
  output->SetPoints(points);
  output->SetPointData(displacements);
  const auto cells = MeshType::CellsContainer::New();
  cells->Reserve(mesh.tetrahedra.size());
  output->SetCellsAllocationMethod(MeshEnums::MeshClassCellsAllocationMethod::CellsAllocatedDynamicallyCellByCell);
  output->SetCells(cells);
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    typename MeshType::CellAutoPointer cell;
    cell.TakeOwnership(new TetrahedronCell<typename MeshType::CellType>);
    for (int corner = 0; corner < 4; ++corner) cell->SetPointId(corner, mesh.tetrahedra[n][corner]);
    output->SetCell(n, cell);
  }
}

template <typename TOutputMesh>
void VertexFieldToMeshFilter<TOutputMesh>::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "Deformed: " << (m_Deformed ? "On" : "Off") << std::endl;
}

}  // namespace itk

#endif
