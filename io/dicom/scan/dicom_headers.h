// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the only header of ours that names DCMTK's types.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <memory>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

struct DicomHeaders {
  /// Every attribute but Pixel Data, as read; of a frame as EnhancedFrames makes them. Lossy Image Compression is 01
  /// also where only the transfer syntax says so.
  std::vector<std::unique_ptr<DcmDataset>> slices;
  std::vector<int> frames = {};  ///< of each slice, its number in its file, from 1; 0: no frame; empty: none is
};

}  // namespace tetwarp
