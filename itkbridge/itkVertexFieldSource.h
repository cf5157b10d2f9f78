// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkVertexFieldSource_h
#define itkVertexFieldSource_h

#include <itkProcessObject.h>

#include "itkbridge/itkVertexField.h"

namespace itk {
/** \class VertexFieldSource
 * \brief Base of filters that make a VertexField.
 * \ingroup DataSources Tetwarp */
class VertexFieldSource : public ProcessObject {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldSource);

  /** This class. */
  using Self = VertexFieldSource;
  /** The class from which this one is derived. */
  using Superclass = ProcessObject;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(VertexFieldSource, ProcessObject);

  /** The field that this filter makes. */
  VertexField* GetOutput();
  /** The field that this filter makes. */
  const VertexField* GetOutput() const;

  /** Outputs of ITK's process objects. */
  using Superclass::MakeOutput;
  /** An empty VertexField. */
  DataObjectPointer MakeOutput(DataObjectPointerArraySizeType idx) override;

 protected:
  VertexFieldSource();
  ~VertexFieldSource() override = default;

  /** Does nothing: each input has a grid of its own. */
  void VerifyInputInformation() ITKv5_CONST override {}
};
}  // namespace itk

#endif
