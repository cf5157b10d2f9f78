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
 * \brief Base of filters that make an image on an output grid from a field.
 *
 * It stands between such a filter and its ITK base class `TSuperclass`, whose output is one 3-D image.
 *
 * The grid is set as in `ResampleImageFilter`: by a reference image (`SetReferenceImage`, `UseReferenceImageOn`), by
 * `SetSize`, `SetOutputSpacing`, `SetOutputOrigin`, `SetOutputDirection` and `SetOutputStartIndex`, or by
 * `SetOutputParametersFromImage`. If nothing is set, a filter whose input is an image uses the grid of that image. Only
 * the information of a reference image is used, never its pixels.
 *
 * `SetBackend` says where the work is done: `"auto"` (CUDA where a device works, otherwise the CPU: the same bits, and
 * one warning in a process), `"cpu"`, or `"cuda"`, which throws without a device. On the CPU there are as many threads
 * as there are work units, up to the maximum of the multi-threader.
 *
 * Any region may be requested, and any number of stream divisions gives the same bits. The prepared field is kept for
 * the next region. `ProgressEvent`s come from the thread that called Update, from 0 to 1; `AbortGenerateData` ends
 * the work within 100 ms by `ProcessAborted`. Errors are `ExceptionObject`s.
 *
 * \ingroup Tetwarp */
template <typename TSuperclass>
class ITK_TEMPLATE_EXPORT OutputGridFilter : public TSuperclass {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(OutputGridFilter);

  /** This class. */
  using Self = OutputGridFilter;
  /** The class from which this one is derived. */
  using Superclass = TSuperclass;
  /** Pointer that shares ownership. */
  using Pointer = SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = SmartPointer<const Self>;

  itkTypeMacro(OutputGridFilter, TSuperclass);

  /** Type of the output. */
  using OutputImageType = typename Superclass::OutputImageType;
  /** Number of axes, 3. */
  static constexpr unsigned int OutputImageDimension = OutputImageType::ImageDimension;
  static_assert(OutputImageDimension == 3, "Tetwarp deforms 3-D images");

  /** Number of samples along each axis. */
  using SizeType = typename OutputImageType::SizeType;
  /** Index of a voxel. */
  using IndexType = typename OutputImageType::IndexType;
  /** mm between samples along each axis. */
  using SpacingType = typename OutputImageType::SpacingType;
  /** Point, LPS mm. */
  using OriginPointType = typename OutputImageType::PointType;
  /** Matrix whose columns are the directions of the axes. */
  using DirectionType = typename OutputImageType::DirectionType;
  /** Type of an image that gives a grid. */
  using ReferenceImageBaseType = ImageBase<OutputImageDimension>;
  /** Choices of `SetOutside`. */
  using OutsideEnum = tetwarp::Outside;

  /** Number of voxels along each axis of the output; zero (the default): a reference image or the filter's own default
   * decides. */
  itkSetMacro(Size, SizeType);
  /** The value that `SetSize` set. */
  itkGetConstReferenceMacro(Size, SizeType);

  /** Index of the first voxel of the output. */
  itkSetMacro(OutputStartIndex, IndexType);
  /** The value that `SetOutputStartIndex` set. */
  itkGetConstReferenceMacro(OutputStartIndex, IndexType);

  /** Distance of voxels along each axis, mm; 1 by default. */
  itkSetMacro(OutputSpacing, SpacingType);
  /** The value that `SetOutputSpacing` set. */
  itkGetConstReferenceMacro(OutputSpacing, SpacingType);

  /** Place of index (0, 0, 0), LPS mm; 0 by default. */
  itkSetMacro(OutputOrigin, OriginPointType);
  /** The value that `SetOutputOrigin` set. */
  itkGetConstReferenceMacro(OutputOrigin, OriginPointType);

  /** Directions of the axes, columns in LPS; the identity by default. */
  itkSetMacro(OutputDirection, DirectionType);
  /** The value that `SetOutputDirection` set. */
  itkGetConstReferenceMacro(OutputDirection, DirectionType);

  /** Copies size, start index, spacing, origin and direction of an image now. */
  void SetOutputParametersFromImage(const ReferenceImageBaseType* image);

  /** An image with the output's grid, which counts after `UseReferenceImageOn`. */
  itkSetInputMacro(ReferenceImage, ReferenceImageBaseType);
  /** The value that `SetReferenceImage` set. */
  itkGetInputMacro(ReferenceImage, ReferenceImageBaseType);
  /** Whether the reference image gives the grid. Off by default. */
  itkSetMacro(UseReferenceImage, bool);
  /** The value that `SetUseReferenceImage` set. */
  itkGetConstMacro(UseReferenceImage, bool);
  /** Calls `SetUseReferenceImage(true)`; UseReferenceImageOff calls `SetUseReferenceImage(false)`. */
  itkBooleanMacro(UseReferenceImage);

  /** What becomes of voxels outside the undeformed lattice or mesh (or the grid of a pull field):
   * `tetwarp::Outside::refuse` throws (the default), `rest` leaves them where they are, `background` gives them the
   * default pixel value. */
  itkSetMacro(Outside, OutsideEnum);
  /** The value that `SetOutside` set. */
  itkGetConstMacro(Outside, OutsideEnum);

  /** Where the work is done: "auto" (the default), "cpu" or "cuda". */
  void SetBackend(const std::string& backend);
  /** The value that `SetBackend` set. */
  std::string GetBackend() const { return tetwarp::name_of(m_Options.backend); }

  /** Number of the CUDA device; 0 by default. */
  void SetDevice(int device);
  /** The value that `SetDevice` set. */
  int GetDevice() const { return m_Options.device; }

  /** Bytes of device memory for fields, sources and results; 0 (the default): what is free. What does not fit is
   * streamed through the device with the same bits. */
  void SetDeviceMemory(std::uint64_t bytes);
  /** The value that `SetDeviceMemory` set. */
  std::uint64_t GetDeviceMemory() const { return m_Options.device_memory; }

  /** Where the last work was done, "cpu" or "cuda"; empty before. */
  std::string GetUsedBackend() const { return m_UsedBackend.empty() ? m_Resampler.backend() : m_UsedBackend; }

  /** What happened when the output was last made: voxels covered, tetrahedra inverted and so on. Reports of regions add
   * up (`+=`). */
  const tetwarp::Report& GetReport() const { return m_Report; }

 protected:
  OutputGridFilter();
  ~OutputGridFilter() override = default;

  /** The field, up to date. */
  virtual tetwarp::HeldField GetHeldField() = 0;
  /** Gives the output its grid when none is set. Throws where there is no such grid. */
  virtual void GenerateDefaultGrid() = 0;

  /** Gives the output its grid. */
  void GenerateOutputInformation() override;
  /** Does nothing: inputs need not lie on one grid. */
  void VerifyInputInformation() ITKv5_CONST override {}

  /** Gives the resampler the field unless it has it. Returns whether anything had to be done. */
  bool PrepareField(tetwarp::ProgressShare share);
  /** Fills the requested region of the allocated output. `make` turns a view of the output into targets and maps:
   * \code
   * void make(const tetwarp::VolumeView & output, std::vector<tetwarp::Target> & targets, tetwarp::Maps & maps);
   * \endcode */
  template <typename TMake>
  void ResampleRequestedRegion(TMake&& make);

  /** Where the work is to be done, threads included. */
  tetwarp::PipelineOptions GetPipelineOptions() const;
  /** For a filter that does not use the resampler. */
  void SetUsedBackend(const std::string& backend) { m_UsedBackend = backend; }

  /** The resampler with the present field. */
  const tetwarp::PipelineResampler& GetResampler() const { return m_Resampler; }

  /** Prints settings and state, as every class of ITK does. */
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
  std::string m_UsedBackend;  // by other ways than the resampler; else empty
  tetwarp::Report m_Report;
};
}  // namespace itk

#ifndef ITK_MANUAL_INSTANTIATION
#include "itkbridge/itkOutputGridFilter.hxx"
#endif

#endif
