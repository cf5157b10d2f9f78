// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToInverseDisplacementFieldFilter_h
#define itkVertexFieldToInverseDisplacementFieldFilter_h

#include <itkVector.h>

#include "itkbridge/itkVertexFieldToImageFilter.h"

namespace itk {
/** \class VertexFieldToInverseDisplacementFieldFilter
 * \brief The exact inverse of a forward field, as a displacement field of ITK: undeformed minus deformed point, LPS mm.
 *
 * Exact at each voxel centre, for vertices rounded to 2^-12 voxel: the owner's affine map is inverted, nothing is
 * iterated. It is NaN where no tetrahedron owns the voxel, so where there is no inverse; with `Outside::rest` it is
 * zero where a voxel beyond the lattice or mesh stays where it is. Where the field folds, the tetrahedron of the lowest
 * number is inverted.
 *
 * `WarpImageFilter` and a `DisplacementFieldTransform` of floats take it; one of doubles, which `ResampleImageFilter`
 * wants unless told otherwise, takes it through a `CastImageFilter`. To ITK a NaN is a place outside the image, but it
 * also loses voxels beside one, where rounding gives that a weight of 1e-15: fill NaN with a place far away first.
 * `PullFieldResampleImageFilter` takes it as it is.
 *
 * \code
 * auto inverse = itk::VertexFieldToInverseDisplacementFieldFilter<>::New();
 * inverse->SetVertexField(field);
 * inverse->SetReferenceImage(image);
 * inverse->UseReferenceImageOn();
 * inverse->Update();
 * \endcode
 *
 * \sa ExactInvertDisplacementFieldImageFilter
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToInverseDisplacementFieldFilter : public VertexFieldToImageFilter<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToInverseDisplacementFieldFilter);

  /** This class. */
  using Self = VertexFieldToInverseDisplacementFieldFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldToImageFilter<TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToInverseDisplacementFieldFilter, VertexFieldToImageFilter);

  static_assert(sizeof(typename TOutputImage::PixelType) == 3 * sizeof(float) &&
                    std::is_same<tetwarp::ComponentOf<TOutputImage>, float>::value,
                "the output's pixels must be three floats, such as Vector<float, 3>");

 protected:
  VertexFieldToInverseDisplacementFieldFilter() = default;
  ~VertexFieldToInverseDisplacementFieldFilter() override = default;

  /** The map that fills the output. */
  tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const override { return {.inverse_mm = output}; }
};
}  // namespace itk

#endif
