// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexField_h
#define itkVertexField_h

#include <itkDataObject.h>
#include <itkObjectFactory.h>

#include <memory>

#include "deform/vertex_field.h"

namespace itk {
/** \class VertexField
 * \brief A forward deformation: where each vertex of a lattice, or of a mesh of tetrahedra, goes.
 *
 * It says of a point of the undeformed anatomy where that comes to lie, in LPS mm. A displacement field of ITK says the
 * opposite, where an output point comes from (`WarpImageFilter`, `DisplacementFieldTransform`), so this is a type of
 * its own and the two do not convert silently. Between vertices the map is affine in each tetrahedron, five of which
 * make a cell (docs/design/definition.md).
 *
 * It is made by `TransformToVertexFieldFilter`, `DisplacementFieldToVertexFieldFilter`, `MeshToVertexFieldFilter`, or
 * from a `tetwarp::VertexField`, which the simulations and files of the toolkit give:
 *
 * \code
 * auto field = itk::VertexField::New();
 * field->SetField(tetwarp::twist(tetwarp::geometry_of(*image), 0.5, 4));
 * \endcode
 *
 * What it holds is never changed, only replaced: filters keep what they were given.
 *
 * \ingroup DataObjects Tetwarp */
class VertexField : public DataObject {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexField);

  /** This class. */
  using Self = VertexField;
  /** The class from which this one is derived. */
  using Superclass = DataObject;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexField, DataObject);

  /** Takes over a field. Throws ExceptionObject unless there is one displacement for each vertex. */
  void SetField(tetwarp::VertexField field);

  /** Uses a field in place, in host or device memory. What the view points to must not change while `owner` is kept.
   * The view's `outside` is ignored, for filters have their own. */
  void SetView(const tetwarp::FieldView& view, std::shared_ptr<const void> owner);

  /** The field for a resampler. Throws ExceptionObject when there is none. */
  tetwarp::FieldView GetView(tetwarp::Outside outside = tetwarp::Outside::refuse) const;

  /** A copy of this pointer keeps alive what the view points to. Equal pointers are the same field. */
  const std::shared_ptr<const void>& GetOwner() const { return m_Owner; }

  /** The grid of the undeformed vertices. Throws ExceptionObject for a mesh that stands alone. */
  const tetwarp::Geometry& GetLattice() const;

  /** Forgets the field. */
  void Initialize() override;

  /** Shares the field of another VertexField without a copy. Throws ExceptionObject for any other object. */
  void Graft(const DataObject* data) override;

 protected:
  VertexField() = default;
  ~VertexField() override = default;

  /** Prints settings and state, as every class of ITK does. */
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  tetwarp::FieldView m_View;
  std::shared_ptr<const void> m_Owner;
};
}  // namespace itk

#endif
