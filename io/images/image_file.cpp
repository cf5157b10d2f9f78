// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/image_file.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>

#include "deform/errors.h"
#include "io/files/gzip_inflate.h"
#include "io/images/image_reader.h"
#include "io/images/image_writer.h"
#include "io/images/mha_header.h"
#include "io/images/nifti_file.h"
#include "io/images/nrrd_layout.h"
#include "io/lower_case.h"
#include "io/opened_file.h"

namespace tetwarp {
namespace {

/// A header that promises more voxels than the file can hold is not believed: nothing is allocated for it. Nor is one
/// that leaves bytes over, where the voxels are stored as they are: it is about another volume, or the file is damaged.
void require_file_holds(const std::filesystem::path& path, const ImageHeader& header, const StoredVoxels& stored) {
  double expected = static_cast<double>(header.components) * static_cast<double>(stored.value_bytes);
  for (int axis = 0; axis < 3; ++axis) expected *= static_cast<double>(header.geometry.size[axis]);
  const auto offset = static_cast<double>(stored.offset);
  const double needed = stored.encoded ? (offset + expected) / kDeflateAtMost : expected;
  const double held = static_cast<double>(std::filesystem::file_size(path)) - (stored.encoded ? 0 : offset);
  if (held >= needed && (stored.encoded || held == needed)) return;
  std::ostringstream text;
  text.precision(17);
  text << (held < needed ? "truncated, or a header that promises too much, " : "more bytes than the header says, ")
       << path.string() << ": " << std::max(held, 0.0) << " bytes, but " << to_string(header.geometry.size)
       << " voxels of " << header.components << " x " << stored.value_bytes << " bytes"
       << (stored.encoded ? ", compressed," : "") << " need " << std::ceil(needed)
       << "; is it the header of this file?";
  throw InputError(text.str());
}

std::unique_ptr<ImageReader> open_nrrd(const std::filesystem::path& path) {
  const TextHeader text = read_text_header(path, ImageFormat::nrrd);
  NrrdHeader header = parse_nrrd_header(text, path.string());
  StoredVoxels stored{text.data_offset, size_bytes(header.image.type), header.encoding != Encoding::raw};
  const ValueLayout layout = nrrd_layout(path, text, header, stored.offset);
  return make_value_reader(path, std::move(header.image), stored, layout);
}

std::unique_ptr<ImageReader> open_mha(const std::filesystem::path& path) {
  const TextHeader text = read_text_header(path, ImageFormat::mha);
  ImageHeader header = parse_mha_header(text, path.string());
  const ValueLayout layout = mha_layout(path, text);
  const StoredVoxels stored{text.data_offset, size_bytes(header.type), layout.encoding != Encoding::raw};
  return make_value_reader(path, std::move(header), stored, layout);
}

std::unique_ptr<ImageReader> open_format(const std::filesystem::path& path, ImageFormat format, NiftiFrame frame,
                                         NiftiVectors vectors) {
  switch (format) {
    case ImageFormat::nifti: return open_nifti(path, frame, vectors);
    case ImageFormat::nrrd: return open_nrrd(path);
    case ImageFormat::mha: return open_mha(path);
  }
  return nullptr;
}

std::unique_ptr<ImageWriter> create_format(const std::filesystem::path& path, ImageFormat format, const Geometry& grid,
                                           VoxelType type, int components, const ImageWriteOptions& options) {
  if (format == ImageFormat::nifti) {
    const auto descrip = options.metadata.find("descrip");
    return create_nifti(path, grid, type, components, descrip == options.metadata.end() ? "" : descrip->second,
                        options.compression < 0 ? 1 : options.compression);
  }
  const bool compressed = options.compression > 0;
  const auto make_header = format == ImageFormat::mha ? mha_header : nrrd_header;
  return create_text_image(path, format, grid, type, components,
                           make_header(grid, type, components, options.metadata, compressed), options.compression);
}

void require_whole(const ConstVolumeView& volume, const std::filesystem::path& path) {
  require(volume.geometry && volume.voxels && volume.buffered == whole(*volume.geometry),
          "only a whole volume can be written, " + path.string());
}

ImageFormat required_format(const std::filesystem::path& path) {
  const auto format = image_format(path);
  require(format.has_value(), "an unknown suffix, " + path.string() + "; expected .nii, .nii.gz, .nrrd or .mha");
  return *format;
}

}  // namespace

void require_orthogonal(const Geometry& geometry, const std::string& file) {
  const glm::dmat3& d = geometry.direction;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    require(std::abs(glm::length(d[a]) - 1) <= 1e-4, "a direction of axis " + std::to_string(a) + " with length " +
                                                         std::to_string(glm::length(d[a])) + ", " + file +
                                                         "; expected 1");
    require(std::abs(glm::dot(d[a], d[b])) <= 1e-4,
            "a sheared grid (cosine between axes " + std::to_string(a) + " and " + std::to_string(b) + " is " +
                std::to_string(glm::dot(d[a], d[b])) + "), " + file + "; expected right angles");
  }
}

std::optional<ImageFormat> image_format(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) return ImageFormat::nifti;
  if (name.ends_with(".nrrd")) return ImageFormat::nrrd;
  if (name.ends_with(".mha")) return ImageFormat::mha;
  return std::nullopt;
}

bool has_image_suffix(const std::filesystem::path& path) { return image_format(path).has_value(); }

std::size_t ImageReader::value_count() const {
  return static_cast<std::size_t>(voxel_count(header_.geometry)) * static_cast<std::size_t>(header_.components);
}

void require_readable_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::error_code error;
  const PathKind kind = kind_at(path);
  require(kind != PathKind::nothing, "no such file, " + file);
  require(kind == PathKind::file, "not a file, " + file);
  require(std::filesystem::file_size(path, error) > 0, "an empty file, " + file);
  require(::access(path.c_str(), R_OK) == 0, "a file that may not be read, " + file + "; check its rights");
}

std::unique_ptr<ImageReader> open_image(const std::filesystem::path& path, NiftiFrame frame, NiftiVectors vectors) {
  const std::string file = path.string();
  const ImageFormat format = required_format(path);
  require_readable_file(path);
  auto reader = open_format(path, format, frame, vectors);
  require_valid(reader->header().geometry, file);
  require_orthogonal(reader->header().geometry, file);
  require(reader->header().components >= 1,
          std::to_string(reader->header().components) + " components a voxel, " + file + "; expected 1 or more");
  require_file_holds(path, reader->header(), reader->stored());
  return reader;
}

ImageHeader read_image_header(const std::filesystem::path& path, NiftiFrame frame) {
  return open_image(path, frame)->header();
}

AnyVolume read_image(const std::filesystem::path& path, NiftiFrame frame) {
  const auto reader = open_image(path, frame);
  const ImageHeader& header = reader->header();
  AnyVolume volume(header.geometry, header.type, header.components);
  reader->read({volume.data(), volume.size_bytes()});
  return volume;
}

void ImageWriter::write(const ConstVolumeView& slices) {
  const std::string file = path_.string();
  require(slices.geometry && slices.voxels && slices.geometry->size == grid_.size && slices.type == type_ &&
              slices.components == components_ && slices.memory == Memory::host,
          "slices of another grid or type than the file's, " + file);
  const glm::i64vec3 begin(0, 0, written_), end(grid_.size.x, grid_.size.y, slices.buffered.end.z);
  require(slices.buffered == Region{begin, end} && end.z > begin.z && end.z <= grid_.size.z,
          "slices " + std::to_string(slices.buffered.begin.z) + " to " + std::to_string(end.z) + ", " + file +
              "; expected whole slices from " + std::to_string(written_) + " on");
  append(slices);
  written_ = end.z;
}

void ImageWriter::write_whole(const ConstVolumeView& volume, const Control& control) {
  require_whole(volume, path_);
  const glm::i64vec3 size = volume.geometry->size;
  const std::size_t slice_bytes =
      static_cast<std::size_t>(size.x * size.y) * static_cast<std::size_t>(volume.components) * size_bytes(volume.type);
  const bool is_watched = control.stop.stop_possible() || control.progress;
  const std::int64_t slices =
      is_watched ? std::max<std::int64_t>(1, static_cast<std::int64_t>(bytes_at_once() / slice_bytes)) : size.z;
  for (std::int64_t begin = 0; begin < size.z; begin += slices) {
    if (control.stop.stop_requested()) throw Cancelled();
    if (control.progress) control.progress(static_cast<double>(begin) / static_cast<double>(size.z));
    ConstVolumeView part = volume;
    part.buffered = {{0, 0, begin}, {size.x, size.y, std::min(begin + slices, size.z)}};
    part.voxels += static_cast<std::size_t>(begin) * slice_bytes;
    write(part);
  }
  finish();
  if (control.progress) control.progress(1);
}

void ImageWriter::finish() {
  require(written_ == grid_.size.z, std::to_string(written_) + " slices were written, " + path_.string() +
                                        "; expected " + std::to_string(grid_.size.z));
  close();
}

void ImageWriter::fail() const {
  throw Error("cannot write, " + path_.string() + "; check folder, rights and free space");
}

std::unique_ptr<ImageWriter> create_image(const std::filesystem::path& path, const Geometry& grid, VoxelType type,
                                          int components, const ImageWriteOptions& options) {
  const std::string file = path.string();
  const ImageFormat format = required_format(path);
  require(options.compression >= -1 && options.compression <= 9,
          "compression level " + std::to_string(options.compression) + ", " + file + "; expected 0 to 9");
  require(components >= 1, std::to_string(components) + " components, " + file + "; expected 1 or more");
  require_valid(grid, file);
  require_orthogonal(grid, file);
  for (const auto& [key, value] : options.metadata) {
    const auto control = [](char c) { return static_cast<unsigned char>(c) < 32; };
    require(!key.empty() && std::ranges::none_of(key, [&](char c) { return control(c) || c == ':' || c == '='; }) &&
                std::ranges::none_of(value, control),
            "the key \"" + key + "\", " + file + "; keys and values are one line, keys without ':' and '='");
  }
  return create_format(path, format, grid, type, components, options);
}

void write_image(const std::filesystem::path& path, const ConstVolumeView& volume, const ImageWriteOptions& options,
                 const Control& control) {
  require_whole(volume, path);  // before anything has the name
  create_image(path, *volume.geometry, volume.type, volume.components, options)->write_whole(volume, control);
}

}  // namespace tetwarp
