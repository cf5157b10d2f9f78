// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "deform/volume.h"

namespace tetwarp::bench {

// What `tetwarp-bench io` compares with, as a user of these libraries writes it. Voxels: HU, i fastest.

/// How Pixel Data are stored; all without loss.
enum class Coding : std::uint8_t { none, jpeg, jpeg_ls, rle };
/// "uncompressed", "JPEG lossless", "JPEG-LS", "RLE".
std::string to_string(Coding coding);

/// Copies every file of a series under its name, recoded by DCMTK. @throws Error when DCMTK refuses
void recode_series(const std::filesystem::path& from, const std::filesystem::path& to, Coding coding);

/// The bare loop: each file loaded, decoded and rescaled into its place, in the order of the names; nothing is checked
/// but what DCMTK reports. @param threads  1: no threads are used
/// @throws Error for a file that DCMTK cannot read, or that is not of the size of the first
std::vector<std::int16_t> dcmtk_read_series(const std::filesystem::path& folder, int threads);

/// What ITK has read.
struct ItkVolume {
  std::function<std::vector<std::int16_t>()> voxels;
  /// Of a series. ImageSeriesWriter with GDCM: the attributes of each slice as they were read, new instance UIDs.
  /// @throws Error
  std::function<void(const std::filesystem::path& folder)> write = {};
};
/// GDCM lists and sorts the files of a folder, ImageSeriesReader reads them one by one. @throws Error with ITK's words
ItkVolume itk_read_series(const std::filesystem::path& folder);
/// ImageFileReader and ImageFileWriter (compression on, its default level) with NiftiImageIO. @throws Error
ItkVolume itk_read_nifti(const std::filesystem::path& path);
void itk_write_nifti(const std::filesystem::path& path, const Volume<std::int16_t>& volume);

/// Threads that ITK may use; its series reader and writer and its NIfTI use one.
void limit_itk_threads(int threads);

}  // namespace tetwarp::bench
