// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToJacobianDeterminantFilter_h
#define itkVertexFieldToJacobianDeterminantFilter_h

#include "itkbridge/itkVertexFieldToImageFilter.h"

namespace itk {
/** \class VertexFieldToJacobianDeterminantFilter
 * \brief How much a forward field enlarges what comes to lie at each voxel of the deformed volume.
 *
 * It is the determinant of the affine map, undeformed to deformed, of the tetrahedron that owns the voxel; negative
 * where that is turned inside out, NaN where none owns it: where the field leaves a place or tears it open. Where the
 * field folds, it is that of the tetrahedron of the lowest number. With `Outside::rest` it is 1 where a voxel beyond
 * the lattice or mesh stays where it is.
 *
 * `DisplacementFieldJacobianDeterminantFilter` takes central differences of a displacement field at that field's own
 * pixels: of a forward field it is this at the undeformed place, of the inverse field its reciprocal here. For affine
 * fields all agree; for others they differ by what the determinant changes over a cell, so half as much in cells half
 * as large. ITK's knows no place that nothing comes to; at the border of its image it misses half of the change; and it
 * is wrong where the image's direction is not the identity, for it takes differences along i, j, k for those along x,
 * y, z.
 *
 * \code
 * auto jacobian = itk::VertexFieldToJacobianDeterminantFilter<>::New();
 * jacobian->SetVertexField(field);
 * jacobian->SetOutputParametersFromImage(image);
 * jacobian->Update();
 * \endcode
 *
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<float, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToJacobianDeterminantFilter : public VertexFieldToImageFilter<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToJacobianDeterminantFilter);

  /** This class. */
  using Self = VertexFieldToJacobianDeterminantFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldToImageFilter<TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToJacobianDeterminantFilter, VertexFieldToImageFilter);

  static_assert(std::is_same<typename TOutputImage::PixelType, float>::value, "the output's pixels must be float");

 protected:
  VertexFieldToJacobianDeterminantFilter() = default;
  ~VertexFieldToJacobianDeterminantFilter() override = default;

  /** The map that fills the output. */
  tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const override { return {.jacobian = output}; }
};
}  // namespace itk

#endif
