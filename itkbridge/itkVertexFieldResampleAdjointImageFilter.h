// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldResampleAdjointImageFilter_h
#define itkVertexFieldResampleAdjointImageFilter_h

#include <itkImageToImageFilter.h>

#include "itkbridge/itkOutputGridFilter.h"
#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldResampleAdjointImageFilter
 * \brief The transpose of `VertexFieldResampleImageFilter`: takes a gradient on the grid of the deformed image back to
 * the grid of the image that was deformed.
 *
 * For a field, `VertexFieldResampleImageFilter` with a default pixel value of 0 is a linear map W of images. This
 * filter gives W' c: each voxel gives its value to those voxels from which it was interpolated, by their weights. So it
 * is the gradient with respect to the image of any cost whose gradient with respect to the deformed image is c. Every
 * run gives the same bits, on every backend (docs/design/definition.md).
 *
 * With the image that was deformed (`SetSourceImage`) it also finds the gradient with respect to the displacement of
 * each vertex, `GetDisplacementGradient`.
 *
 * The input lies on the grid of the deformed image. The output's grid is that of the image that was deformed: of the
 * source image where it is set, else as `OutputGridFilter` says, by default that of the input. The output is made
 * whole. Pixels are float or double, or arrays of them. Gradients are not streamed: where they do not fit into
 * `SetDeviceMemory`, the update throws.
 *
 * \code
 * auto adjoint = itk::VertexFieldResampleAdjointImageFilter<itk::Image<float, 3>>::New();
 * adjoint->SetInput(costGradient);
 * adjoint->SetVertexField(field);
 * adjoint->SetSourceImage(moving);
 * adjoint->Update();
 * const std::vector<glm::vec3> & perVertex = adjoint->GetDisplacementGradient();  // per mm, LPS
 * \endcode
 *
 * \sa VertexFieldResampleImageFilter
 * \ingroup GeometricTransforms Tetwarp */
template <typename TImage>
class ITK_TEMPLATE_EXPORT VertexFieldResampleAdjointImageFilter
    : public OutputGridFilter<ImageToImageFilter<TImage, TImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldResampleAdjointImageFilter);

  /** This class. */
  using Self = VertexFieldResampleAdjointImageFilter;
  /** The class from which this one is derived. */
  using Superclass = OutputGridFilter<ImageToImageFilter<TImage, TImage>>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldResampleAdjointImageFilter, OutputGridFilter);

  /** Type of the images. */
  using ImageType = TImage;
  /** Choices of `SetInterpolation`. */
  using InterpolationEnum = tetwarp::Interpolation;
  static_assert(TImage::ImageDimension == 3, "Tetwarp deforms 3-D images");
  static_assert(std::is_floating_point_v<tetwarp::ComponentOf<TImage>>,
                "there are gradients of float and double alone");

  /** The forward field. Required. */
  itkSetInputMacro(VertexField, VertexField);
  /** The value that `SetVertexField` set. */
  itkGetInputMacro(VertexField, VertexField);

  /** The image that was deformed, for `GetDisplacementGradient`. */
  itkSetInputMacro(SourceImage, ImageType);
  /** The value that `SetSourceImage` set. */
  itkGetInputMacro(SourceImage, ImageType);

  /** How the image was interpolated: `linear` (the default); `nearest` or `cubic` without a source image. */
  itkSetMacro(Interpolation, InterpolationEnum);
  /** The value that `SetInterpolation` set. */
  itkGetConstMacro(Interpolation, InterpolationEnum);

  /** The gradient with respect to the displacement of each vertex, per mm, LPS: those of the lattice, first index
   * fastest, then those of the mesh. Empty without a source image. */
  const std::vector<glm::vec3>& GetDisplacementGradient() const { return m_DisplacementGradient; }

 protected:
  VertexFieldResampleAdjointImageFilter();
  ~VertexFieldResampleAdjointImageFilter() override = default;

  /** The field, up to date. */
  tetwarp::HeldField GetHeldField() override;
  /** The grid of the source image, or of the input. */
  void GenerateDefaultGrid() override;
  /** Gives the output its grid. */
  void GenerateOutputInformation() override;
  /** Requests all inputs whole. */
  void GenerateInputRequestedRegion() override;
  /** Makes the output whole. */
  void EnlargeOutputRequestedRegion(DataObject* output) override;
  /** Makes the output. */
  void GenerateData() override;
  /** Prints settings and state, as every class of ITK does. */
  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  InterpolationEnum m_Interpolation{InterpolationEnum::linear};
  std::vector<glm::vec3> m_DisplacementGradient;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkVertexFieldResampleAdjointImageFilter.hxx"
#endif

#endif
