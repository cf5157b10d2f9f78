// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkFieldResampleImageFilter_h
#define itkFieldResampleImageFilter_h

#include <itkImageToImageFilter.h>

#include "itkbridge/itkOutputGridFilter.h"

namespace itk {
/** \class FieldResampleImageFilter
 * \brief Base of `VertexFieldResampleImageFilter` and `PullFieldResampleImageFilter`: deforms an image by a field.
 *
 * Pixels may be scalars of 8, 16 or 32 bits, float, double, or arrays of them (`RGBPixel`, `Vector`, `VectorImage` and
 * so on): each component is interpolated alone, vectors are not turned. Integers round to nearest, ties to even, and
 * saturate; ITK's own filters truncate. The image's buffer is read, and the output's written, in place. Only that
 * part of the input is requested which a requested region of the output needs; for that the field is updated first.
 *
 * \ingroup GeometricTransforms Tetwarp */
template <typename TInputImage, typename TOutputImage = TInputImage>
class ITK_TEMPLATE_EXPORT FieldResampleImageFilter
    : public OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(FieldResampleImageFilter);

  /** This class. */
  using Self = FieldResampleImageFilter;
  /** The class from which this one is derived. */
  using Superclass = OutputGridFilter<ImageToImageFilter<TInputImage, TOutputImage>>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(FieldResampleImageFilter, OutputGridFilter);

  /** Type of the image that is deformed. */
  using InputImageType = TInputImage;
  /** Type of the output. */
  using OutputImageType = TOutputImage;
  /** Type of a pixel of the output. */
  using PixelType = typename OutputImageType::PixelType;
  /** Choices of `SetInterpolation`. */
  using InterpolationEnum = tetwarp::Interpolation;
  static_assert(TInputImage::ImageDimension == 3, "Tetwarp deforms 3-D images");
  static_assert(std::is_same<tetwarp::ComponentOf<TInputImage>, tetwarp::ComponentOf<TOutputImage>>::value,
                "input and output pixels must have the same component type");

  /** How values are made between voxels: `nearest`, `linear` (the default), `cubic` (Catmull-Rom), or `vote`, which is
   * for labels. */
  itkSetMacro(Interpolation, InterpolationEnum);
  /** The value that `SetInterpolation` set. */
  itkGetConstMacro(Interpolation, InterpolationEnum);

  /** The value where nothing maps; 0 by default. All its components must be equal. */
  itkSetMacro(DefaultPixelValue, PixelType);
  /** The value that `SetDefaultPixelValue` set. */
  itkGetConstReferenceMacro(DefaultPixelValue, PixelType);

  /** Values from `low` to `high`, both included, are no data (DICOM Pixel Padding Value, PS3.3 C.7.5.1.1.2) and are
   * never mixed into other values. For images of one component. */
  void SetPadding(double low, double high);
  /** Treats all values as data, which is the default. */
  void ClearPadding();
  /** The range that `SetPadding` set; empty if there is none. */
  const std::optional<tetwarp::PaddingRange>& GetPadding() const { return m_Padding; }

 protected:
  FieldResampleImageFilter();
  ~FieldResampleImageFilter() override = default;

  /** Lets the pipeline make the whole field while regions are requested. */
  virtual void UpdateFieldInput() = 0;
  /** Requests the whole field. */
  virtual void RequestFieldInput() = 0;

  /** The grid of the input. */
  void GenerateDefaultGrid() override;
  /** Gives the output its grid. */
  void GenerateOutputInformation() override;
  /** Requests the whole field and the part of the image that the output region needs. */
  void GenerateInputRequestedRegion() override;
  /** Makes the output. */
  void GenerateData() override;
  /** Prints settings and state, as every class of ITK does. */
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
