// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Volumes through fields, by ITK's filters and by ours.
#include <itkDisplacementFieldTransform.h>
#include <itkImageFileWriter.h>
#include <itkInvertDisplacementFieldImageFilter.h>
#include <itkResampleImageFilter.h>
#include <itkWarpImageFilter.h>

#include "bench/itk/itk_images.h"
#include "itkbridge/itkDisplacementFieldToVertexFieldFilter.h"
#include "itkbridge/itkPullFieldResampleImageFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"

namespace tetwarp::bench {

namespace {

constexpr std::int16_t kBackground = -1024;

using Transform = itk::DisplacementFieldTransform<float, 3>;
using Resample = itk::ResampleImageFilter<ItkImage, ItkImage, double, float>;
using Warp = itk::WarpImageFilter<ItkImage, ItkImage, ItkField>;
using Invert = itk::InvertDisplacementFieldImageFilter<ItkField, ItkField>;
using ToVertexField = itk::DisplacementFieldToVertexFieldFilter<ItkField>;
using VertexResample = itk::VertexFieldResampleImageFilter<ItkImage>;
using PullResample = itk::PullFieldResampleImageFilter<ItkImage, ItkField>;
using Filters = std::vector<itk::ProcessObject::Pointer>;

Filters pull(ItkImage* volume, ItkField* inverse) {
  const auto filter = PullResample::New();
  filter->SetInput(volume);
  filter->SetDisplacementField(inverse);
  filter->SetDefaultPixelValue(kBackground);
  filter->SetBackend("cpu");
  return {filter.GetPointer()};
}

Filters itk_resample(ItkImage* volume, ItkField* inverse) {
  const auto transform = Transform::New();
  transform->SetDisplacementField(inverse);
  const auto filter = Resample::New();
  filter->SetInput(volume);
  filter->SetTransform(transform);
  filter->SetOutputParametersFromImage(volume);
  filter->SetDefaultPixelValue(kBackground);
  return {filter.GetPointer()};
}

Warp::Pointer make_warp(ItkImage* volume, ItkField* inverse) {
  const auto filter = Warp::New();
  filter->SetInput(volume);
  filter->SetDisplacementField(inverse);
  filter->SetOutputParametersFromImage(volume);
  filter->SetEdgePaddingValue(kBackground);
  return filter;
}

Filters forward(ItkImage* volume, ItkField* field) {
  const auto vertices = ToVertexField::New();
  vertices->SetInput(field);
  const auto filter = VertexResample::New();
  filter->SetInput(volume);
  filter->SetVertexField(vertices->GetOutput());
  filter->SetDefaultPixelValue(kBackground);
  filter->SetBackend("cpu");
  return {vertices.GetPointer(), filter.GetPointer()};
}

Filters itk_invert_warp(ItkImage* volume, ItkField* field) {
  const auto invert = Invert::New();
  invert->SetInput(field);
  return {invert.GetPointer(), make_warp(volume, invert->GetOutput()).GetPointer()};
}

/// Reads, warps and writes in as many pieces as the request says; the volume is not in memory before. Our filter asks
/// for some slices of it for each piece, which the reader gives back behind it; WarpImageFilter asks for all of them
/// each time, which its reader therefore keeps.
ItkWork make_stream(const ItkRequest& request, const ItkFiles& files) {
  const bool own = request.method == "stream";
  const auto reader = itk_reader<ItkImage>(files.volume());
  const auto writer = itk::ImageFileWriter<ItkImage>::New();
  const ItkField::Pointer field = itk_read<ItkField>(own ? files.forward(request.field, request.cell_size)
                                                         : files.inverse(request.field, request.cell_size));
  reader->UpdateOutputInformation();
  const Filters filters =
      own ? forward(reader->GetOutput(), field) : Filters{make_warp(reader->GetOutput(), field).GetPointer()};
  writer->SetImageIO(itk::MetaImageIO::New());
  writer->SetFileName(files.streamed().string());
  writer->SetInput(dynamic_cast<ItkImage*>(filters.back()->GetOutputs()[0].GetPointer()));
  writer->SetNumberOfStreamDivisions(static_cast<unsigned>(request.divisions));
  return {[=] { writer->Update(); }, bytes_of(*field), [reader, filters] { return std::uint64_t{0}; }};
}

}  // namespace

ItkWork make_itk_image_work(const ItkRequest& request, const ItkFiles& files) {
  const std::string& method = request.method;
  if (method == "stream" || method == "itk-stream") return make_stream(request, files);
  const bool pulls = method == "pull" || method == "itk-resample" || method == "itk-warp";
  if (!pulls && method != "forward" && method != "itk-invert-warp") return {};
  const auto file =
      pulls ? files.inverse(request.field, request.cell_size) : files.forward(request.field, request.cell_size);
  const ItkImage::Pointer volume = itk_read<ItkImage>(files.volume());
  const ItkField::Pointer field = itk_read<ItkField>(file);
  Filters filters;
  if (method == "pull") filters = pull(volume, field);
  if (method == "itk-resample") filters = itk_resample(volume, field);
  if (method == "itk-warp") filters = {make_warp(volume, field).GetPointer()};
  if (method == "forward") filters = forward(volume, field);
  if (method == "itk-invert-warp") filters = itk_invert_warp(volume, field);
  // The warped volume against the source at the true places.
  const auto deviation = [=, truth = files.inverse(request.field, 1)](const ItkImage& found) {
    return with_truth(truth, [&](const TrueInverse& inverse) {
      return compare_volume(values_of(found), values_of(*volume), inverse);
    });
  };
  return image_work<ItkImage>(std::move(filters), bytes_of(*volume) + bytes_of(*field), deviation);
}

}  // namespace tetwarp::bench
