// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: how DCMTK is given the bytes of a file.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include "io/opened_file.h"

namespace tetwarp {

struct DicomRead {
  OFCondition result;
  std::size_t rest = 0;  ///< bytes behind the place where reading ended; of a deflated data set, some of them
};

/// What a deflated data set may inflate to: up to Pixel Data, and all of it. A byte can stand for a thousand.
constexpr std::size_t kLargestInflatedHeader = std::size_t{64} << 20, kLargestInflated = std::size_t{1} << 30;

/// How deep sequences may lie in sequences. DCMTK calls itself for each, until the stack is full. Structured reports go
/// some tens deep.
constexpr std::size_t kDeepestSequence = 100;

/// Reads a file as DCMTK's own loadFileUntilTag does, except for deflated data sets, of which DCMTK reads every value
/// at once, and so allocates any length that a damaged file states. Here long values stay in the file until they are
/// used, deflated or not, and one that extends beyond the end is an error. Deflated data are inflated only as far as
/// reading goes. Sequences deeper than kDeepestSequence are an error.
/// @param until           where reading stops; DCM_UndefinedTagKey: at the end
/// @param inflated_limit  a deflated data set that takes more bytes is an error
DicomRead parse_dicom(DcmFileFormat& format, const std::filesystem::path& file, const DcmTagKey& until,
                      E_FileReadMode mode = ERM_autoDetect, std::size_t inflated_limit = kLargestInflated);
/// Reads an open file as the overload for paths does. `format` may keep the file: a deflated data set is inflated on
/// demand.
DicomRead parse_dicom(DcmFileFormat& format, const std::shared_ptr<OpenedFile>& file, const DcmTagKey& until,
                      E_FileReadMode mode = ERM_autoDetect, std::size_t inflated_limit = kLargestInflated);

/// Reads a file in memory as the overload for paths does. After a good result nothing of `format` points to that
/// memory.
DicomRead parse_dicom(DcmFileFormat& format, std::span<const std::byte> bytes, const DcmTagKey& until,
                      std::size_t inflated_limit = kLargestInflated);

}  // namespace tetwarp
