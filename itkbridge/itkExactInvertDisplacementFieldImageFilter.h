// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkExactInvertDisplacementFieldImageFilter_h
#define itkExactInvertDisplacementFieldImageFilter_h

#include <itkImageToImageFilter.h>
#include <itkVector.h>

#include "itkbridge/displacement_image.h"
#include "itkbridge/itkOutputGridFilter.h"

namespace itk {
/** \class ExactInvertDisplacementFieldImageFilter
 * \brief The exact inverse of a forward displacement field.
 *
 * The input says where each of its pixels goes (LPS mm); between pixels the map is affine in each of five tetrahedra a
 * cell. The output says of each voxel where it comes from, undeformed minus deformed point: nothing is iterated,
 * nothing is set to zero at the border. It is NaN where there is no inverse: nothing comes to lie there. Where the
 * field folds, the tetrahedron of the lowest number is inverted. Vertices are rounded to 2^-12 voxel of the output, so
 * it is off by about 2^-13 voxel an axis.
 *
 * It takes the place of `InvertDisplacementFieldImageFilter`, whose input is forward and whose output is its inverse,
 * too. That one inverts a trilinear field, and comes closer than 2^-13 voxel where its iteration converges; by default
 * it stops before, holds the border at zero, and has a vector where there is no inverse (docs/reference/itk.md). The
 * output's grid is the input's unless it is set.
 *
 * \code
 * auto invert = itk::ExactInvertDisplacementFieldImageFilter<FieldType>::New();
 * invert->SetInput(forward);
 * invert->Update();
 * transform->SetDisplacementField(invert->GetOutput());   // a DisplacementFieldTransform<float, 3>
 * \endcode
 *
 * \sa VertexFieldToInverseDisplacementFieldFilter
 * \ingroup DisplacementField Tetwarp */
template <typename TInputImage, typename TOutputImage = Image<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT ExactInvertDisplacementFieldImageFilter
    : public OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(ExactInvertDisplacementFieldImageFilter);

  /** This class. */
  using Self = ExactInvertDisplacementFieldImageFilter;
  /** The class from which this one is derived. */
  using Superclass = OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(ExactInvertDisplacementFieldImageFilter, OutputGridFilter);

  static_assert(TInputImage::ImageDimension == 3, "Tetwarp deforms 3-D images");
  static_assert(sizeof(typename TOutputImage::PixelType) == 3 * sizeof(float) &&
                    std::is_same<tetwarp::ComponentOf<TOutputImage>, float>::value,
                "the output's pixels must be three floats, such as Vector<float, 3>");

 protected:
  ExactInvertDisplacementFieldImageFilter() = default;
  ~ExactInvertDisplacementFieldImageFilter() override = default;

  /** The field, up to date. */
  tetwarp::HeldField GetHeldField() override {
    const auto held = m_Held.hold(*this->GetInput());
    return {tetwarp::FieldView{&held->grid, held->displacement}, held};
  }
  /** The grid of the input. */
  void GenerateDefaultGrid() override { this->GetOutput()->CopyInformation(this->GetInput()); }
  /** Requests the whole input, for any part of it may come to lie in a region of the output. */
  void GenerateInputRequestedRegion() override {
    const_cast<TInputImage*>(this->GetInput())->SetRequestedRegionToLargestPossibleRegion();
  }
  /** Makes the output. */
  void GenerateData() override {
    this->AllocateOutputs();
    this->ResampleRequestedRegion([](const tetwarp::VolumeView& output, std::vector<tetwarp::Target>&,
                                     tetwarp::Maps& maps) { maps.inverse_mm = output; });
  }

 private:
  tetwarp::DisplacementHolder<TInputImage> m_Held;
};
}  // namespace itk

#endif
