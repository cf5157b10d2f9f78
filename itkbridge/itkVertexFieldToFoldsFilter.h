// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToFoldsFilter_h
#define itkVertexFieldToFoldsFilter_h

#include "itkbridge/itkVertexFieldToImageFilter.h"

namespace itk {
/** \class VertexFieldToFoldsFilter
 * \brief How many tetrahedra of a forward field own each voxel.
 *
 * 1 nearly everywhere; 0 where no tetrahedron comes to lie, so in opened cuts and outside the deformed lattice, also
 * where `SetOutside` lets voxels rest; more than 1 where the field folds. It saturates at 65535.
 *
 * \code
 * auto folds = itk::VertexFieldToFoldsFilter<>::New();
 * folds->SetVertexField(field);
 * folds->SetOutputParametersFromImage(image);
 * folds->Update();
 * \endcode
 *
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<unsigned short, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToFoldsFilter : public VertexFieldToImageFilter<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToFoldsFilter);

  /** This class. */
  using Self = VertexFieldToFoldsFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldToImageFilter<TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToFoldsFilter, VertexFieldToImageFilter);

  static_assert(std::is_same<typename TOutputImage::PixelType, unsigned short>::value,
                "the output's pixels must be unsigned short");

 protected:
  VertexFieldToFoldsFilter() = default;
  ~VertexFieldToFoldsFilter() override = default;

  /** The map that fills the output. */
  tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const override { return {.owners = output}; }
};
}  // namespace itk

#endif
