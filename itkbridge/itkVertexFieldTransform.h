// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldTransform_h
#define itkVertexFieldTransform_h

#include <itkImageBase.h>
#include <itkTransform.h>

#include "deform/points.h"
#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldTransform
 * \brief The forward map of a field as a transform: undeformed to deformed points, LPS mm.
 *
 * It moves landmarks, surfaces (`TransformMeshFilter`) and whatever else lies in the undeformed volume. It is *not* a
 * transform for `ResampleImageFilter`, which needs to know where output points come from. A point is moved by the
 * affine map of the undeformed tetrahedron that holds it, as `deform --points` does; outside the lattice or mesh it
 * stays where it is, and `IsInside` is false. It has no parameters, no inverse, and no derivatives: those jump from one
 * tetrahedron to the next.
 *
 * \code
 * auto transform = itk::VertexFieldTransform::New();
 * transform->SetVertexField(source->GetOutput(), image);
 * const auto moved = transform->TransformPoint(landmark);
 * \endcode
 *
 * \ingroup ITKTransform Tetwarp */
class VertexFieldTransform : public Transform<double, 3, 3> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldTransform);

  /** This class. */
  using Self = VertexFieldTransform;
  /** The class from which this one is derived. */
  using Superclass = Transform<double, 3, 3>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldTransform, Transform);

  /** Takes a field as it is now. It must be up to date, for moving points does not update it. Clones share the field.
   * @param field  forward field. Throws ExceptionObject for one that a resampler refuses.
   * @param grid   image onto whose grid volumes are resampled: vertices are rounded to 2^-12 of its voxels, as for them
   */
  void SetVertexField(const VertexField* field, const ImageBase<3>* grid);

  /** The deformed place of an undeformed point. May be called from any number of threads. Throws ExceptionObject before
   * SetVertexField. */
  OutputPointType TransformPoint(const InputPointType& point) const override;
  /** Whether the undeformed lattice or mesh holds the point. */
  bool IsInside(const InputPointType& point) const;

  /** Other forms of transforming a vector. */
  using Superclass::TransformVector;
  /** Throws ExceptionObject: a vector has no place at which to transform it. */
  OutputVectorType TransformVector(const InputVectorType&) const override;

  /** Does nothing: there are no parameters. */
  void SetParameters(const ParametersType&) override {}
  /** Does nothing: there are no fixed parameters. */
  void SetFixedParameters(const FixedParametersType&) override {}
  /** Throws ExceptionObject: there are no parameters. */
  void ComputeJacobianWithRespectToParameters(const InputPointType&, JacobianType&) const override;

 protected:
  VertexFieldTransform() : Superclass(0) {}
  ~VertexFieldTransform() override = default;

  /** A transform that shares the field. */
  LightObject::Pointer InternalClone() const override;
  /** Prints settings and state, as every class of ITK does. */
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  tetwarp::PointStatus Move(glm::dvec3& point) const;

  std::shared_ptr<const void> m_Owner;
  std::shared_ptr<const tetwarp::PointMover> m_Mover;
};
}  // namespace itk

#endif
