// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldResampleImageFilter_h
#define itkVertexFieldResampleImageFilter_h

#include "itkbridge/itkFieldResampleImageFilter.h"
#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldResampleImageFilter
 * \brief Deforms an image by a forward field: each voxel gets what its one owning tetrahedron carried there.
 *
 * No inverse is needed, and none is approximated: in exact arithmetic one deformed tetrahedron owns each voxel of the
 * output, and the image is sampled once, where that voxel was in the undeformed volume (docs/design/definition.md). The
 * program `tetwarp deform` gives the same bits.
 *
 * \code
 * using ImageType = itk::Image<short, 3>;
 * auto warp = itk::VertexFieldResampleImageFilter<ImageType>::New();
 * warp->SetInput(reader->GetOutput());
 * warp->SetVertexField(source->GetOutput());   // of a TransformToVertexFieldFilter, for example
 * warp->SetDefaultPixelValue(-1024);
 * warp->Update();
 * \endcode
 *
 * \sa VertexField, PullFieldResampleImageFilter
 * \ingroup GeometricTransforms Tetwarp */
template <typename TInputImage, typename TOutputImage = TInputImage>
class ITK_TEMPLATE_EXPORT VertexFieldResampleImageFilter : public FieldResampleImageFilter<TInputImage, TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldResampleImageFilter);

  /** This class. */
  using Self = VertexFieldResampleImageFilter;
  /** The class from which this one is derived. */
  using Superclass = FieldResampleImageFilter<TInputImage, TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldResampleImageFilter, FieldResampleImageFilter);

  /** The forward field. Required. */
  itkSetInputMacro(VertexField, VertexField);
  /** The value that `SetVertexField` set. */
  itkGetInputMacro(VertexField, VertexField);

 protected:
  VertexFieldResampleImageFilter() { this->AddRequiredInputName("VertexField"); }
  ~VertexFieldResampleImageFilter() override = default;

  /** The field, up to date. */
  tetwarp::HeldField GetHeldField() override {
    const VertexField* const field = this->GetVertexField();
    return {field->GetView(), field->GetOwner()};
  }
  /** Lets the pipeline make the whole field. */
  void UpdateFieldInput() override { const_cast<VertexField*>(this->GetVertexField())->Update(); }
  /** Requests the whole field. */
  void RequestFieldInput() override {
    const_cast<VertexField*>(this->GetVertexField())->SetRequestedRegionToLargestPossibleRegion();
  }
};
}  // namespace itk

#endif
