// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToImageFilter_h
#define itkVertexFieldToImageFilter_h

#include <itkImageSource.h>

#include "itkbridge/itkOutputGridFilter.h"
#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldToImageFilter
 * \brief Base of filters that compute a property of a forward field at each voxel of an output grid.
 *
 * The grid must be set, by a reference image or by its numbers.
 *
 * \ingroup Tetwarp */
template <typename TOutputImage>
class ITK_TEMPLATE_EXPORT VertexFieldToImageFilter : public OutputGridFilter<ImageSource<TOutputImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToImageFilter);

  /** This class. */
  using Self = VertexFieldToImageFilter;
  /** The class from which this one is derived. */
  using Superclass = OutputGridFilter<ImageSource<TOutputImage>>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(VertexFieldToImageFilter, OutputGridFilter);

  /** The forward field. Required. */
  itkSetInputMacro(VertexField, VertexField);
  /** The value that `SetVertexField` set. */
  itkGetInputMacro(VertexField, VertexField);

 protected:
  VertexFieldToImageFilter() { this->AddRequiredInputName("VertexField"); }
  ~VertexFieldToImageFilter() override = default;

  /** The map of the resampler that fills the output. */
  virtual tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const = 0;

  /** The field, up to date. */
  tetwarp::HeldField GetHeldField() override {
    const VertexField* const field = this->GetVertexField();
    return {field->GetView(), field->GetOwner()};
  }
  /** Throws, for a field gives no grid to an image. */
  void GenerateDefaultGrid() override {
    itkExceptionMacro(
        << "no output grid: set a reference image (and UseReferenceImageOn), or size, spacing, origin and "
           "direction");
  }
  /** Requests nothing: pixels of the reference image are not used. */
  void GenerateInputRequestedRegion() override {}
  /** Makes the output. */
  void GenerateData() override {
    this->AllocateOutputs();
    this->ResampleRequestedRegion([this](const tetwarp::VolumeView& output, std::vector<tetwarp::Target>&,
                                         tetwarp::Maps& maps) { maps = this->GetMaps(output); });
  }
};
}  // namespace itk

#endif
