// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: DICOMDIR files (PS3.10 8, PS3.3 F).
#include <filesystem>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct DirectoryFiles {
  std::vector<std::filesystem::path> files;    ///< that the records name and that are there, each once, sorted
  std::vector<std::filesystem::path> missing;  ///< where others should be
  std::vector<LeftOutFile> refused;            ///< names that lead out of the folder of the DICOMDIR
};

/// The files that the records of a DICOMDIR in use name. A Referenced File ID counts from the folder of the DICOMDIR;
/// if its first parts are the last folders of the DICOMDIR's own path, then from below them (media that were copied in
/// part). A file may bear its name in lower case, as some systems show media.
/// @throws InputError for a file that cannot be parsed
DirectoryFiles read_directory(const std::filesystem::path& dicomdir);

}  // namespace tetwarp
