// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// One transform as a file holds it: what ITK's factory makes of its name, and the numbers that it is then given.
struct TransformRecord {
  std::string type;                ///< class, scalar and dimensions: `AffineTransform_double_3_3`
  std::vector<double> fixed;       ///< a centre, or a grid: size, origin, spacing, direction row by row
  std::vector<double> parameters;  ///< of a grid: all x, then y, then z (B-spline); x y z per sample (displacements)
};

/// What separates words in the text formats.
inline constexpr std::string_view kBlank = " \t\r\n";
/// The text without blanks at either end.
std::string_view trimmed(std::string_view text);

/// Numbers between blanks. @param where  what they are, for the error
/// @throws InputError for anything else; NaN and infinity are numbers here
std::vector<double> parse_numbers(std::string_view text, const std::string& where);

/// ITK's HDF5 layout: /TransformGroup/N/{TransformType, TransformFixedParameters, TransformParameters}. A composite is
/// a record without numbers. Nothing is allocated for values that the file cannot hold. The program tetwarp-read reads
/// it (isolated_read.h).
/// @throws InputError for what is not that, or damaged; Error where that program is missing; Cancelled
std::vector<TransformRecord> read_transform_hdf5(const std::filesystem::path& path, const std::stop_token& stop = {});

}  // namespace tetwarp
