// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: where tetwarp-read is, the program that isolated_read.h starts.
#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp {

/// An environment variable that names the program, wherever it is.
inline constexpr const char* kReadProgramVariable = "TETWARP_READ_PROGRAM";

/// Where the program is looked for, in this order.
/// @param library  the file that this code is in
/// @param program  the file of the process
std::vector<std::filesystem::path> read_program_places(const std::filesystem::path& library,
                                                       const std::filesystem::path& program);

/// @param file  for errors: what is to be read
/// @throws Error naming the program and the places where it is not
std::filesystem::path find_read_program(const std::string& file);

}  // namespace tetwarp
