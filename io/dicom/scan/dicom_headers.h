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
  /// For each slice, every attribute but Pixel Data, as read; frames are as EnhancedFrames makes them. Lossy Image
  /// Compression is 01 also where only the transfer syntax says so.
  std::vector<std::unique_ptr<DcmDataset>> slices;
  /// By slice: its frame's number in the file, from 1; 0: the slice is a file of its own; empty: all slices are.
  std::vector<int> frames = {};
};

}  // namespace tetwarp
