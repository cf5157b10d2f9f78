// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkFieldResampleImageFilter_h
#define itkFieldResampleImageFilter_h

#include <itkImageToImageFilter.h>

#include "itkbridge/itkOutputGridFilter.h"

namespace itk {
/** \class FieldResampleImageFilter
 * \brief What `VertexFieldResampleImageFilter` and `PullFieldResampleImageFilter` share: an image goes through a field.
 *
 * Pixels may be scalars of 8, 16 or 32 bits, float, double, or arrays of them (`RGBPixel`, `Vector`, `VectorImage` and
 * so on): each component is interpolated alone, vectors are not turned. Integers round to nearest, ties to even, and
 * saturate; ITK's own filters truncate. The image's buffer is read, and the output's written, in place. Of the input
 * only the region is requested that a requested region of the output needs; for that the field is brought up to date
 * first.
 *
 * \ingroup GeometricTransforms Tetwarp */
template <typename TInputImage, typename TOutputImage = TInputImage>
class ITK_TEMPLATE_EXPORT FieldResampleImageFilter
    : public OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(FieldResampleImageFilter);

  using Self = FieldResampleImageFilter;
  using Superclass = OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>>;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(FieldResampleImageFilter, OutputGridFilter);

  using InputImageType = TInputImage;
  using OutputImageType = TOutputImage;
  using PixelType = typename OutputImageType::PixelType;
  using InterpolationEnum = tetwarp::Interpolation;
  static_assert(TInputImage::ImageDimension == 3, "Tetwarp deforms 3-D images");
  static_assert(std::is_same<tetwarp::ComponentOf<TInputImage>, tetwarp::ComponentOf<TOutputImage>>::value,
                "input and output pixels must have the same component type");

  /** `nearest`, `linear` (the default), `cubic` (Catmull-Rom), or `vote`, which is for labels. */
  itkSetMacro(Interpolation, InterpolationEnum);
  itkGetConstMacro(Interpolation, InterpolationEnum);

  /** Value where nothing maps; zero by default. All its components must be equal. */
  itkSetMacro(DefaultPixelValue, PixelType);
  itkGetConstReferenceMacro(DefaultPixelValue, PixelType);

  /** Values from `low` to `high` are no data (DICOM Pixel Padding Value) and never mixed into others; images of one
   * component only. */
  void SetPadding(double low, double high);
  void ClearPadding();
  const std::optional<tetwarp::PaddingRange>& GetPadding() const { return m_Padding; }

 protected:
  FieldResampleImageFilter();
  ~FieldResampleImageFilter() override = default;

  /** Lets the pipeline make the whole field, in the phase that asks for regions. */
  virtual void UpdateFieldInput() = 0;
  /** Asks for the whole field. */
  virtual void RequestFieldInput() = 0;

  void GenerateDefaultGrid() override;
  void GenerateOutputInformation() override;
  void GenerateInputRequestedRegion() override;
  void GenerateData() override;
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  double GetBackground() const;

  InterpolationEnum m_Interpolation{InterpolationEnum::linear};
  PixelType m_DefaultPixelValue{};
  std::optional<tetwarp::PaddingRange> m_Padding;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkFieldResampleImageFilter.hxx"
#endif

#endif
