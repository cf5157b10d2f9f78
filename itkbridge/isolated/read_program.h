// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: finds tetwarp-read, the program that isolated_read.h starts.
#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp {

/// The environment variable that names the program. It is used before all other places.
inline constexpr const char* kReadProgramVariable = "TETWARP_READ_PROGRAM";

/// The places where the program is looked for, in this order.
/// @param library  the file that contains this code
/// @param program  the file of the process
std::vector<std::filesystem::path> read_program_places(const std::filesystem::path& library,
                                                       const std::filesystem::path& program);

/// Finds the program.
/// @param file  the file that is to be read, for messages
/// @throws Error naming the program and the places where it is not
std::filesystem::path find_read_program(const std::string& file);

}  // namespace tetwarp
