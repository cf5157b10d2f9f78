// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "deform/render/transfer_function.h"

namespace tetwarp {

/// Red, green and blue, 0 to 1, of a text such as "#f5e8cc"; nothing for any other text.
std::optional<glm::dvec3> parse_colour(const std::string& text);

/// Reads a transfer function from a JSON file; docs/reference/transfer-functions.md has the keys.
/// @throws InputError, "FILE:LINE: what; what is expected", for a file that cannot be read or used
TransferFunction read_transfer_file(const std::filesystem::path& path);

}  // namespace tetwarp
