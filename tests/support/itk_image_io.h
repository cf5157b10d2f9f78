// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Volumes through ITK, beside which the tests put ours.
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// The ImageIO class of ITK that reads and writes a file, whatever its name.
enum class ItkFormat : std::uint8_t { nifti, nrrd, meta };

/// A file's header as ITK understands it.
struct ItkImageInfo {
  Geometry geometry;  ///< LPS: ITK turns RAS files (NIfTI, NRRD) on reading
  VoxelType type = VoxelType::i16;
  int components = 1;
};

/// "5.2", say.
std::string itk_version();

/// @throws InputError for what ITK cannot read, and for what is not a 3-D grid of numbers or vectors of a VoxelType
ItkImageInfo itk_read_info(const std::filesystem::path& path, ItkFormat format);

/// Lets ITK read the voxels straight into `voxels`, whose size must be that of the whole image.
/// Of NIfTI, ITK 5.2 turns NaN and infinity into 0, and reads the voxels of x.nii instead of x.nii.gz if both exist.
/// @throws InputError for a truncated or damaged file
void itk_read_voxels(const std::filesystem::path& path, ItkFormat format, std::span<std::byte> voxels);

/// Lets ITK write a whole volume; no copy of the voxels for NRRD and MHA.
/// @param compression  0 none, else the level of zlib, 1 to 9; NIfTI: ignored
/// @param metadata     custom keys of NRRD and MHA; NIfTI: ignored
/// @throws InputError for a view of a part; Error when ITK cannot write
void itk_write(const std::filesystem::path& path, ItkFormat format, const ConstVolumeView& volume, int compression,
               const std::map<std::string, std::string>& metadata);

}  // namespace tetwarp
