// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: a structure set as DCMTK has it, and the names of its parts.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <array>
#include <memory>
#include <string_view>
#include <utility>

#include "io/dicom_structures.h"

namespace tetwarp {

struct StructureSetHeader {
  std::unique_ptr<DcmDataset> data;                    ///< without ROI Contour Sequence
  std::vector<std::unique_ptr<DcmItem>> roi, contour;  ///< of each structure, without Contour Sequence; may be null
  std::vector<std::unique_ptr<DcmItem>> observations;  ///< of all
};

/// Contour Geometric Type (3006,0042).
constexpr std::array<std::pair<ContourKind, const char*>, 5> kContourKinds{
    {{ContourKind::point, "POINT"},
     {ContourKind::open, "OPEN_PLANAR"},
     {ContourKind::open_nonplanar, "OPEN_NONPLANAR"},
     {ContourKind::closed, "CLOSED_PLANAR"},
     {ContourKind::closed_xor, "CLOSEDPLANAR_XOR"}}};

}  // namespace tetwarp
