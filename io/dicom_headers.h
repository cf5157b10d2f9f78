#pragma once

// Private to io/: the only header of ours that names DCMTK's types.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <memory>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct DicomHeaders {
  std::vector<std::unique_ptr<DcmDataset>> slices;  ///< every attribute but Pixel Data, as read
};

}  // namespace tetwarp
