#pragma once

#include <filesystem>
#include <string>

namespace tetwarp::bench {

/// Throws before the work where `write_text` could not write after it. An empty path is no file.
void require_writable(const std::filesystem::path& path);

/// The file appears when it is complete; one that is there is replaced. An empty path writes nothing. @throws Error
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace tetwarp::bench
