// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <stop_token>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// Makes a series of the files that share its UID, one volume or several: what is no CT slice is set aside, copies
/// count once, volumes are told apart, and each is sorted along its normal and judged. Never throws for what the files
/// hold: see DicomSeries::refusal. @throws Cancelled
std::vector<DicomSeries> assemble_series(std::vector<DicomFileHeader> files, const std::stop_token& stop);

}  // namespace tetwarp
