// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldResampleAdjointImageFilter_hxx
#define itkVertexFieldResampleAdjointImageFilter_hxx

#include "itkbridge/itkVertexFieldResampleAdjointImageFilter.h"

namespace itk {

template <typename TImage>
VertexFieldResampleAdjointImageFilter<TImage>::VertexFieldResampleAdjointImageFilter() {
  this->AddRequiredInputName("VertexField");
  this->AddOptionalInputName("SourceImage");
}

template <typename TImage>
tetwarp::HeldField VertexFieldResampleAdjointImageFilter<TImage>::GetHeldField() {
  const VertexField* const field = this->GetVertexField();
  return {field->GetView(), field->GetOwner()};
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::GenerateDefaultGrid() {
  this->GetOutput()->CopyInformation(this->GetSourceImage() ? this->GetSourceImage() : this->GetInput());
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::GenerateOutputInformation() {
  Superclass::GenerateOutputInformation();
  this->GetOutput()->SetNumberOfComponentsPerPixel(this->GetInput()->GetNumberOfComponentsPerPixel());
  const ImageType* const source = this->GetSourceImage();
  if (source && tetwarp::geometry_of(*source) != tetwarp::geometry_of(*this->GetOutput()))
    itkExceptionMacro(<< "the output's grid, which was set, is not that of the source image");
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::GenerateInputRequestedRegion() {
  const_cast<VertexField*>(this->GetVertexField())->SetRequestedRegionToLargestPossibleRegion();
  const_cast<ImageType*>(this->GetInput())->SetRequestedRegionToLargestPossibleRegion();
  if (this->GetSourceImage())
    const_cast<ImageType*>(this->GetSourceImage())->SetRequestedRegionToLargestPossibleRegion();
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::EnlargeOutputRequestedRegion(DataObject* output) {
  output->SetRequestedRegionToLargestPossibleRegion();
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::GenerateData() {
  this->AllocateOutputs();
  m_DisplacementGradient.clear();
  const ImageType* const source = this->GetSourceImage();
  const tetwarp::Geometry deformed = tetwarp::geometry_of(*this->GetInput()),
                          undeformed = tetwarp::geometry_of(*this->GetOutput());
  tetwarp::AdjointTarget target;
  target.source_gradient = tetwarp::view_of(*this->GetOutput(), undeformed);
  target.output_gradient = tetwarp::view_of(*this->GetInput(), deformed);
  target.source = target.source_gradient;
  target.source.voxels = nullptr;
  if (source) target.source = tetwarp::view_of(*source, undeformed);
  target.interpolation = m_Interpolation;
  tetwarp::FieldView field = this->GetVertexField()->GetView(this->GetOutside());
  std::vector<glm::vec3> gradient(source ? static_cast<std::size_t>(tetwarp::vertex_count(field)) : 0);
  this->SetUsedBackend(
      tetwarp::apply_adjoint(*this, deformed, field, this->GetPipelineOptions(), {&target, 1}, {gradient}));
  m_DisplacementGradient = std::move(gradient);
}

template <typename TImage>
void VertexFieldResampleAdjointImageFilter<TImage>::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "Interpolation: " << m_Interpolation << std::endl;
  os << indent << "DisplacementGradient: " << m_DisplacementGradient.size() << " vertices" << std::endl;
}

}  // namespace itk

#endif
