#pragma once

// Private to io/: the only header of ours that names DCMTK's types.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <memory>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct DicomHeaders {
  /// Every attribute but Pixel Data, as read. Lossy Image Compression is 01 also where only the transfer syntax says so.
  std::vector<std::unique_ptr<DcmDataset>> slices;
};

}  // namespace tetwarp
