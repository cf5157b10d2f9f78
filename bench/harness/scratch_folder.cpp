// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/scratch_folder.h"

#include <unistd.h>

#include <system_error>

#include "deform/errors.h"

namespace tetwarp::bench {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const fs::path& parent) {
  std::string pattern = ((parent.empty() ? fs::temp_directory_path() : parent) / "tetwarp-bench-XXXXXX").string();
  if (!::mkdtemp(pattern.data())) {
    throw Error("no folder can be made, " + pattern + ": " + std::generic_category().message(errno) +
                "; choose another --folder");
  }
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace tetwarp::bench
