// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp::bench {

/// Throws before the work where `write_text` could not write after it, or would write over what is read. An empty path
/// is no file.
void require_writable(const std::filesystem::path& path, const std::vector<std::filesystem::path>& reads = {});

/// The file appears when it is complete; one that is there is replaced. An empty path writes nothing. @throws Error
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace tetwarp::bench
