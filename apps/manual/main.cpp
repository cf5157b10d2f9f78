// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// tetwarp-manual FOLDER: writes the man pages and completions of tetwarp below FOLDER, as below `share` of an
// installation. It is a part of the build and is not installed.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include "apps/manual/manual.h"
#include "deform/errors.h"
#include "deform/version.h"

int main(int argc, char** argv) {
  using namespace tetwarp;
  if (argc != 2) {
    std::fprintf(stderr, "usage: tetwarp-manual FOLDER\n");
    return 2;
  }
  try {
    const apps::Manual manual = apps::describe_program();
    std::vector<apps::ManualFile> files = apps::man_pages(manual, version());
    for (apps::ManualFile& file : apps::completions(manual)) files.push_back(std::move(file));
    for (const apps::ManualFile& file : files) {
      const std::filesystem::path path = std::filesystem::path(argv[1]) / file.path;
      std::filesystem::create_directories(path.parent_path());
      std::ofstream out(path, std::ios::binary);
      out << file.text << std::flush;
      require(out.good(), "cannot write, " + path.string());
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetwarp-manual: error: %s\n", error.what());
    return 1;
  }
}
