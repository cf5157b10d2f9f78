// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: the main function of tetwarp-read.
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "itkbridge/isolated/read_record.h"

namespace tetwarp {

/// A reader of the program, and the name by which it is chosen.
struct ChildReader {
  std::string_view kind;
  /// @param part  what `read_isolated` was asked for; of no meaning to a reader of whole files
  std::vector<ReadRecord> (*read)(const std::filesystem::path& path, std::uint64_t part);
};

/// The main function of the program: confines this process, reads one file by one of the readers, and answers
/// (isolated_answer.h).
/// @return the exit status
int answer_read(int argc, char** argv, std::span<const ChildReader> readers);

}  // namespace tetwarp
