#ifndef itkPullFieldResampleImageFilter_h
#define itkPullFieldResampleImageFilter_h

#include "itkbridge/displacement_image.h"
#include "itkbridge/itkFieldResampleImageFilter.h"

namespace itk {
/** \class PullFieldResampleImageFilter
 * \brief Deforms an image by a displacement field that maps output to input, as registration gives it.
 *
 * What lies at output point p comes from p + d(p), d linear between the pixels of the displacement field: inside the
 * field's box this is what `ResampleImageFilter` does with a `DisplacementFieldTransform`, to float rounding. Outside
 * that box ITK takes d to be zero; here `SetOutside` says what to do, and refusing is the default. A NaN in the field
 * says that there is no input point.
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

  using Self = PullFieldResampleImageFilter;
  using Superclass = FieldResampleImageFilter<TInputImage, TOutputImage>;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(PullFieldResampleImageFilter, FieldResampleImageFilter);

  using DisplacementFieldType = TDisplacementField;

  /** Input point minus output point, LPS mm. Required. */
  itkSetInputMacro(DisplacementField, DisplacementFieldType);
  itkGetInputMacro(DisplacementField, DisplacementFieldType);

 protected:
  PullFieldResampleImageFilter() { this->AddRequiredInputName("DisplacementField"); }
  ~PullFieldResampleImageFilter() override = default;

  tetwarp::HeldField GetHeldField() override {
    const auto held = m_Held.hold(*this->GetDisplacementField());
    return {tetwarp::PullFieldView{&held->grid, held->displacement}, held};
  }
  void UpdateFieldInput() override {
    this->RequestFieldInput();
    this->Field().Update();
  }
  void RequestFieldInput() override { this->Field().SetRequestedRegionToLargestPossibleRegion(); }

 private:
  DisplacementFieldType& Field() { return *const_cast<DisplacementFieldType*>(this->GetDisplacementField()); }

  tetwarp::DisplacementHolder<DisplacementFieldType> m_Held;
};
}  // namespace itk

#endif
