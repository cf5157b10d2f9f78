#ifndef itkVertexFieldToInverseDisplacementFieldFilter_h
#define itkVertexFieldToInverseDisplacementFieldFilter_h

#include <itkVector.h>

#include "itkbridge/itkVertexFieldToImageFilter.h"

namespace itk {
/** \class VertexFieldToInverseDisplacementFieldFilter
 * \brief The exact inverse of a forward field, as a displacement field of ITK: undeformed minus deformed point, LPS mm.
 *
 * Exact at each voxel centre: the owner's affine map is inverted, nothing is iterated. `DisplacementFieldTransform` and
 * `WarpImageFilter` take it. It is NaN where no tetrahedron owns the voxel, so where there is no inverse.
 *
 * \code
 * auto inverse = itk::VertexFieldToInverseDisplacementFieldFilter<>::New();
 * inverse->SetVertexField(field);
 * inverse->SetReferenceImage(image);
 * inverse->UseReferenceImageOn();
 * inverse->Update();
 * \endcode
 *
 * \sa ExactInvertDisplacementFieldImageFilter
 * \ingroup DisplacementField Tetwarp */
template <typename TOutputImage = Image<Vector<float, 3>, 3>>
class ITK_TEMPLATE_EXPORT VertexFieldToInverseDisplacementFieldFilter : public VertexFieldToImageFilter<TOutputImage> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(VertexFieldToInverseDisplacementFieldFilter);

  using Self = VertexFieldToInverseDisplacementFieldFilter;
  using Superclass = VertexFieldToImageFilter<TOutputImage>;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkNewMacro(Self);
  itkTypeMacro(VertexFieldToInverseDisplacementFieldFilter, VertexFieldToImageFilter);

  static_assert(sizeof(typename TOutputImage::PixelType) == 3 * sizeof(float) &&
                    std::is_same<tetwarp::ComponentOf<TOutputImage>, float>::value,
                "the output's pixels must be three floats, such as Vector<float, 3>");

 protected:
  VertexFieldToInverseDisplacementFieldFilter() = default;
  ~VertexFieldToInverseDisplacementFieldFilter() override = default;

  tetwarp::Maps GetMaps(const tetwarp::VolumeView& output) const override { return {.inverse_mm = output}; }
};
}  // namespace itk

#endif
