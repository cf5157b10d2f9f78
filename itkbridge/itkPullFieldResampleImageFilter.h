// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkPullFieldResampleImageFilter_h
#define itkPullFieldResampleImageFilter_h

#include "itkbridge/displacement_image.h"
#include "itkbridge/itkFieldResampleImageFilter.h"

namespace itk {
/** \class PullFieldResampleImageFilter
 * \brief Deforms an image by a displacement field that maps output to input, as registration gives it.
 *
 * What lies at output point p comes from p + d(p), d linear between the pixels of the displacement field: between the
 * outermost of them this is what `ResampleImageFilter` does with a `DisplacementFieldTransform`. Tetwarp rounds each
 * vector to 2^-12 voxel of the output, so its places are off by up to 2^-13 voxel an axis; of vectors that are whole
 * multiples of that, the values agree to float rounding.
 *
 * ITK goes on for half a pixel of the field beyond the outermost ones, with their vectors; further out it takes d to be
 * zero. Here nothing is assumed beyond them: `SetOutside` says what to do, and refusing is the default. With `rest`, d
 * is zero there, from the outermost pixels on. A NaN in the field says that there is no input point, as it does to ITK;
 * but a voxel within 2^-12 of the way from a pixel that has a vector does without a neighbour that has none.
 *
 * \code
 * auto warp = itk::PullFieldResampleImageFilter<ImageType, FieldType>::New();
 * warp->SetInput(moving);
 * warp->SetDisplacementField(transform->GetDisplacementField());
 * warp->SetOutside(tetwarp::Outside::rest);   // as ITK
 * warp->Update();
 * \endcode
 *
 * A field of `Vector<float, 3>` is used in place; other component types are converted to float.
 *
 * \sa VertexFieldResampleImageFilter
 * \ingroup GeometricTransforms Tetwarp */
template <typename TInputImage, typename TDisplacementField = Image<Vector<float, 3>, 3>,
          typename TOutputImage = TInputImage>
class ITK_TEMPLATE_EXPORT PullFieldResampleImageFilter : public FieldResampleImageFilter<TInputImage, TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(PullFieldResampleImageFilter);

  /** This class. */
  using Self = PullFieldResampleImageFilter;
  /** The class from which this one is derived. */
  using Superclass = FieldResampleImageFilter<TInputImage, TOutputImage>;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(PullFieldResampleImageFilter, FieldResampleImageFilter);

  /** Image of displacements. */
  using DisplacementFieldType = TDisplacementField;

  /** The pull field: input point minus output point, LPS mm. Required. */
  itkSetInputMacro(DisplacementField, DisplacementFieldType);
  /** The value that `SetDisplacementField` set. */
  itkGetInputMacro(DisplacementField, DisplacementFieldType);

 protected:
  PullFieldResampleImageFilter() { this->AddRequiredInputName("DisplacementField"); }
  ~PullFieldResampleImageFilter() override = default;

  /** The field, up to date. */
  tetwarp::HeldField GetHeldField() override {
    const auto held = m_Held.hold(*this->GetDisplacementField());
    return {tetwarp::PullFieldView{&held->grid, held->displacement}, held};
  }
  /** Lets the pipeline make the whole field. */
  void UpdateFieldInput() override {
    this->RequestFieldInput();
    this->Field().Update();
  }
  /** Requests the whole field. */
  void RequestFieldInput() override { this->Field().SetRequestedRegionToLargestPossibleRegion(); }

 private:
  DisplacementFieldType& Field() { return *const_cast<DisplacementFieldType*>(this->GetDisplacementField()); }

  tetwarp::DisplacementHolder<DisplacementFieldType> m_Held;
};
}  // namespace itk

#endif
