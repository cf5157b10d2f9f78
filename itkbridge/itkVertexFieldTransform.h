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
 * For landmarks, surfaces (`TransformMeshFilter`) and compositions of what lies in the undeformed volume. It is *not*
 * what `ResampleImageFilter` takes, which asks where output points come from. A point is moved by the affine map of the
 * undeformed tetrahedron that holds it, as `deform --points` does; outside the lattice or mesh it stays where it is,
 * and `IsInside` is false. It has no parameters, no inverse, and no derivatives: those jump from one tetrahedron to the
 * next.
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

  using Self = VertexFieldTransform;
  using Superclass = Transform<double, 3, 3>;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldTransform, Transform);

  /** Takes the field as it is now, which must be up to date: it is not updated when points are moved. Clones share it.
   * @param grid  image that volumes are resampled onto: vertices are snapped to 2^-12 of its voxels, as for them
   * Throws ExceptionObject for a field that a resampler refuses. */
  void SetVertexField(const VertexField* field, const ImageBase<3>* grid);

  /** From any number of threads. Throws ExceptionObject before SetVertexField. */
  OutputPointType TransformPoint(const InputPointType& point) const override;
  /** Whether the undeformed lattice or mesh holds the point. */
  bool IsInside(const InputPointType& point) const;

  using Superclass::TransformVector;
  OutputVectorType TransformVector(const InputVectorType&) const override;

  /** There are none. */
  void SetParameters(const ParametersType&) override {}
  void SetFixedParameters(const FixedParametersType&) override {}
  void ComputeJacobianWithRespectToParameters(const InputPointType&, JacobianType&) const override;

 protected:
  VertexFieldTransform() : Superclass(0) {}
  ~VertexFieldTransform() override = default;

  /** A clone shares the field. */
  LightObject::Pointer InternalClone() const override;
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  tetwarp::PointStatus Move(glm::dvec3& point) const;

  std::shared_ptr<const void> m_Owner;
  std::shared_ptr<const tetwarp::PointMover> m_Mover;
};
}  // namespace itk

#endif
