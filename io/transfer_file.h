#pragma once

#include <filesystem>

#include "deform/render/transfer_function.h"

namespace tetwarp {

/// A transfer function of a JSON file (docs/render.md has the keys).
/// @throws InputError, "FILE:LINE: what; what is expected", for a file that cannot be read or used
TransferFunction read_transfer_file(const std::filesystem::path& path);

}  // namespace tetwarp
