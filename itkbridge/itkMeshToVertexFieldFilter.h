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
 * The input is the undeformed mesh, LPS mm. A second mesh with the same point identifiers (`SetDeformedMesh`) states
 * where its points go. Without one, point data state it: a displacement vector in mm at each point. Cells of fewer than
 * three dimensions are left out; 3-D cells other than tetrahedra are refused. Tetrahedra are numbered in the order of
 * their cell identifiers: where they overlap deformed, the lowest wins.
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

  /** This class. */
  using Self = MeshToVertexFieldFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldSource;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(MeshToVertexFieldFilter, VertexFieldSource);

  /** Type of the mesh. */
  using MeshType = TMesh;
  /** Type of the mesh of deformed points. */
  using DeformedMeshType = TDeformedMesh;
  static_assert(TMesh::PointDimension == 3 && TDeformedMesh::PointDimension == 3, "Tetwarp deforms 3-D meshes");

  /** Inputs of ITK's process objects. */
  using Superclass::SetInput;
  /** The undeformed mesh, LPS mm. Required. */
  void SetInput(const MeshType* mesh) { this->ProcessObject::SetNthInput(0, const_cast<MeshType*>(mesh)); }
  /** The undeformed mesh. */
  const MeshType* GetInput() const { return static_cast<const MeshType*>(this->GetPrimaryInput()); }

  /** A mesh with the deformed points, LPS mm, under the same identifiers. Without it, point data are the displacements.
   */
  itkSetInputMacro(DeformedMesh, DeformedMeshType);
  /** The value that `SetDeformedMesh` set. */
  itkGetInputMacro(DeformedMesh, DeformedMeshType);

 protected:
  MeshToVertexFieldFilter();
  ~MeshToVertexFieldFilter() override = default;

  /** A VertexField has no information to make before its data. */
  void GenerateOutputInformation() override {}
  /** Makes the output. */
  void GenerateData() override;

 private:
  /** Vertex number in the field of each point identifier. */
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
