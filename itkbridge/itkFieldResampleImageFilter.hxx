// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkFieldResampleImageFilter_hxx
#define itkFieldResampleImageFilter_hxx

#include <cmath>

#include "itkbridge/itkFieldResampleImageFilter.h"

namespace itk {

template <typename TInputImage, typename TOutputImage>
FieldResampleImageFilter<TInputImage, TOutputImage>::FieldResampleImageFilter() {
  m_DefaultPixelValue = NumericTraits<PixelType>::ZeroValue(m_DefaultPixelValue);
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::SetPadding(double low, double high) {
  if (m_Padding && m_Padding->low == low && m_Padding->high == high) return;
  m_Padding = tetwarp::PaddingRange{low, high};
  this->Modified();
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::ClearPadding() {
  if (!m_Padding) return;
  m_Padding.reset();
  this->Modified();
}

template <typename TInputImage, typename TOutputImage>
double FieldResampleImageFilter<TInputImage, TOutputImage>::GetBackground() const {
  using Traits = DefaultConvertPixelTraits<PixelType>;
  const unsigned components = Traits::GetNumberOfComponents(m_DefaultPixelValue);
  if (components == 0) return 0;  // a VariableLengthVector that was never set
  const auto value = [this](unsigned n) {
    return static_cast<double>(Traits::GetNthComponent(static_cast<int>(n), m_DefaultPixelValue));
  };
  for (unsigned n = 1; n < components; ++n) {
    const bool equal = value(n) == value(0) || (std::isnan(value(n)) && std::isnan(value(0)));
    if (!equal)
      itkExceptionMacro(<< "the default pixel value " << m_DefaultPixelValue
                        << " has unequal components; set equal ones");
  }
  return value(0);
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::GenerateDefaultGrid() {
  OutputImageType* const output = this->GetOutput();
  const InputImageType* const input = this->GetInput();
  output->SetLargestPossibleRegion(input->GetLargestPossibleRegion());
  output->SetSpacing(input->GetSpacing());
  output->SetOrigin(input->GetOrigin());
  output->SetDirection(input->GetDirection());
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::GenerateOutputInformation() {
  Superclass::GenerateOutputInformation();
  this->GetOutput()->SetNumberOfComponentsPerPixel(this->GetInput()->GetNumberOfComponentsPerPixel());
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::GenerateInputRequestedRegion() {
  auto* const input = const_cast<InputImageType*>(this->GetInput());
  OutputImageType* const output = this->GetOutput();
  if (output->GetRequestedRegion() == output->GetLargestPossibleRegion()) {
    this->RequestFieldInput();
    input->SetRequestedRegionToLargestPossibleRegion();
    return;
  }
  this->UpdateFieldInput();
  this->SetAbortGenerateData(false);  // it may still be set from an earlier run
  this->PrepareField({0, 0});
  const tetwarp::Region region = this->GetResampler().source_region(
      *this, tetwarp::geometry_of(*input), tetwarp::region_of(*output, output->GetRequestedRegion()));
  input->SetRequestedRegion(tetwarp::itk_region(*input, region));
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::GenerateData() {
  this->AllocateOutputs();
  const InputImageType* const input = this->GetInput();
  const tetwarp::Geometry source = tetwarp::geometry_of(*input);
  this->ResampleRequestedRegion(
      [&](const tetwarp::VolumeView& output, std::vector<tetwarp::Target>& targets, tetwarp::Maps&) {
        targets.push_back({.source = tetwarp::view_of(*input, source),
                           .output = output,
                           .interpolation = m_Interpolation,
                           .background = this->GetBackground(),
                           .padding = m_Padding});
      });
}

template <typename TInputImage, typename TOutputImage>
void FieldResampleImageFilter<TInputImage, TOutputImage>::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "Interpolation: " << m_Interpolation << std::endl;
  os << indent
     << "DefaultPixelValue: " << static_cast<typename NumericTraits<PixelType>::PrintType>(m_DefaultPixelValue)
     << std::endl;
  os << indent << "Padding: ";
  if (m_Padding)
    os << m_Padding->low << " to " << m_Padding->high << std::endl;
  else
    os << "(none)" << std::endl;
}

}  // namespace itk

#endif
