// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: voxels of NRRD that are written in digits, as teem reads them. What follows the last is not looked
// at.
#include <cstddef>
#include <istream>
#include <span>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// Decimal numbers between blanks, and commas before or behind them. Of a fraction, integers take what is before the
/// point; those of 8 and 16 bits keep their lowest bits. "nan" and "inf" are numbers of floating point.
/// @throws InputError naming the file, where there are fewer numbers
void read_decimal_values(std::istream& stream, VoxelType type, std::span<std::byte> values, const std::string& file);

/// Two digits a byte, in the order of the file; blanks and ends of lines between them do not count.
/// @throws InputError naming the file, where there are fewer digits
void read_hexadecimal_bytes(std::istream& stream, std::span<std::byte> bytes, const std::string& file);

}  // namespace tetwarp
