// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// Whether the first bytes of a file are those of ITK's transforms in MATLAB's level 4 form, as ANTs writes .mat.
bool is_matlab_record(std::string_view first_bytes);

/// Reads ITK's transforms in MATLAB's level 4 form ("MAT-File Format", version 4): for each a vector of its parameters,
/// whose name is that of the class, and one of its fixed parameters, called "fixed".
/// @throws InputError naming the file
std::vector<TransformRecord> read_matlab_records(const std::filesystem::path& path);

}  // namespace tetwarp
