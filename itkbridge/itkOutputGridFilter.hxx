// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkOutputGridFilter_hxx
#define itkOutputGridFilter_hxx

#include "itkbridge/itkOutputGridFilter.h"

namespace itk {

template <typename TSuperclass>
OutputGridFilter<TSuperclass>::OutputGridFilter() {
  m_Size.Fill(0);
  m_OutputStartIndex.Fill(0);
  m_OutputSpacing.Fill(1);
  m_OutputOrigin.Fill(0);
  m_OutputDirection.SetIdentity();
  this->AddOptionalInputName("ReferenceImage");
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::SetOutputParametersFromImage(const ReferenceImageBaseType* image) {
  this->SetSize(image->GetLargestPossibleRegion().GetSize());
  this->SetOutputStartIndex(image->GetLargestPossibleRegion().GetIndex());
  this->SetOutputSpacing(image->GetSpacing());
  this->SetOutputOrigin(image->GetOrigin());
  this->SetOutputDirection(image->GetDirection());
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::SetBackend(const std::string& backend) {
  tetwarp::BackendChoice choice{};
  tetwarp::translate_errors(*this, [&] { choice = tetwarp::backend_choice(backend); });
  if (choice == m_Options.backend) return;
  m_Options.backend = choice;
  this->Modified();
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::SetDevice(int device) {
  if (device == m_Options.device) return;
  m_Options.device = device;
  this->Modified();
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::SetDeviceMemory(std::uint64_t bytes) {
  if (bytes == m_Options.device_memory) return;
  m_Options.device_memory = bytes;
  this->Modified();
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::GenerateOutputInformation() {
  OutputImageType* const output = this->GetOutput();
  const ReferenceImageBaseType* const reference = this->GetReferenceImage();
  if (m_UseReferenceImage && !reference)
    itkExceptionMacro(<< "UseReferenceImage is on, but there is no reference image");
  if (m_UseReferenceImage || m_Size != SizeType::Filled(0)) {
    typename OutputImageType::RegionType whole(m_OutputStartIndex, m_Size);
    if (m_UseReferenceImage) whole = reference->GetLargestPossibleRegion();
    output->SetLargestPossibleRegion(whole);
    output->SetSpacing(m_UseReferenceImage ? reference->GetSpacing() : m_OutputSpacing);
    output->SetOrigin(m_UseReferenceImage ? reference->GetOrigin() : m_OutputOrigin);
    output->SetDirection(m_UseReferenceImage ? reference->GetDirection() : m_OutputDirection);
  } else {
    this->GenerateDefaultGrid();
  }
}

template <typename TSuperclass>
tetwarp::PipelineOptions OutputGridFilter<TSuperclass>::GetPipelineOptions() const {
  tetwarp::PipelineOptions options = m_Options;
  options.threads = tetwarp::threads_of(*this);
  return options;
}

template <typename TSuperclass>
bool OutputGridFilter<TSuperclass>::PrepareField(tetwarp::ProgressShare share) {
  tetwarp::HeldField field;
  tetwarp::translate_errors(*this, [&] { field = this->GetHeldField(); });
  std::visit([this](auto& view) { view.outside = m_Outside; }, field.view);
  return m_Resampler.set_field(*this, tetwarp::geometry_of(*this->GetOutput()), field, this->GetPipelineOptions(),
                               share);
}

template <typename TSuperclass>
template <typename TMake>
void OutputGridFilter<TSuperclass>::ResampleRequestedRegion(TMake&& make) {
  constexpr float kFieldShare = 0.25f;  // part of the progress, where a field must be prepared
  OutputImageType* const output = this->GetOutput();
  const tetwarp::Geometry grid = tetwarp::geometry_of(*output);
  const bool is_new = this->PrepareField({0, kFieldShare});
  std::vector<tetwarp::Target> targets;
  tetwarp::Maps maps;
  make(tetwarp::view_of(*output, grid), targets, maps);
  const tetwarp::Region region = tetwarp::region_of(*output, output->GetRequestedRegion());
  m_Report = m_Resampler.resample(*this, region, targets, maps, {is_new ? kFieldShare : 0, 1});
}

template <typename TSuperclass>
void OutputGridFilter<TSuperclass>::PrintSelf(std::ostream& os, Indent indent) const {
  Superclass::PrintSelf(os, indent);
  os << indent << "Size: " << m_Size << std::endl;
  os << indent << "OutputStartIndex: " << m_OutputStartIndex << std::endl;
  os << indent << "OutputSpacing: " << m_OutputSpacing << std::endl;
  os << indent << "OutputOrigin: " << m_OutputOrigin << std::endl;
  os << indent << "OutputDirection: " << m_OutputDirection << std::endl;
  os << indent << "UseReferenceImage: " << (m_UseReferenceImage ? "On" : "Off") << std::endl;
  os << indent << "Outside: " << m_Outside << std::endl;
  os << indent << "Backend: " << this->GetBackend() << std::endl;
  os << indent << "UsedBackend: " << (this->GetUsedBackend().empty() ? "(none yet)" : this->GetUsedBackend())
     << std::endl;
  os << indent << "Device: " << m_Options.device << std::endl;
  os << indent << "DeviceMemory: " << m_Options.device_memory << std::endl;
  os << indent << "Covered: " << m_Report.covered << std::endl;
  os << indent << "Uncovered: " << m_Report.uncovered << std::endl;
  os << indent << "Inverted: " << m_Report.inverted << std::endl;
}

}  // namespace itk

#endif
