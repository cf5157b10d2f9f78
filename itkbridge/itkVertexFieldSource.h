// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldSource_h
#define itkVertexFieldSource_h

#include <itkProcessObject.h>

#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldSource
 * \brief Base of what makes a VertexField.
 * \ingroup DataSources Tetwarp */
class VertexFieldSource : public ProcessObject {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldSource);

  using Self = VertexFieldSource;
  using Superclass = ProcessObject;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(VertexFieldSource, ProcessObject);

  VertexField* GetOutput();
  const VertexField* GetOutput() const;

  using Superclass::MakeOutput;
  DataObjectPointer MakeOutput(DataObjectPointerArraySizeType idx) override;

 protected:
  VertexFieldSource();
  ~VertexFieldSource() override = default;

  /** Inputs have grids of their own. */
  void VerifyInputInformation() ITKv5_CONST override {}
};
}  // namespace itk

#endif
