// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/itkVertexFieldSource.h"

namespace itk {

VertexFieldSource::VertexFieldSource() {
  this->SetNumberOfRequiredOutputs(1);
  this->SetNthOutput(0, this->MakeOutput(0));
}

VertexField* VertexFieldSource::GetOutput() { return static_cast<VertexField*>(this->GetPrimaryOutput()); }

const VertexField* VertexFieldSource::GetOutput() const {
  return static_cast<const VertexField*>(this->GetPrimaryOutput());
}

DataObject::Pointer VertexFieldSource::MakeOutput(DataObjectPointerArraySizeType) {
  return VertexField::New().GetPointer();
}

}  // namespace itk
