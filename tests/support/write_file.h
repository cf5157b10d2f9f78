#pragma once

#include <filesystem>
#include <fstream>
#include <string>

inline void write_file(const std::filesystem::path& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}
