// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. NIfTI-1 in one file (https://nifti.nimh.nih.gov, nifti1.h). It is read by what the standard says, and
// not as ITK 5.2.1 reads it: there NaN and infinity are 0, the voxels of x.nii are taken for those of x.nii.gz, and a
// sform of code 2 or more, or one that it takes for sheared, is passed over in silence.
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "io/images/image_reader.h"

namespace tetwarp {

/// What the 348 bytes say, in native byte order.
struct NiftiHeader {
  bool swapped = false;
  std::array<std::int64_t, 8> dim{};
  int components = 1;  ///< values a voxel
  int intent_code = 0, datatype = 0, units = 0, qform_code = 0, sform_code = 0;
  double vox_offset = 0, scl_slope = 0, scl_inter = 0;
  glm::dvec3 intent_p{};  ///< intent_p1, intent_p2, intent_p3
  std::string descrip, intent_name;
  Geometry qform, sform;           ///< LPS; valid where the code is not 0
  glm::dvec3 pixdim{};             ///< mm
  double qform_rounding = 0;       ///< radians by which float32 may turn the qform
  std::optional<double> apart_mm;  ///< the farthest two places of a voxel by both, where that is more than rounding
};

/// @throws InputError naming the file: no NIfTI-1 in one file, more than one time point, a vector that is neither of
///         intent 1006 nor 1007, a datatype that VoxelType does not have, units other than mm, no orientation, a form
///         that is not finite
NiftiHeader read_nifti_header(const std::filesystem::path& path, NiftiVectors vectors = NiftiVectors::stated);

/// Whether an intent is FSL's for a field of displacements.
inline bool is_fsl_field(int intent_code) { return intent_code == 2006; }
/// Whether it is one of FSL's for coefficients, of cubic, cosine or quadratic functions.
inline bool is_fsl_coefficients(int intent_code) { return intent_code >= 2007 && intent_code <= 2009; }

/// The place of the volume: by the form that `frame` names where the header has both, else by the one that it has.
/// @throws InputError naming the file: neither is there, or the one that decides is sheared, singular, or of another
///         voxel size than pixdim
const Geometry& place_of(const NiftiHeader& header, NiftiFrame frame, const std::filesystem::path& path);

/// How NIfTI calls a type: the field `datatype`.
int nifti_datatype(VoxelType type);

std::unique_ptr<ImageReader> open_nifti(const std::filesystem::path& path, NiftiFrame frame,
                                        NiftiVectors vectors = NiftiVectors::stated);

}  // namespace tetwarp
