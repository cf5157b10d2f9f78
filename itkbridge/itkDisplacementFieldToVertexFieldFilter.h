// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkDisplacementFieldToVertexFieldFilter_h
#define itkDisplacementFieldToVertexFieldFilter_h

#include "itkbridge/displacement_image.h"
#include "itkbridge/itkVertexFieldSource.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace itk {
/** \class DisplacementFieldToVertexFieldFilter
 * \brief Takes a displacement image as a forward field: each pixel is a vertex and goes to its point plus its value.
 *
 * That is what simulations write. The displacement field of a registration says the opposite, where an output point
 * comes from: give it to `PullFieldResampleImageFilter` as it is.
 *
 * An image of `Vector<float, 3>` is used in place (its pixel container is kept, also when the image releases it); other
 * component types are converted. What makes the image may write into the same container when it runs again: the field
 * changes then. Filters of a pipeline see that; who keeps the field longer (`VertexFieldTransform`, a graft)
 * disconnects the image first (`DisconnectPipeline`).
 *
 * \code
 * auto source = itk::DisplacementFieldToVertexFieldFilter<FieldType>::New();
 * source->SetInput(reader->GetOutput());
 * \endcode
 *
 * \sa VertexFieldToDisplacementFieldFilter
 * \ingroup DisplacementField Tetwarp */
template <typename TDisplacementField = Image<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT DisplacementFieldToVertexFieldFilter : public VertexFieldSource {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(DisplacementFieldToVertexFieldFilter);

  /** This class. */
  using Self = DisplacementFieldToVertexFieldFilter;
  /** The class from which this one is derived. */
  using Superclass = VertexFieldSource;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(DisplacementFieldToVertexFieldFilter, VertexFieldSource);

  /** Image of displacements. */
  using DisplacementFieldType = TDisplacementField;

  /** Inputs of ITK's process objects. */
  using Superclass::SetInput;
  /** The displacement image: deformed minus undeformed point, LPS mm. Required. */
  void SetInput(const DisplacementFieldType* image) {
    this->ProcessObject::SetNthInput(0, const_cast<DisplacementFieldType*>(image));
  }
  /** The displacement image. */
  const DisplacementFieldType* GetInput() const {
    return static_cast<const DisplacementFieldType*>(this->GetPrimaryInput());
  }

 protected:
  DisplacementFieldToVertexFieldFilter() { this->SetNumberOfRequiredInputs(1); }
  ~DisplacementFieldToVertexFieldFilter() override = default;

  /** A VertexField has no information to make before its data. */
  void GenerateOutputInformation() override {}
  /** Makes the output. */
  void GenerateData() override {
    tetwarp::translate_errors(*this, [this] {
      const auto held = tetwarp::hold_displacements(*this->GetInput());
      this->GetOutput()->SetView({.lattice = &held->grid, .displacement = held->displacement}, held);
    });
  }
};
}  // namespace itk

#endif
