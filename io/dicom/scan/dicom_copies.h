// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: finds files of a series that hold the same image.
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// Counts each image of a series once. Files are copies if they have one SOP Instance UID, the same geometry and the
/// same pixels (decoded, where they are encoded in different ways). The copy with the shortest name is kept, whatever
/// else the headers say, and a warning is added. Files without the UID, and files of several frames, are copies if all
/// their bytes are the same.
/// @return why the series cannot be used: files that have one SOP Instance UID and are not the same image
/// @throws Cancelled
std::optional<std::string> drop_copies(std::vector<DicomFileHeader>& files, DicomSeries& series,
                                       const std::stop_token& stop);

}  // namespace tetwarp
