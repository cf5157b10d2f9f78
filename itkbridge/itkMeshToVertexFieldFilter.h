// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkMeshToVertexFieldFilter_h
#define itkMeshToVertexFieldFilter_h

#include <map>

#include "itkbridge/itkVertexFieldSource.h"

namespace itk {
/** \class MeshToVertexFieldFilter
 * \brief Takes a mesh of tetrahedra, undeformed and deformed, as a forward field.
 *
 * The input is the undeformed mesh, LPS mm. Where its points go is said by a second mesh with the same point
 * identifiers
 * (`SetDeformedMesh`), or, without one, by the point data, a vector of displacements in mm at each point. Cells of
 * fewer than three dimensions are left out; 3-D cells other than tetrahedra are refused. Tetrahedra are numbered in the
 * order of their cell identifiers: where they overlap deformed, the lowest wins.
 *
 * \code
 * using MeshType = itk::Mesh<itk::Vector<float, 3>, 3>;
 * auto source = itk::MeshToVertexFieldFilter<MeshType>::New();
 * source->SetInput(mesh);
 * \endcode
 *
 * \sa VertexFieldToMeshFilter
 * \ingroup MeshFilters Tetwarp */
template <typename TMesh, typename TDeformedMesh = TMesh>
class ITK_TEMPLATE_EXPORT MeshToVertexFieldFilter : public VertexFieldSource {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(MeshToVertexFieldFilter);

  using Self = MeshToVertexFieldFilter;
  using Superclass = VertexFieldSource;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(MeshToVertexFieldFilter, VertexFieldSource);

  using MeshType = TMesh;
  using DeformedMeshType = TDeformedMesh;
  static_assert(TMesh::PointDimension == 3 && TDeformedMesh::PointDimension == 3, "Tetwarp deforms 3-D meshes");

  /** The undeformed mesh. Required. */
  using Superclass::SetInput;
  void SetInput(const MeshType* mesh) { this->ProcessObject::SetNthInput(0, const_cast<MeshType*>(mesh)); }
  const MeshType* GetInput() const { return static_cast<const MeshType*>(this->GetPrimaryInput()); }

  /** Where the points go. */
  itkSetInputMacro(DeformedMesh, DeformedMeshType);
  itkGetInputMacro(DeformedMesh, DeformedMeshType);

 protected:
  MeshToVertexFieldFilter();
  ~MeshToVertexFieldFilter() override = default;

  void GenerateOutputInformation() override {}
  void GenerateData() override;

 private:
  /** Vertex numbers of the field by point identifier. */
  using Numbers = std::map<typename MeshType::PointIdentifier, std::uint32_t>;

  glm::vec3 GetDisplacement(typename MeshType::PointIdentifier id, const typename MeshType::PointType& rest) const;
  Numbers CopyPoints(tetwarp::TetrahedralMesh& mesh) const;
  void CopyTetrahedra(const Numbers& numbers, tetwarp::TetrahedralMesh& mesh) const;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkMeshToVertexFieldFilter.hxx"
#endif

#endif
