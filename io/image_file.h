#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// Whether the name ends in a suffix of a volume file: .nii .nii.gz .nrrd .mha (upper or lower case).
bool has_image_suffix(const std::filesystem::path& path);

/// What a volume file says before its voxels are read.
struct ImageHeader {
  Geometry geometry;  ///< LPS, whatever the file's own frame
  VoxelType type = VoxelType::i16;
  int components = 1;  ///< 3 for a displacement field
  /// Keys and values as the file has them. NIfTI: "descrip"; and "scaled" where scl_slope and scl_inter made float of
  /// it.
  std::map<std::string, std::string> metadata;
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
ImageHeader read_image_header(const std::filesystem::path& path);
AnyVolume read_image(const std::filesystem::path& path);

/// Writes the whole volume with its own voxel type; NIfTI with qform and sform both set (code 1), mm.
/// Writes to `path` directly: io/staged_output.h is what makes an output appear only when complete.
/// @throws InputError for an unknown suffix, Error when the file cannot be written whole
void write_image(const std::filesystem::path& path, const ConstVolumeView& volume,
                 const ImageWriteOptions& options = {});

}  // namespace tetwarp
