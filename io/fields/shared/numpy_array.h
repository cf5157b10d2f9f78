// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Arrays of vectors as NumPy writes them, by themselves (.npy) or as a member of an archive (.npz).
#include <array>
#include <functional>
#include <istream>
#include <memory>
#include <string>

#include "io/fields/field_format.h"

namespace tetwarp {

/// What the header of an array says (NumPy Enhancement Proposal 1, numpy/lib/format.py).
struct NumpyArray {
  VoxelType type = VoxelType::f32;
  bool big_endian = false, fortran = false;
  std::array<std::int64_t, 4> shape{};
  std::uint64_t offset = 0;  ///< byte at which the values begin
};

/// Reads and checks the header of an array of shape (a, b, c, 3).
/// @param stream  at its first byte
/// @param bytes   how many there are
/// @param name    for messages
/// @throws InputError for whatever is wrong with it
NumpyArray read_numpy_header(std::istream& stream, std::uint64_t bytes, const std::string& name);

/// Checks the options that say what the axes of an array are: order, units, components, frame.
/// @param more  further options that the format has, for the message: ", key"
void check_numpy_options(const FieldSource& source, const std::string& more = "");

/// A reader of an array whose header was read.
/// @param open   opens the array anew, at its first byte
/// @throws InputError for options that are missing, or a grid of another size
std::unique_ptr<FieldReader> numpy_reader(const FieldSource& source, const NumpyArray& array, const std::string& format,
                                          std::function<std::unique_ptr<std::istream>()> open);

}  // namespace tetwarp
