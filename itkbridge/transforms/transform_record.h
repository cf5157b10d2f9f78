// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// One transform as a file holds it: the name from which ITK's factory makes it, and the numbers that it is then given.
struct TransformRecord {
  std::string type;           ///< class, scalar and dimensions: `AffineTransform_double_3_3`
  std::vector<double> fixed;  ///< a centre, or a grid: size, origin, spacing, direction row by row
  /// Of a B-spline's grid: all x, then all y, then all z; of a grid of displacements: x, y, z of each sample.
  std::vector<double> parameters;
};

/// Characters that separate words in the text formats.
inline constexpr std::string_view kBlank = " \t\r\n";
/// The text without blanks at either end.
std::string_view trimmed(std::string_view text);

/// The numbers in a text, with blanks between them. @param where  what they are, for the message
/// @throws InputError for anything else; NaN and infinity are numbers here
std::vector<double> parse_numbers(std::string_view text, const std::string& where);

/// Reads ITK's HDF5 layout: /TransformGroup/N/{TransformType, TransformFixedParameters, TransformParameters}. A
/// composite transform is a record without numbers. Nothing is allocated for values that the file cannot hold. The
/// program tetwarp-read reads the file (isolated_read.h).
/// @throws InputError for what has another layout, or is damaged; Error where that program is missing; Cancelled
std::vector<TransformRecord> read_transform_hdf5(const std::filesystem::path& path, const std::stop_token& stop = {});

}  // namespace tetwarp
