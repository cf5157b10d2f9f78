// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: reads DICOMDIR files (PS3.10 8, PS3.3 F).
#include <filesystem>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct DirectoryFiles {
  std::vector<std::filesystem::path> files;    ///< files that the records name and that exist, each once, sorted
  std::vector<std::filesystem::path> missing;  ///< files that the records name and that do not exist
  std::vector<LeftOutFile> refused;            ///< names that lead out of the folder of the DICOMDIR
};

/// Finds the files that the records of a DICOMDIR name, except records that are not in use. A Referenced File ID is
/// relative to the folder of the DICOMDIR. If its first parts are also the last folders of that path, they count once:
/// media that were copied in part have such IDs. A file may bear its name in lower case, as some systems show media.
/// @throws InputError for a file that cannot be parsed
DirectoryFiles read_directory(const std::filesystem::path& dicomdir);

}  // namespace tetwarp
