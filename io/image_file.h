// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "deform/volume.h"

namespace tetwarp {

/// Whether the name ends in a suffix of a volume file: .nii .nii.gz .nrrd .mha (upper or lower case).
bool has_image_suffix(const std::filesystem::path& path);

/// Which of the two places of a NIfTI file counts where it states both: the sform, as nibabel, FSL, SPM, FreeSurfer and
/// NiftyReg have it, or the qform, as ITK has it unless the sform's code is 1. Without meaning for other files.
enum class NiftiFrame : std::uint8_t { sform, qform };

/// What a volume file says before its voxels are read.
struct ImageHeader {
  Geometry geometry;  ///< LPS, whatever the file's own frame
  VoxelType type = VoxelType::i16;
  int components = 1;  ///< 3 for a displacement field
  /// Keys and values as the file has them. NIfTI: "descrip"; and "scaled" where scl_slope and scl_inter made float of
  /// it.
  std::map<std::string, std::string> metadata;
  std::vector<std::string> notes = {};  ///< for people, without the file's name
};

struct ImageWriteOptions {
  /// 0 none, 1 to 9; -1: 1 for .nii.gz, none else; .nii never is. The levels of .nii.gz are libdeflate's: its 1 makes
  /// files about as small as zlib's 6 does, its 6 smaller ones in two to four times the time.
  int compression = -1;
  std::map<std::string, std::string>
      metadata;  ///< NRRD and MHA: key and value; NIfTI keeps only "descrip" (79 characters)
};

/// @throws InputError naming the file: missing, unreadable, truncated, an unknown suffix, not 3-D, a voxel type that
///         VoxelType does not have, a size that the file cannot hold, a geometry that is not finite or sheared
ImageHeader read_image_header(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform);
AnyVolume read_image(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform);

/// A volume file that takes its slices one after the other: what was written need not stay in memory.
///
/// However the slices are split, the file has the same bytes. Two kinds of file cannot be written from front to back:
/// several components in .nii.gz (one plane a component, one after the other) and compressed .mha (the header states
/// the compressed size). What has to wait for its place lies on the disk, in files without names beside `path`.
class ImageWriter {
 public:
  virtual ~ImageWriter() = default;
  ImageWriter(const ImageWriter&) = delete;
  ImageWriter& operator=(const ImageWriter&) = delete;

  /// @param slices  whole slices, the next ones of the grid; of the file's type and components, in host memory
  /// @throws InputError for other slices, Error when they cannot be written
  void write(const ConstVolumeView& slices);
  /// To be called after the last slice; the file is not whole before. @throws InputError when slices are missing, Error
  /// when the file cannot be written whole
  void finish();

 protected:
  ImageWriter(std::filesystem::path path, const Geometry& grid, VoxelType type, int components)
      : path_(std::move(path)), grid_(grid), type_(type), components_(components) {}

  virtual void append(const ConstVolumeView& slices) = 0;
  virtual void close() = 0;  ///< all slices are there
  [[noreturn]] void fail() const;

  std::filesystem::path path_;
  Geometry grid_;
  VoxelType type_;
  int components_;

 private:
  std::int64_t written_ = 0;  ///< slices
};

/// Begins a file of voxels of their own type; NIfTI with qform and sform both set (code 1), mm.
/// Writes to `path` directly: io/staged_output.h is what makes an output appear only when complete.
/// @throws InputError for an unknown suffix, a grid or metadata that the format cannot hold, Error when the file cannot
///         be written
std::unique_ptr<ImageWriter> create_image(const std::filesystem::path& path, const Geometry& grid, VoxelType type,
                                          int components = 1, const ImageWriteOptions& options = {});

/// Writes a whole volume with `create_image`. @throws as that, and Error when the file cannot be written whole
void write_image(const std::filesystem::path& path, const ConstVolumeView& volume,
                 const ImageWriteOptions& options = {});

}  // namespace tetwarp
