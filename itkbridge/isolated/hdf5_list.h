// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to the program tetwarp-read: lists of numbers in HDF5 files.
#include <itk_H5Cpp.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp {

/// An HDF5 file, for messages and to bound what it can hold.
struct Hdf5Source {
  explicit Hdf5Source(const std::filesystem::path& path)
      : file(path.string()), bytes(static_cast<double>(std::filesystem::file_size(path))) {}

  std::string file;
  double bytes;
};

enum class Hdf5Numbers : std::uint8_t {
  real,  ///< float or double of IEEE 754: HDF5 can hold floating-point numbers of any layout and length
  whole  ///< integers of 1, 2, 4 or 8 bytes
};

/// All numbers of a dataset with one dimension. Nothing is allocated for numbers that the file cannot hold.
/// @param name  of the dataset, for messages
/// @throws InputError for a dataset of another kind, or one that promises more than the file holds; H5::Exception
std::vector<double> hdf5_list(const H5::DataSet& set, Hdf5Numbers numbers, const std::string& name,
                              const Hdf5Source& source);

}  // namespace tetwarp
