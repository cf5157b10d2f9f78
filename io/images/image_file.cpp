// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/image_file.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>

#include "deform/errors.h"
#include "io/images/image_reader.h"
#include "io/images/image_writer.h"
#include "io/images/raw_image.h"
#include "io/lower_case.h"
#ifdef TETWARP_WITH_ITK
#include "io/images/nifti_file.h"
#include "io/images/nrrd_layout.h"
#include "io/images/text_header.h"
#include "io/images/value_reader.h"
#include "io/opened_file.h"
#include "itkbridge/image_io.h"
#endif

namespace tetwarp {
namespace {

/// Columns of unit length at right angles, within what the formats' digits (float32 in NIfTI) can hold.
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

/// A header that promises more voxels than the file can hold is not believed: nothing is allocated for it. Nor is one
/// that leaves bytes over, where the voxels are stored as they are: it is about another volume, or the file is damaged.
void require_file_holds(const std::filesystem::path& path, const ImageHeader& header, const Stored& stored) {
  constexpr double kDeflateAtMost = 1040;  // deflate cannot do better than 1032 to 1
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

#ifdef TETWARP_WITH_ITK
ItkFormat itk_format(ImageFormat format) { return format == ImageFormat::nrrd ? ItkFormat::nrrd : ItkFormat::meta; }

/// NRRD of text or hexadecimal digits, which have no check sum.
class TextValueReader final : public ImageReader {
 public:
  using ImageReader::ImageReader;
  void read(std::span<std::byte> voxels) const override { itk_read_voxels(path_, ItkFormat::nrrd, voxels); }
};

std::unique_ptr<ImageReader> open_nrrd(const std::filesystem::path& path, const TextHeader& text, ImageHeader header,
                                       Stored stored) {
  const auto layout = nrrd_layout(path, text, header, stored.offset);
  if (!layout) return std::make_unique<TextValueReader>(path, std::move(header), stored);
  stored.encoded = layout->encoding != Encoding::raw;
  return make_value_reader(path, std::move(header), stored, *layout);
}

std::unique_ptr<ImageReader> open_mha(const std::filesystem::path& path, const TextHeader& text, ImageHeader header,
                                      const Stored& stored) {
  require_stated_sizes(path, text);
  const bool zlib = is_zlib(text, ImageFormat::mha);
  require(zlib || !stored.encoded, "voxels that are text, or compressed big-endian, " + path.string() +
                                       "; expected binary, compressed only in little endian");
  return make_value_reader(path, std::move(header), stored,
                           {.encoding = zlib ? Encoding::zlib : Encoding::raw, .big_endian = is_big_endian(text)});
}

/// An NRRD that names none of the patient's spaces is taken as LPS, as ITK takes it.
void note_assumed_space(const TextHeader& text, ImageHeader& header) {
  const std::string space = nrrd_space(text);
  if (space == "lps" || space == "ras" || space == "las") return;
  header.notes.push_back(space.empty() ? "the file does not say its space: taken as LPS"
                                       : "the space \"" + space + "\" is none of a patient: taken as LPS");
}

std::unique_ptr<ImageReader> open_format(const std::filesystem::path& path, ImageFormat format, NiftiFrame frame) {
  if (format == ImageFormat::nifti) return open_nifti(path, frame);
  const TextHeader text = read_text_header(path, format);
  if (format == ImageFormat::nrrd) require_known_steps(text, path.string());
  ItkImageInfo info = itk_read_info(path, itk_format(format));
  // NrrdImageIO of ITK 5.2 turns left-anterior-superior about the wrong axis.
  if (format == ImageFormat::nrrd && nrrd_space(text) == "las") place_nrrd(info.geometry, text, path.string());
  const Stored stored{text.data_offset, size_bytes(info.type), is_encoded(text, format)};
  ImageHeader header{info.geometry, info.type, info.components, text.metadata};
  if (format == ImageFormat::nrrd) note_assumed_space(text, header);
  return format == ImageFormat::nrrd ? open_nrrd(path, text, header, stored) : open_mha(path, text, header, stored);
}

/// The header that ITK wrote into a file of its own, up to the voxels. @throws Error, about the output, where it is not
/// whole: a full disk
std::string written_header(const std::filesystem::path& made, const std::filesystem::path& output, ImageFormat format) {
  try {
    std::string text(static_cast<std::size_t>(read_text_header(made, format).data_offset), '\0');
    std::ifstream stream(made, std::ios::binary);
    if (stream.read(text.data(), static_cast<std::streamsize>(text.size()))) return text;
  } catch (const InputError&) {
    // What ITK left is no input of anybody's.
  }
  throw Error("cannot write, " + output.string() + "; check folder, rights and free space");
}

/// ITK makes the header, of one voxel in a file of its own beside the output: ITK knows its suffixes in lower case
/// alone, holds what it compresses, and reports success for MHA when the disk is full. Sizes are filled in here.
std::string text_header(const std::filesystem::path& path, ImageFormat format, const Geometry& grid, VoxelType type,
                        int components, const ImageWriteOptions& options) {
  Geometry one = grid;
  one.size = glm::i64vec3(1);
  const std::vector<std::byte> zeros(static_cast<std::size_t>(components) * size_bytes(type));
  const bool mha = format == ImageFormat::mha;
  const TemporaryFile made(path.string() + (mha ? ".header.mha" : ".header.nrrd"));
  itk_write(made.path(), itk_format(format), {&one, whole(one), type, components, zeros.data()}, options.compression,
            options.metadata);
  std::string text = written_header(made.path(), path, format);
  const std::string size =
      std::to_string(grid.size.x) + " " + std::to_string(grid.size.y) + " " + std::to_string(grid.size.z);
  const bool vectors = components > 1;
  set_text_field(text,
                 mha ? "DimSize = " : "sizes: ", (mha || !vectors ? "" : std::to_string(components) + " ") + size);
  return text;
}

std::unique_ptr<ImageWriter> create_format(const std::filesystem::path& path, ImageFormat format, const Geometry& grid,
                                           VoxelType type, int components, const ImageWriteOptions& options) {
  if (format == ImageFormat::nifti) {
    const auto descrip = options.metadata.find("descrip");
    return create_nifti(path, grid, type, components, descrip == options.metadata.end() ? "" : descrip->second,
                        options.compression < 0 ? 1 : options.compression);
  }
  return create_text_image(path, format, grid, type, components,
                           text_header(path, format, grid, type, components, options), options.compression);
}
#else
[[noreturn]] void no_nifti(const std::filesystem::path& path) {
  throw NotCompiled("NIfTI needs ITK, which this build does not have, " + path.string() + "; use .nrrd or .mha");
}

std::unique_ptr<ImageReader> open_format(const std::filesystem::path& path, ImageFormat format, NiftiFrame) {
  if (format == ImageFormat::nifti) no_nifti(path);
  return open_raw_image(path, format);
}

std::unique_ptr<ImageWriter> create_format(const std::filesystem::path& path, ImageFormat format, const Geometry& grid,
                                           VoxelType type, int components, const ImageWriteOptions& options) {
  if (format == ImageFormat::nifti) no_nifti(path);
  if (options.compression > 0)
    throw NotCompiled("compression needs ITK, which this build does not have, " + path.string());
  return create_text_image(path, format, grid, type, components,
                           raw_image_header(format, grid, type, components, options.metadata), 0);
}
#endif

ImageFormat required_format(const std::filesystem::path& path) {
  const auto format = image_format(path);
  require(format.has_value(), "an unknown suffix, " + path.string() + "; expected .nii, .nii.gz, .nrrd or .mha");
  return *format;
}

}  // namespace

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
  const Found found = found_at(path);
  require(found != Found::nothing, "no such file, " + file);
  require(found == Found::file, "not a file, " + file);
  require(std::filesystem::file_size(path, error) > 0, "an empty file, " + file);
  require(::access(path.c_str(), R_OK) == 0, "a file that may not be read, " + file + "; check its rights");
}

std::unique_ptr<ImageReader> open_image(const std::filesystem::path& path, NiftiFrame frame) {
  const std::string file = path.string();
  const ImageFormat format = required_format(path);
  require_readable_file(path);
  auto reader = open_format(path, format, frame);
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

void write_image(const std::filesystem::path& path, const ConstVolumeView& volume, const ImageWriteOptions& options) {
  require(volume.geometry && volume.voxels && volume.buffered == whole(*volume.geometry),
          "only a whole volume can be written, " + path.string());
  const auto writer = create_image(path, *volume.geometry, volume.type, volume.components, options);
  writer->write(volume);
  writer->finish();
}

}  // namespace tetwarp
