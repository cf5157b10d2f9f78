#pragma once

#include <vector>

#include "io/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// Makes a series of the files that share its UID: what is no CT slice is set aside, the rest is sorted along the
/// normal and judged. Never throws for what the files hold: see DicomSeries::refusal.
DicomSeries assemble_series(std::vector<DicomFileHeader> files);

}  // namespace tetwarp
