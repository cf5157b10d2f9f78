// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/itk_image_io.h"

#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkVersion.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <mutex>
#include <sstream>
#include <utility>

/// ITK's readers of NRRD and MHA leak where they refuse a file.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libITKNrrdIO\nleak:libITKMetaIO\n"; }

namespace tetwarp {
namespace {

using Component = itk::IOComponentEnum;
constexpr std::pair<VoxelType, Component> kComponents[] = {
    {VoxelType::u8, Component::UCHAR},  {VoxelType::i8, Component::CHAR},    {VoxelType::u16, Component::USHORT},
    {VoxelType::i16, Component::SHORT}, {VoxelType::u32, Component::UINT},   {VoxelType::i32, Component::INT},
    {VoxelType::f32, Component::FLOAT}, {VoxelType::f64, Component::DOUBLE},
};

/// One thread at a time, as ITK 5.2 makes its singletons when they are first used, without a lock, and quiet: ITK's
/// warnings and MetaIO's complaints go to standard error, which is the process's own; a library does not print.
class QuietItk {
 public:
  QuietItk() : turn_(turns()), before_(itk::Object::GetGlobalWarningDisplay()), cerr_(std::cerr.rdbuf(nullptr)) {
    itk::Object::SetGlobalWarningDisplay(false);
  }
  ~QuietItk() {
    itk::Object::SetGlobalWarningDisplay(before_);
    std::cerr.rdbuf(cerr_);  // clears the error state that writing to nothing left
  }
  QuietItk(const QuietItk&) = delete;
  QuietItk& operator=(const QuietItk&) = delete;

 private:
  static std::mutex& turns() {
    static std::mutex mutex;
    return mutex;
  }

  std::lock_guard<std::mutex> turn_;
  bool before_;
  std::streambuf* cerr_;
};

/// The sentence in an ITK exception: one line, without source file, class and address.
std::string reason(const itk::ExceptionObject& error) {
  std::string text = error.GetDescription();
  if (const auto address = text.find("(0x"); address != std::string::npos) {
    if (const auto end = text.find("): ", address); end != std::string::npos) text.erase(0, end + 3);
  }
  if (const auto cause = text.rfind("[nrrd] "); cause != std::string::npos) text.erase(0, cause + 7);
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word && line.size() < 300;) line += (line.empty() ? "" : " ") + word;
  return line.empty() ? "no reason given" : line;
}

itk::ImageIOBase::Pointer open(const std::filesystem::path& path, ItkFormat format) {
  itk::ImageIOBase::Pointer io;
  if (format == ItkFormat::nifti) io = itk::NiftiImageIO::New();
  if (format == ItkFormat::nrrd) io = itk::NrrdImageIO::New();
  if (format == ItkFormat::meta) io = itk::MetaImageIO::New();
  io->SetFileName(path.string());
  return io;
}

void set_region(itk::ImageIOBase& io) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) region.SetSize(axis, io.GetDimensions(axis));
  io.SetIORegion(region);
}

VoxelType voxel_type(const itk::ImageIOBase& io, const std::string& file) {
  const Component component = io.GetComponentType();
  const auto* found = std::ranges::find(kComponents, component, &std::pair<VoxelType, Component>::second);
  if (found == std::end(kComponents)) {
    const bool wide = component == Component::LONG || component == Component::LONGLONG;
    const bool unsigned_wide = component == Component::ULONG || component == Component::ULONGLONG;
    throw InputError("voxels of type " +
                     (wide            ? "int64"
                      : unsigned_wide ? "uint64"
                                      : io.GetComponentTypeAsString(component)) +
                     ", " + file + "; expected integers of 8 to 32 bits, float32 or float64");
  }
  return found->first;
}

int component_count(const itk::ImageIOBase& io, const std::string& file) {
  const auto pixel = io.GetPixelType();
  const bool numbers = pixel == itk::IOPixelEnum::SCALAR || pixel == itk::IOPixelEnum::VECTOR ||
                       pixel == itk::IOPixelEnum::COVARIANTVECTOR || pixel == itk::IOPixelEnum::POINT ||
                       pixel == itk::IOPixelEnum::OFFSET;
  require(numbers, "voxels that are " + io.GetPixelTypeAsString(pixel) + ", " + file + "; expected numbers or vectors");
  return static_cast<int>(io.GetNumberOfComponents());
}

/// ITK normalises NRRD's step vectors twice, which leaves 0.99999999999999989 for 1.
double snapped(double cosine) {
  if (std::abs(std::abs(cosine) - 1) < 1e-15) return std::copysign(1.0, cosine);
  return cosine + 0.0;  // -0 to 0
}

Geometry geometry(const itk::ImageIOBase& io) {
  Geometry grid;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const int a = static_cast<int>(axis);
    grid.size[a] = static_cast<std::int64_t>(io.GetDimensions(axis));
    grid.spacing[a] = io.GetSpacing(axis);
    grid.origin[a] = io.GetOrigin(axis);
    const std::vector<double> direction = io.GetDirection(axis);
    for (int row = 0; row < 3; ++row) grid.direction[a][row] = snapped(direction.at(static_cast<std::size_t>(row)));
  }
  return grid;
}

}  // namespace

std::string itk_version() {
  return std::to_string(itk::Version::GetITKMajorVersion()) + "." + std::to_string(itk::Version::GetITKMinorVersion());
}

ItkImageInfo itk_read_info(const std::filesystem::path& path, ItkFormat format) {
  const QuietItk quiet;
  const std::string file = path.string();
  try {
    const auto io = open(path, format);
    io->ReadImageInformation();
    const unsigned axes = io->GetNumberOfDimensions();
    require(axes == 3, "an image of " + std::to_string(axes) + " axes, " + file + "; expected 3");
    return {geometry(*io), voxel_type(*io, file), component_count(*io, file)};
  } catch (const itk::ExceptionObject& error) {
    throw InputError("unreadable header (" + reason(error) + "), " + file);
  }
}

void itk_read_voxels(const std::filesystem::path& path, ItkFormat format, std::span<std::byte> voxels) {
  const QuietItk quiet;
  try {
    const auto io = open(path, format);
    io->ReadImageInformation();
    set_region(*io);
    const auto bytes = static_cast<std::uint64_t>(io->GetImageSizeInBytes());
    require(bytes == voxels.size(), "a file that changed while it was read, " + path.string() + ": " +
                                        std::to_string(bytes) + " bytes of voxels, expected " +
                                        std::to_string(voxels.size()));
    io->Read(voxels.data());
  } catch (const itk::ExceptionObject& error) {
    throw InputError("unreadable voxels (" + reason(error) + "), " + path.string() + "; is the file whole?");
  }
}

void itk_write(const std::filesystem::path& path, ItkFormat format, const ConstVolumeView& volume, int compression,
               const std::map<std::string, std::string>& metadata) {
  require(volume.geometry && volume.buffered == whole(*volume.geometry),
          "only a whole volume can be written, " + path.string());
  const QuietItk quiet;
  try {
    const auto io = open(path, format);
    const Geometry& grid = *volume.geometry;
    io->SetNumberOfDimensions(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
      const int a = static_cast<int>(axis);
      io->SetDimensions(axis, static_cast<itk::SizeValueType>(grid.size[a]));
      io->SetSpacing(axis, grid.spacing[a]);
      io->SetOrigin(axis, grid.origin[a]);
      io->SetDirection(axis, std::vector<double>{grid.direction[a].x, grid.direction[a].y, grid.direction[a].z});
    }
    io->SetComponentType(std::ranges::find(kComponents, volume.type, &std::pair<VoxelType, Component>::first)->second);
    io->SetNumberOfComponents(static_cast<unsigned>(volume.components));
    io->SetPixelType(volume.components == 1 ? itk::IOPixelEnum::SCALAR : itk::IOPixelEnum::VECTOR);
    io->SetUseCompression(compression > 0);
    if (compression > 0) io->SetCompressionLevel(compression);
    for (const auto& [key, value] : metadata) itk::EncapsulateMetaData(io->GetMetaDataDictionary(), key, value);
    set_region(*io);
    io->Write(volume.voxels);
  } catch (const itk::ExceptionObject& error) {
    throw Error("cannot write (" + reason(error) + "), " + path.string() + "; check folder, rights and free space");
  }
}

}  // namespace tetwarp
