// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/read_program.h"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "deform/errors.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "tetwarp-read";

bool is_program(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && ::access(path.c_str(), X_OK) == 0;
}

/// The path with symbolic links followed, for an installation may consist of links to the files; empty: there is no
/// such file.
fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path found = fs::canonical(path, error);
  return error ? fs::path() : found;
}

/// The file from which this code was loaded.
fs::path library() {
  static const char here = 0;
  Dl_info info{};
  if (::dladdr(&here, &info) == 0 || !info.dli_fname) return {};
  return real(info.dli_fname);
}

}  // namespace

std::vector<fs::path> read_program_places(const fs::path& library, const fs::path& program) {
  std::vector<fs::path> places;
  const auto add = [&](const fs::path& file, const char* libexec) {
    if (file.empty()) return;
    for (const fs::path& folder : {file.parent_path(), file.parent_path() / libexec}) {
      const fs::path place = (folder / kName).lexically_normal();
      if (std::ranges::find(places, place) == places.end()) places.push_back(place);
    }
  };
  add(library, TETWARP_LIBEXEC_FROM_LIB);
  add(program, TETWARP_LIBEXEC_FROM_BIN);
  return places;
}

fs::path find_read_program(const std::string& file) {
  const std::string what = std::string("the program ") + kName + ", which reads " + file + ", is not there: ";
  if (const char* const named = ::secure_getenv(kReadProgramVariable); named && *named) {
    if (is_program(named)) return named;
    throw Error(what + kReadProgramVariable + " names " + named + ", no program; unset it, or name the program");
  }
  std::string looked;
  for (const fs::path& place : read_program_places(library(), real("/proc/self/exe"))) {
    if (is_program(place)) return place;
    looked += (looked.empty() ? "" : ", ") + place.string();
  }
  throw Error(what + "looked for " + looked + "; install it there, or name it by " + kReadProgramVariable);
}

}  // namespace tetwarp
