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

  using Self = TransformToVertexFieldFilter;
  using Superclass = VertexFieldSource;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(TransformToVertexFieldFilter, VertexFieldSource);

  using TransformType = Transform<TParametersValueType, 3, 3>;
  using ReferenceImageBaseType = ImageBase<3>;
  using SizeType = ReferenceImageBaseType::SizeType;
  using SpacingType = ReferenceImageBaseType::SpacingType;
  using OriginPointType = ReferenceImageBaseType::PointType;
  using DirectionType = ReferenceImageBaseType::DirectionType;

  /** Maps undeformed to deformed points, LPS mm. Required. */
  itkSetGetDecoratedObjectInputMacro(Transform, TransformType);

  /** An image whose grid the lattice lies over; its pixels are not used. */
  itkSetInputMacro(ReferenceImage, ReferenceImageBaseType);
  itkGetInputMacro(ReferenceImage, ReferenceImageBaseType);

  /** Voxels of the reference image between vertices, 2 by default. The last cells may overhang it. */
  itkSetMacro(CellSize, SizeValueType);
  itkGetConstMacro(CellSize, SizeValueType);

  /** Vertices along each axis of a lattice of its own; zero (the default): the reference image decides. */
  itkSetMacro(Size, SizeType);
  itkGetConstReferenceMacro(Size, SizeType);
  itkSetMacro(OutputSpacing, SpacingType);
  itkGetConstReferenceMacro(OutputSpacing, SpacingType);
  itkSetMacro(OutputOrigin, OriginPointType);
  itkGetConstReferenceMacro(OutputOrigin, OriginPointType);
  itkSetMacro(OutputDirection, DirectionType);
  itkGetConstReferenceMacro(OutputDirection, DirectionType);

 protected:
  TransformToVertexFieldFilter();
  ~TransformToVertexFieldFilter() override = default;

  void GenerateOutputInformation() override {}
  /** The reference image's pixels are not asked for. */
  void GenerateInputRequestedRegion() override {}
  void GenerateData() override;
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
