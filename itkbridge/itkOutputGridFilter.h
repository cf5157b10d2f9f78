// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#ifndef itkOutputGridFilter_h
#define itkOutputGridFilter_h

#include <itkImageBase.h>

#include "itkbridge/enum_text.h"
#include "itkbridge/image_view.h"
#include "itkbridge/pipeline/pipeline_resampler.h"

namespace itk {
/** \class OutputGridFilter
 * \brief What filters share that make an image on an output grid by a field.
 *
 * It stands between such a filter and its ITK base class `TSuperclass`, whose output is one 3-D image.
 *
 * The grid is set as in `ResampleImageFilter`: by a reference image (`SetReferenceImage`, `UseReferenceImageOn`), by
 * `SetSize`, `SetOutputSpacing`, `SetOutputOrigin`, `SetOutputDirection` and `SetOutputStartIndex`, or by
 * `SetOutputParametersFromImage`. A filter that takes an image has that image's grid when neither is done. Only the
 * information of the reference image is used; `SetOutputParametersFromImage` spares the pipeline that reads it.
 *
 * `SetBackend` says where the work is done: `"auto"` (CUDA where a device works, otherwise the CPU: the same bits, and
 * one warning in a process), `"cpu"`, or `"cuda"`, which throws without a device. On the CPU there are as many threads
 * as there are work units, up to the maximum of the multi-threader.
 *
 * Any region may be requested, any number of stream divisions gives the same bits. A field that was prepared is kept
 * for the next region. `ProgressEvent`s come from the thread that called Update, from 0 to 1; `AbortGenerateData` ends
 * the work within 100 ms by `ProcessAborted`. Errors are `ExceptionObject`s.
 *
 * \ingroup Tetwarp */
template <typename TSuperclass>
class ITK_TEMPLATE_EXPORT OutputGridFilter : public TSuperclass {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(OutputGridFilter);

  using Self = OutputGridFilter;
  using Superclass = TSuperclass;
  using Pointer = SmartPointer<Self>;
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(OutputGridFilter, TSuperclass);

  using OutputImageType = typename Superclass::OutputImageType;
  static constexpr unsigned int OutputImageDimension = OutputImageType::ImageDimension;
  static_assert(OutputImageDimension == 3, "Tetwarp deforms 3-D images");

  using SizeType = typename OutputImageType::SizeType;
  using IndexType = typename OutputImageType::IndexType;
  using SpacingType = typename OutputImageType::SpacingType;
  using OriginPointType = typename OutputImageType::PointType;
  using DirectionType = typename OutputImageType::DirectionType;
  using ReferenceImageBaseType = ImageBase<OutputImageDimension>;
  using OutsideEnum = tetwarp::Outside;

  /** Voxels along each axis of the output; zero (the default): see the class. */
  itkSetMacro(Size, SizeType);
  itkGetConstReferenceMacro(Size, SizeType);

  /** Index of the first voxel of the output. */
  itkSetMacro(OutputStartIndex, IndexType);
  itkGetConstReferenceMacro(OutputStartIndex, IndexType);

  /** Millimetres between voxels; 1 by default. */
  itkSetMacro(OutputSpacing, SpacingType);
  itkGetConstReferenceMacro(OutputSpacing, SpacingType);

  /** LPS mm of index (0, 0, 0). */
  itkSetMacro(OutputOrigin, OriginPointType);
  itkGetConstReferenceMacro(OutputOrigin, OriginPointType);

  itkSetMacro(OutputDirection, DirectionType);
  itkGetConstReferenceMacro(OutputDirection, DirectionType);

  /** Takes size, start index, spacing, origin and direction over, now. */
  void SetOutputParametersFromImage(const ReferenceImageBaseType* image);

  /** An image that has the grid wanted; used after UseReferenceImageOn. */
  itkSetInputMacro(ReferenceImage, ReferenceImageBaseType);
  itkGetInputMacro(ReferenceImage, ReferenceImageBaseType);
  itkSetMacro(UseReferenceImage, bool);
  itkGetConstMacro(UseReferenceImage, bool);
  itkBooleanMacro(UseReferenceImage);

  /** What becomes of voxels that the undeformed lattice or mesh (or the grid of a pull field) does not hold:
   * `tetwarp::Outside::refuse` throws (the default), `rest` leaves them where they are, `background` gives them the
   * default pixel value. */
  itkSetMacro(Outside, OutsideEnum);
  itkGetConstMacro(Outside, OutsideEnum);

  /** `auto` (the default), `cpu` or `cuda`. */
  void SetBackend(const std::string& backend);
  const std::string& GetBackend() const { return m_Options.backend; }

  /** Number of the CUDA device. */
  void SetDevice(int device);
  int GetDevice() const { return m_Options.device; }

  /** Bytes on the device for fields, sources and results; what does not fit is streamed through it with the same bits.
   * 0 (the default): what is free there. */
  void SetDeviceMemory(std::uint64_t bytes);
  std::uint64_t GetDeviceMemory() const { return m_Options.device_memory; }

  /** Where the last work was done, `cpu` or `cuda`; empty before. */
  const std::string& GetUsedBackend() const { return m_Resampler.backend(); }

  /** What happened in the last call of GenerateData: voxels covered, tetrahedra inverted and so on. Reports of regions
   * add up (`+=`). */
  const tetwarp::Report& GetReport() const { return m_Report; }

 protected:
  OutputGridFilter();
  ~OutputGridFilter() override = default;

  /** The field, up to date. */
  virtual tetwarp::HeldField GetHeldField() = 0;
  /** Gives the output the grid that it has when none is set. Throws where there is no such grid. */
  virtual void GenerateDefaultGrid() = 0;

  void GenerateOutputInformation() override;
  /** Inputs need not lie on one grid. */
  void VerifyInputInformation() ITKv5_CONST override {}

  /** Gives the resampler the field unless it has it. Whether there was something to do. */
  bool PrepareField(tetwarp::ProgressShare share);
  /** Makes the requested region of the output, which is allocated. `make` turns a view of it into what is asked for:
   * \code
   * void make(const tetwarp::VolumeView & output, std::vector<tetwarp::Target> & targets, tetwarp::Maps & maps);
   * \endcode */
  template <typename TMake>
  void ResampleRequestedRegion(TMake&& make);

  const tetwarp::PipelineResampler& GetResampler() const { return m_Resampler; }

  void PrintSelf(std::ostream& os, Indent indent) const override;

 private:
  SizeType m_Size;
  IndexType m_OutputStartIndex;
  SpacingType m_OutputSpacing;
  OriginPointType m_OutputOrigin;
  DirectionType m_OutputDirection;
  bool m_UseReferenceImage{false};
  OutsideEnum m_Outside{OutsideEnum::refuse};
  tetwarp::PipelineOptions m_Options;
  tetwarp::PipelineResampler m_Resampler;
  tetwarp::Report m_Report;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkOutputGridFilter.hxx"
#endif

#endif
