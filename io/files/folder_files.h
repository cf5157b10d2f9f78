// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <stop_token>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct FolderFiles {
  std::vector<std::filesystem::path> files;  ///< regular files; those behind links come last
  std::vector<LeftOutFile> left_out;         ///< what is no regular file, or cannot be reached, with the reason
};

/// Lists a folder, or the tree below it, in a fixed order: each real file and each real folder once, whatever links
/// lead to them. A link to a folder that contains the given one is not followed: it would draw in what lies beside the
/// input. Nothing but folders is opened.
/// @throws Cancelled
FolderFiles list_files(const std::filesystem::path& folder, bool with_sub_folders, const std::stop_token& stop);

}  // namespace tetwarp
