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

#include "deform/resampler.h"
#include "deform/volume.h"

namespace tetwarp {

/// Whether a name ends in a suffix of a volume file, in upper or lower case: .nii, .nii.gz, .nrrd or .mha.
bool has_image_suffix(const std::filesystem::path& path);

/// Which place of a NIfTI file counts if it states two. It has no meaning for other files.
enum class NiftiFrame : std::uint8_t {
  sform,  ///< srow_x, srow_y, srow_z, as nibabel, FSL, SPM, FreeSurfer and NiftyReg choose
  qform   ///< quatern and qoffset, as ITK chooses unless sform_code is 1
};

/// What a volume file states before its voxels.
struct ImageHeader {
  Geometry geometry;                ///< LPS mm, whatever coordinates the file has
  VoxelType type = VoxelType::i16;  ///< type of one value
  int components = 1;               ///< values of a voxel; 3 for a displacement field
  /// Keys and values of the file. NIfTI has "descrip", and "scaled" where scl_slope and scl_inter turned integers into
  /// float.
  std::map<std::string, std::string> metadata;
  std::vector<std::string> notes = {};  ///< remarks for people, without the name of the file
};

/// Choices for a volume file.
struct ImageWriteOptions {
  /// Compression level 1 to 9, or 0 for none; -1: 1 for .nii.gz, none for others. A .nii file is never compressed.
  /// Levels of .nii.gz are those of libdeflate: its 1 gives files about as small as 6 of zlib, its 6 gives smaller ones
  /// in two to four times the time.
  int compression = -1;
  /// Keys and values for NRRD and MHA. NIfTI keeps only "descrip" (79 characters).
  std::map<std::string, std::string> metadata;
};

/// Reads what a volume file states before its voxels.
/// @throws InputError, which names the file: missing, unreadable, truncated, an unknown suffix, not 3-D, a voxel type
///         that VoxelType does not have, a size that the file cannot contain, or a geometry that is sheared or not
///         finite
ImageHeader read_image_header(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform);
/// Reads a volume file.
/// @throws InputError as `read_image_header`, and for voxels that cannot be read
AnyVolume read_image(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform);

/// A volume file that takes its slices one after another, so that what was written need not stay in memory.
///
/// The file has the same bytes however slices are grouped. Two kinds of file cannot be written from front to back:
/// .nii.gz with several components (which stores one plane for each component) and compressed .mha (whose header states
/// the compressed size). For these, what must wait lies on the disk in nameless files beside `path`.
class ImageWriter {
 public:
  /// Closes the file. It is incomplete unless `finish` was called.
  virtual ~ImageWriter() = default;
  ImageWriter(const ImageWriter&) = delete;
  ImageWriter& operator=(const ImageWriter&) = delete;

  /// Writes the next slices.
  /// @param slices  whole slices that follow those written before; of the file's type and components, in host memory
  /// @throws InputError for other slices
  /// @throws Error when they cannot be written
  void write(const ConstVolumeView& slices);
  /// Writes all slices of a volume and completes the file.
  /// @param volume   of the file's grid, type and components, in host memory
  /// @param control  progress, and stop, which is looked at every few hundredths of a second
  /// @throws what `write` and `finish` throw, and Cancelled
  void write_whole(const ConstVolumeView& volume, const Control& control = {});
  /// Completes the file after the last slice.
  /// @throws InputError when slices are missing
  /// @throws Error when the file cannot be completed
  void finish();

 protected:
  /// For implementations: a writer of a file of this grid, type and number of components.
  ImageWriter(std::filesystem::path path, const Geometry& grid, VoxelType type, int components)
      : path_(std::move(path)), grid_(grid), type_(type), components_(components) {}

  /// How many bytes of slices are written in a few hundredths of a second, and use all threads that can help.
  virtual std::size_t bytes_at_once() const { return std::size_t{1} << 20; }
  /// Writes slices that were checked.
  virtual void append(const ConstVolumeView& slices) = 0;
  /// Completes the file; all slices were written.
  virtual void close() = 0;
  /// Throws Error with the path and the reason that the system gives.
  [[noreturn]] void fail() const;

  std::filesystem::path path_;  ///< the file
  Geometry grid_;               ///< grid of the volume
  VoxelType type_;              ///< type of one value
  int components_;              ///< values of a voxel

 private:
  std::int64_t written_ = 0;  ///< number of slices
};

/// Begins a volume file. NIfTI gets qform and sform, both of code 1, and mm.
/// It is written to `path` directly; `StagedOutput` makes an output appear only when it is complete.
/// @param path        file to write; its suffix decides the format
/// @param grid        grid of the volume
/// @param type        type of one value
/// @param components  values of a voxel
/// @param options     compression and metadata
/// @throws InputError for an unknown suffix, or a grid or metadata that the format cannot hold
/// @throws Error when the file cannot be written
std::unique_ptr<ImageWriter> create_image(const std::filesystem::path& path, const Geometry& grid, VoxelType type,
                                          int components = 1, const ImageWriteOptions& options = {});

/// Writes a whole volume by `create_image`.
/// @throws InputError for an unknown suffix, or a grid or metadata that the format cannot hold
/// @throws Error when the file cannot be written
/// @throws Cancelled when `control.stop` is set before the last slice is written
void write_image(const std::filesystem::path& path, const ConstVolumeView& volume,
                 const ImageWriteOptions& options = {}, const Control& control = {});

}  // namespace tetwarp
