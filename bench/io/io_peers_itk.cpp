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

class ReadSeries final : public ItkSeries {
 public:
  explicit ReadSeries(const std::filesystem::path& folder) {
    auto names = itk::GDCMSeriesFileNames::New();
    names->SetUseSeriesDetails(false);
    names->SetDirectory(folder.string());
    reader_->SetImageIO(io_);
    reader_->SetFileNames(names->GetInputFileNames());
    reader_->Update();
  }
  std::vector<std::int16_t> voxels() const override { return voxels_of(*reader_->GetOutput()); }
  void write(const std::filesystem::path& folder) const override {
    with_itk("write " + folder.string(), [&] {
      auto writer = itk::ImageSeriesWriter<Image3, Image2>::New();
      writer->SetInput(reader_->GetOutput());
      writer->SetImageIO(io_);
      writer->SetFileNames(names_in(folder));
      writer->SetMetaDataDictionaryArray(reader_->GetMetaDataDictionaryArray());
      writer->Update();
    });
  }

 private:
  std::vector<std::string> names_in(const std::filesystem::path& folder) const {
    std::vector<std::string> names;
    for (std::size_t k = 1; k <= reader_->GetFileNames().size(); ++k) {
      char name[32];
      std::snprintf(name, sizeof name, "IM%05zu.dcm", k);
      names.push_back((folder / name).string());
    }
    return names;
  }

  itk::GDCMImageIO::Pointer io_ = itk::GDCMImageIO::New();
  itk::ImageSeriesReader<Image3>::Pointer reader_ = itk::ImageSeriesReader<Image3>::New();
};

class ReadNifti final : public ItkVolume {
 public:
  explicit ReadNifti(const std::filesystem::path& path) {
    reader_->SetImageIO(itk::NiftiImageIO::New());
    reader_->SetFileName(path.string());
    reader_->Update();
  }
  std::vector<std::int16_t> voxels() const override { return voxels_of(*reader_->GetOutput()); }

 private:
  itk::ImageFileReader<Image3>::Pointer reader_ = itk::ImageFileReader<Image3>::New();
};

}  // namespace

std::shared_ptr<const ItkSeries> itk_read_series(const std::filesystem::path& folder) {
  return with_itk("read " + folder.string(), [&] { return std::make_shared<ReadSeries>(folder); });
}

std::shared_ptr<const ItkVolume> itk_read_nifti(const std::filesystem::path& path) {
  return with_itk("read " + path.string(), [&] { return std::make_shared<ReadNifti>(path); });
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
