// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldToDisplacementFieldFilter_h
#define itkVertexFieldToDisplacementFieldFilter_h

#include <itkImageSource.h>
#include <itkVector.h>

#include <algorithm>

#include "itkbridge/image_view.h"
#include "itkbridge/itkVertexField.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace itk {
/** \class VertexFieldToDisplacementFieldFilter
 * \brief The displacements of a lattice's vertices as an image: a *forward* field, deformed minus undeformed point, LPS
 * mm.
 *
 * What ITK's `WarpImageFilter` and `DisplacementFieldTransform` take is the inverse, which
 * `VertexFieldToInverseDisplacementFieldFilter` makes. The image has a pixel for each vertex. The field is brought up
 * to date when the pipeline asks for information, for its lattice is the image's grid. Throws for a field in device
 * memory, and for one with a mesh.
 *
 * \code
 * auto image = itk::VertexFieldToDisplacementFieldFilter<>::New();
 * image->SetVertexField(field);
 * \endcode
 *
 * \sa DisplacementFieldToVertexFieldFilter
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToDisplacementFieldFilter : public ImageSource<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToDisplacementFieldFilter);

  /** This class. */
  using Self = VertexFieldToDisplacementFieldFilter;
  /** The class from which this one is derived. */
  using Superclass = ImageSource<TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToDisplacementFieldFilter, ImageSource);

  static_assert(TOutputImage::ImageDimension == 3, "Tetwarp deforms 3-D images");
  static_assert(sizeof(typename TOutputImage::PixelType) == 3 * sizeof(tetwarp::ComponentOf<TOutputImage>),
                "the output's pixels must be three numbers, such as Vector<float, 3>");

  /** The forward field. Required. */
  itkSetInputMacro(VertexField, VertexField);
  /** The value that `SetVertexField` set. */
  itkGetInputMacro(VertexField, VertexField);

 protected:
  VertexFieldToDisplacementFieldFilter() { this->AddRequiredInputName("VertexField"); }
  ~VertexFieldToDisplacementFieldFilter() override = default;

  /** Gives the output the grid of the lattice, for which the field must be up to date. */
  void GenerateOutputInformation() override {
    const_cast<VertexField*>(this->GetVertexField())->Update();
    const tetwarp::FieldView view = this->GetVertexField()->GetView();
    if (view.mesh) itkExceptionMacro(<< "a field with a mesh is no image; see VertexFieldToMeshFilter");
    if (view.memory != tetwarp::Memory::host) itkExceptionMacro(<< "the field is in device memory");
    tetwarp::set_geometry(*this->GetOutput(), *view.lattice);
  }
  /** Makes the whole output, whatever region is requested. */
  void EnlargeOutputRequestedRegion(DataObject* output) override {
    output->SetRequestedRegionToLargestPossibleRegion();
  }
  /** Makes the output. */
  void GenerateData() override {
    this->AllocateOutputs();
    const tetwarp::FieldView view = this->GetVertexField()->GetView();
    using Component = tetwarp::ComponentOf<TOutputImage>;
    const auto* const from = reinterpret_cast<const float*>(view.displacement);
    auto* const to = reinterpret_cast<Component*>(this->GetOutput()->GetBufferPointer());
    const auto values = 3 * static_cast<std::size_t>(tetwarp::voxel_count(*view.lattice));
    std::transform(from, from + values, to, [](float value) { return static_cast<Component>(value); });
  }
};
}  // namespace itk

#endif
