// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToMeshFilter_h
#define itkVertexFieldToMeshFilter_h

#include <itkMesh.h>
#include <itkMeshSource.h>
#include <itkVector.h>

#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldToMeshFilter
 * \brief The tetrahedra of a forward field, five of each cell of its lattice, as a mesh of ITK.
 *
 * Points are at rest, LPS mm, or where they go with `DeformedOn`; the point data are the displacements, mm. A mesh of
 * ITK takes some hundred bytes for each tetrahedron: this is for looking at a coarse field, not for one with a vertex
 * on every voxel.
 *
 * A mesh whose coordinates are doubles (`DefaultDynamicMeshTraits<Vector<float, 3>, 3, 3, double>`) says the field
 * again, bit for bit, through `MeshToVertexFieldFilter`. ITK's default are floats: of a grid whose numbers are not
 * round, some vertices come to lie 2^-12 voxel aside then.
 *
 * \code
 * auto mesh = itk::VertexFieldToMeshFilter<>::New();
 * mesh->SetVertexField(field);
 * mesh->Update();
 * \endcode
 *
 * \sa MeshToVertexFieldFilter
 * \ingroup MeshFilters Tetwarp */
template <typename TOutputMesh = Mesh<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToMeshFilter : public MeshSource<TOutputMesh> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToMeshFilter);

  /** This class. */
  using Self = VertexFieldToMeshFilter;
  /** The class from which this one is derived. */
  using Superclass = MeshSource<TOutputMesh>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToMeshFilter, MeshSource);

  /** Type of the mesh. */
  using MeshType = TOutputMesh;
  static_assert(TOutputMesh::PointDimension == 3, "Tetwarp deforms 3-D meshes");

  /** The forward field. Required. */
  itkSetInputMacro(VertexField, VertexField);
  /** The value that `SetVertexField` set. */
  itkGetInputMacro(VertexField, VertexField);

  /** Whether points are deformed, not undeformed. Off by default. */
  itkSetMacro(Deformed, bool);
  /** The value that `SetDeformed` set. */
  itkGetConstMacro(Deformed, bool);
  /** Calls `SetDeformed(true)`; DeformedOff calls `SetDeformed(false)`. */
  itkBooleanMacro(Deformed);

 protected:
  VertexFieldToMeshFilter() { this->AddRequiredInputName("VertexField"); }
  ~VertexFieldToMeshFilter() override = default;

  /** A VertexField has no information to make before its data. */
  void GenerateOutputInformation() override {}
  /** Makes the output. */
  void GenerateData() override;
  /** Prints settings and state, as every class of ITK does. */
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  bool m_Deformed{false};
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkVertexFieldToMeshFilter.hxx"
#endif

#endif
