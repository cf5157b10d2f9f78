// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// ITK beside `tetwarp-bench io`.
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkImageSeriesReader.h>
#include <itkImageSeriesWriter.h>
#include <itkMultiThreaderBase.h>
#include <itkNiftiImageIO.h>

#include <cstdio>

#include "bench/io/io_peers.h"
#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

using Image3 = itk::Image<std::int16_t, 3>;
using Image2 = itk::Image<std::int16_t, 2>;

/// Calls ITK and turns its exceptions into ours.
template <class Call>
auto with_itk(const std::string& what, Call call) {
  try {
    return call();
  } catch (const itk::ExceptionObject& error) {
    throw Error("ITK cannot " + what + ": " + error.GetDescription());
  }
}

std::vector<std::int16_t> voxels_of(const Image3& image) {
  const std::int16_t* first = image.GetBufferPointer();
  return {first, first + image.GetLargestPossibleRegion().GetNumberOfPixels()};
}

/// The volume as an image that refers to its voxels. ITK wants them writable, and does not write.
Image3::Pointer image_over(const Volume<std::int16_t>& volume) {
  const Geometry& geometry = volume.geometry;
  auto image = Image3::New();
  Image3::SizeType size;
  Image3::SpacingType spacing;
  Image3::PointType origin;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(geometry.size[axis]);
    spacing[axis] = geometry.spacing[axis];
    origin[axis] = geometry.origin[axis];
  }
  image->SetRegions(Image3::RegionType(size));
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->GetPixelContainer()->SetImportPointer(const_cast<std::int16_t*>(volume.voxels.data()), volume.voxels.size());
  return image;
}

std::vector<std::string> names_in(const std::filesystem::path& folder, std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t k = 1; k <= count; ++k) {
    char name[32];
    std::snprintf(name, sizeof name, "IM%05zu.dcm", k);
    names.push_back((folder / name).string());
  }
  return names;
}

}  // namespace

ItkVolume itk_read_series(const std::filesystem::path& folder) {
  const auto io = itk::GDCMImageIO::New();
  const auto reader = itk::ImageSeriesReader<Image3>::New();
  with_itk("read " + folder.string(), [&] {
    auto names = itk::GDCMSeriesFileNames::New();
    names->SetUseSeriesDetails(false);
    names->SetDirectory(folder.string());
    reader->SetImageIO(io);
    reader->SetFileNames(names->GetInputFileNames());
    reader->Update();
  });
  const auto write = [=](const std::filesystem::path& to) {
    with_itk("write " + to.string(), [&] {
      auto writer = itk::ImageSeriesWriter<Image3, Image2>::New();
      writer->SetInput(reader->GetOutput());
      writer->SetImageIO(io);
      writer->SetFileNames(names_in(to, reader->GetFileNames().size()));
      writer->SetMetaDataDictionaryArray(reader->GetMetaDataDictionaryArray());
      writer->Update();
    });
  };
  return {[=] { return voxels_of(*reader->GetOutput()); }, write};
}

ItkVolume itk_read_nifti(const std::filesystem::path& path) {
  const auto reader = itk::ImageFileReader<Image3>::New();
  with_itk("read " + path.string(), [&] {
    reader->SetImageIO(itk::NiftiImageIO::New());
    reader->SetFileName(path.string());
    reader->Update();
  });
  return {[=] { return voxels_of(*reader->GetOutput()); }};
}

void itk_write_nifti(const std::filesystem::path& path, const Volume<std::int16_t>& volume) {
  with_itk("write " + path.string(), [&] {
    auto writer = itk::ImageFileWriter<Image3>::New();
    writer->SetImageIO(itk::NiftiImageIO::New());
    writer->SetFileName(path.string());
    writer->SetInput(image_over(volume));
    writer->UseCompressionOn();
    writer->Update();
  });
}

void limit_itk_threads(int threads) {
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(static_cast<itk::ThreadIdType>(threads));
}

}  // namespace tetwarp::bench
