// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/itkVertexField.h"

namespace itk {

void VertexField::SetField(tetwarp::VertexField field) {
  const auto owner = std::make_shared<const tetwarp::VertexField>(std::move(field));
  try {
    this->SetView(tetwarp::view(*owner), owner);
  } catch (const tetwarp::Error& error) {
    itkExceptionMacro(<< error.what());
  }
}

void VertexField::SetView(const tetwarp::FieldView& view, std::shared_ptr<const void> owner) {
  m_View = view;
  m_Owner = std::move(owner);
  this->Modified();
}

tetwarp::FieldView VertexField::GetView(tetwarp::Outside outside) const {
  if (!m_Owner) itkExceptionMacro(<< "there is no field: call SetField, or update what makes it");
  tetwarp::FieldView view = m_View;
  view.outside = outside;
  return view;
}

const tetwarp::Geometry& VertexField::GetLattice() const {
  const tetwarp::FieldView view = this->GetView();
  if (!view.lattice) itkExceptionMacro(<< "a mesh that stands alone has no lattice");
  return *view.lattice;
}

void VertexField::Initialize() {
  Superclass::Initialize();
  m_View = {};
  m_Owner.reset();
}

void VertexField::Graft(const DataObject* data) {
  const auto* other = dynamic_cast<const Self*>(data);
  if (!other)
    itkExceptionMacro(<< "Graft takes an itk::VertexField, found " << (data ? data->GetNameOfClass() : "nothing"));
  this->SetView(other->m_View, other->m_Owner);
}

void VertexField::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  if (!m_Owner) {
    os << indent << "Field: (none)" << std::endl;
    return;
  }
  if (m_View.lattice) {
    const tetwarp::Geometry& lattice = *m_View.lattice;
    os << indent << "Lattice: " << tetwarp::to_string(lattice.size) << " vertices" << std::endl;
    os << indent << "LatticeSpacing: [" << lattice.spacing.x << ", " << lattice.spacing.y << ", " << lattice.spacing.z
       << "]" << std::endl;
    os << indent << "LatticeOrigin: [" << lattice.origin.x << ", " << lattice.origin.y << ", " << lattice.origin.z
       << "]" << std::endl;
  }
  os << indent << "ReplacedCells: " << m_View.replaced.size() << std::endl;
  os << indent << "MeshVertices: " << (m_View.mesh ? m_View.mesh->rest.size() : 0) << std::endl;
  os << indent << "MeshTetrahedra: " << (m_View.mesh ? m_View.mesh->tetrahedra.size() : 0) << std::endl;
  os << indent << "Memory: " << (m_View.memory == tetwarp::Memory::host ? "host" : "device") << std::endl;
}

}  // namespace itk
