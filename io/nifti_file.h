#pragma once

// Private to io/. NIfTI-1 in one file (https://nifti.nimh.nih.gov, nifti1.h). ITK decides geometry on reading and makes
// the header on writing; the voxels pass through here, for what ITK 5.2.1 does to them: NaN and infinity read as 0, the
// voxels of x.nii taken for those of x.nii.gz, two copies in memory, one thread and one level of gzip.
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "io/image_reader.h"

namespace tetwarp {

/// What the 348 bytes say, in native byte order.
struct NiftiHeader {
  bool swapped = false;
  std::array<std::int64_t, 8> dim{};
  int intent_code = 0, datatype = 0, units = 0, qform_code = 0, sform_code = 0;
  double vox_offset = 0, scl_slope = 0, scl_inter = 0, intent_p1 = 0;
  std::string descrip, intent_name;
  Geometry qform, sform;  ///< LPS; valid where the code is not 0
};

/// @throws InputError naming the file: no NIfTI-1 in one file, more than one time point, a vector that is neither of
///         intent 1006 nor 1007, a datatype that VoxelType does not have, units other than mm, no orientation, a
///         sheared sform
NiftiHeader read_nifti_header(const std::filesystem::path& path);

/// Whether the sform, not the qform, places the volume, as ITK has it: it is the scanner's, or the only one.
bool sform_decides(const NiftiHeader& header);

std::unique_ptr<ImageReader> open_nifti(const std::filesystem::path& path);

}  // namespace tetwarp
