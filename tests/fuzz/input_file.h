// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "deform/errors.h"

/// Hands bytes to a reader. A fuzzer calls it, and so does the replay of a corpus. It returns 0.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What stands between two files of an input that holds several.
constexpr std::string_view kNextFile = "\nNEXT\n";

/// How many inputs a reader accepted in this process.
inline std::uint64_t& accepted_reads() {
  static std::uint64_t count = 0;
  return count;
}

/// Runs a reader. What it throws that is not an error of Tetwarp is not caught, and so counts as a crash. So does a
/// reader that is not compiled in, for nothing would be tested.
/// @return whether the reader accepted its input
template <class Action>
bool accepted(Action&& action) {
  try {
    action();
  } catch (const tetwarp::NotCompiled&) {
    throw;
  } catch (const tetwarp::Error&) {
    return false;
  }
  ++accepted_reads();
  return true;
}

/// Runs an action that only looks at a file, and accepts the errors that `accepted` does. It does not count as having
/// read the file.
template <class Action>
void asked(Action&& action) {
  try {
    action();
  } catch (const tetwarp::NotCompiled&) {
    throw;
  } catch (const tetwarp::Error&) {
  }
}

/// A file for readers, which take paths. It lies in a folder of this process below that of temporary files (TMPDIR).
class InputFile {
 public:
  explicit InputFile(const std::string& suffix)
      : folder_(std::filesystem::temp_directory_path() / ("tetwarp-fuzz-" + std::to_string(::getpid()))),
        path_(folder_ / ("input" + suffix)),
        written_(folder_ / ("written" + suffix)) {
    std::filesystem::create_directories(folder_);
  }
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  void fill(const std::uint8_t* data, std::size_t size) const {
    std::ofstream stream(path_, std::ios::binary | std::ios::trunc);
    stream.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    stream.close();
    if (!stream) throw std::runtime_error("cannot write " + path_.string());
  }
  const std::filesystem::path& path() const { return path_; }
  /// The name of a file to which what was read may be written again.
  const std::filesystem::path& written() const { return written_; }

 private:
  std::filesystem::path folder_, path_, written_;
};
