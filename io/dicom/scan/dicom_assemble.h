// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <stop_token>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// Makes a series, of one volume or several, from the files that share a Series Instance UID. What is no CT slice is
/// set aside, copies count once, volumes are told apart, and the slices of each are sorted along its normal and judged.
/// Whatever the files hold, nothing but Cancelled is thrown: see DicomSeries::refusal. @throws Cancelled
std::vector<DicomSeries> assemble_series(std::vector<DicomFileHeader> files, const std::stop_token& stop);

}  // namespace tetwarp
