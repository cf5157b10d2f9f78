// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToCoverageFilter_h
#define itkVertexFieldToCoverageFilter_h

#include "itkbridge/itkVertexFieldToImageFilter.h"

namespace itk {
/** \class VertexFieldToCoverageFilter
 * \brief 1 where a forward field brings something to a voxel, 0 where it does not.
 *
 * It does not matter whether an image has a value there. Voxels that rest, by `SetOutside`, are covered.
 *
 * \code
 * auto coverage = itk::VertexFieldToCoverageFilter<>::New();
 * coverage->SetVertexField(field);
 * coverage->SetOutputParametersFromImage(image);
 * coverage->Update();
 * \endcode
 *
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<unsigned char, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToCoverageFilter : public VertexFieldToImageFilter<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToCoverageFilter);

  /** This class. */
  using Self = VertexFieldToCoverageFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldToImageFilter<TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToCoverageFilter, VertexFieldToImageFilter);

  static_assert(std::is_same<typename TOutputImage::PixelType, unsigned char>::value,
                "the output's pixels must be unsigned char");

 protected:
  VertexFieldToCoverageFilter() = default;
  ~VertexFieldToCoverageFilter() override = default;

  /** The map that fills the output. */
  tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const override { return {.coverage = output}; }
};
}  // namespace itk

#endif
