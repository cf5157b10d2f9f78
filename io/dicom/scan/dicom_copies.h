// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: files that hold one and the same image.
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// Counts each image of a series once: of files with one SOP Instance UID, the same geometry and the same pixels
/// (decoded, where they are encoded in different ways) the one with the shortest name is kept, whatever else their
/// headers say, with a warning. Without the UID a copy is known by its bytes, all of them; so are files of several
/// frames.
/// @return why the series cannot be used: files that have one SOP Instance UID and are not the same image
/// @throws Cancelled
std::optional<std::string> drop_copies(std::vector<DicomFileHeader>& files, DicomSeries& series,
                                       const std::stop_token& stop);

}  // namespace tetwarp
