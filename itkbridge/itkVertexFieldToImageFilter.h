// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToImageFilter_h
#define itkVertexFieldToImageFilter_h

#include <itkImageSource.h>

#include "itkbridge/itkOutputGridFilter.h"
#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldToImageFilter
 * \brief What filters share that say something of a forward field at each voxel of an output grid.
 *
 * The grid must be set, by a reference image or by its numbers.
 *
 * \ingroup Tetwarp */
template <typename TOutputImage>
class ITK_TEMPLATE_EXPORT VertexFieldToImageFilter : public OutputGridFilter<ImageSource<TOutputImage>> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToImageFilter);

  using Self = VertexFieldToImageFilter;
  using Superclass = OutputGridFilter<ImageSource<TOutputImage>>;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(VertexFieldToImageFilter, OutputGridFilter);

  /** Where the vertices go. Required. */
  itkSetInputMacro(VertexField, VertexField);
  itkGetInputMacro(VertexField, VertexField);

 protected:
  VertexFieldToImageFilter() { this->AddRequiredInputName("VertexField"); }
  ~VertexFieldToImageFilter() override = default;

  /** Which map of the resampler the output is. */
  virtual tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const = 0;

  tetwarp::HeldField GetHeldField() override {
    const VertexField* const field = this->GetVertexField();
    return {field->GetView(), field->GetOwner()};
  }
  void GenerateDefaultGrid() override {
    itkExceptionMacro(
        << "no output grid: set a reference image (and UseReferenceImageOn), or size, spacing, origin and "
           "direction");
  }
  /** The reference image's pixels are not asked for. */
  void GenerateInputRequestedRegion() override {}
  void GenerateData() override {
    this->AllocateOutputs();
    this->ResampleRequestedRegion([this](const tetwarp::VolumeView& output, std::vector<tetwarp::Target>&,
                                         tetwarp::Maps& maps) { maps = this->GetMaps(output); });
  }
};
}  // namespace itk

#endif
