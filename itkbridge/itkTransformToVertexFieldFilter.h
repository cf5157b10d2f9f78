// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkTransformToVertexFieldFilter_h
#define itkTransformToVertexFieldFilter_h

#include <itkDataObjectDecorator.h>
#include <itkImageBase.h>
#include <itkTransform.h>

#include "itkbridge/itkVertexFieldSource.h"

namespace itk {
/** \class TransformToVertexFieldFilter
 * \brief Samples a transform on a lattice: each vertex x goes to T(x).
 *
 * So T must map undeformed to deformed points. A transform of a registration maps points of the fixed image to the
 * moving one; register with the two exchanged to get the other, or sample it with `TransformToDisplacementFieldFilter`
 * and give that to `PullFieldResampleImageFilter`.
 *
 * The lattice lies over a reference image, with a vertex every `CellSize` of its voxels, as in `tetwarp deform -f
 * transform.h5`; or it is set by size, spacing, origin and direction.
 *
 * \code
 * auto source = itk::TransformToVertexFieldFilter<>::New();
 * source->SetTransform(moving_to_fixed);
 * source->SetReferenceImage(moving);
 * source->SetCellSize(4);
 * \endcode
 *
 * Vertices are sampled by as many threads as there are work units. Where a B-spline or a displacement field has no
 * value ITK leaves the point where it is, and so does this.
 *
 * \ingroup Tetwarp */
template <typename TParametersValueType = double>
class ITK_TEMPLATE_EXPORT TransformToVertexFieldFilter : public VertexFieldSource {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(TransformToVertexFieldFilter);

  /** This class. */
  using Self = TransformToVertexFieldFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldSource;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(TransformToVertexFieldFilter, VertexFieldSource);

  /** Type of the transform. */
  using TransformType = Transform<TParametersValueType, 3, 3>;
  /** Type of an image that gives a grid. */
  using ReferenceImageBaseType = ImageBase<3>;
  /** Number of samples along each axis. */
  using SizeType = ReferenceImageBaseType::SizeType;
  /** mm between samples along each axis. */
  using SpacingType = ReferenceImageBaseType::SpacingType;
  /** Point, LPS mm. */
  using OriginPointType = ReferenceImageBaseType::PointType;
  /** Matrix whose columns are the directions of the axes. */
  using DirectionType = ReferenceImageBaseType::DirectionType;

  /** The transform, which maps undeformed to deformed points, LPS mm. Required. */
  itkSetGetDecoratedObjectInputMacro(Transform, TransformType);

  /** An image over whose grid the lattice lies. Its pixels are not used. */
  itkSetInputMacro(ReferenceImage, ReferenceImageBaseType);
  /** The value that `SetReferenceImage` set. */
  itkGetInputMacro(ReferenceImage, ReferenceImageBaseType);

  /** Voxels of the reference image between two vertices; 2 by default. The last cells may extend beyond it. */
  itkSetMacro(CellSize, SizeValueType);
  /** The value that `SetCellSize` set. */
  itkGetConstMacro(CellSize, SizeValueType);

  /** Vertices along each axis of a lattice of its own; zero (the default): the reference image gives the lattice. */
  itkSetMacro(Size, SizeType);
  /** The value that `SetSize` set. */
  itkGetConstReferenceMacro(Size, SizeType);
  /** Distance of vertices of a lattice of its own, mm; 1 by default. */
  itkSetMacro(OutputSpacing, SpacingType);
  /** The value that `SetOutputSpacing` set. */
  itkGetConstReferenceMacro(OutputSpacing, SpacingType);
  /** Place of the first vertex of a lattice of its own, LPS mm; 0 by default. */
  itkSetMacro(OutputOrigin, OriginPointType);
  /** The value that `SetOutputOrigin` set. */
  itkGetConstReferenceMacro(OutputOrigin, OriginPointType);
  /** Directions of the axes of a lattice of its own, columns in LPS; the identity by default. */
  itkSetMacro(OutputDirection, DirectionType);
  /** The value that `SetOutputDirection` set. */
  itkGetConstReferenceMacro(OutputDirection, DirectionType);

 protected:
  TransformToVertexFieldFilter();
  ~TransformToVertexFieldFilter() override = default;

  /** A VertexField has no information to make before its data. */
  void GenerateOutputInformation() override {}
  /** Requests nothing: pixels of the reference image are not used. */
  void GenerateInputRequestedRegion() override {}
  /** Makes the output. */
  void GenerateData() override;
  /** Prints settings and state, as every class of ITK does. */
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  tetwarp::Geometry GetLattice() const;

  SizeValueType m_CellSize{2};
  SizeType m_Size;
  SpacingType m_OutputSpacing;
  OriginPointType m_OutputOrigin;
  DirectionType m_OutputDirection;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkTransformToVertexFieldFilter.hxx"
#endif

#endif
