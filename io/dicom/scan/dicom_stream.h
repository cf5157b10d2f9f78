// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: gives DCMTK the bytes of a file, and bounds what a damaged file can make it do.
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
  /// Bytes behind the place where reading ended; if the data set is deflated, at least one if there are any.
  std::size_t rest = 0;
};

/// The most bytes that a deflated data set may inflate to: up to Pixel Data, and as a whole. One deflated byte can
/// stand for a thousand.
constexpr std::size_t kLargestInflatedHeader = std::size_t{64} << 20, kLargestInflated = std::size_t{1} << 30;

/// The deepest nesting of sequences that is read. DCMTK calls itself for each, until the stack is full. Structured
/// reports are nested some tens deep.
constexpr std::size_t kDeepestSequence = 100;

/// Reads a file as DCMTK's own loadFileUntilTag does, with other bounds. Of a deflated data set DCMTK reads every value
/// at once, and so allocates any length that a damaged file states. Here long values stay in the file until they are
/// used, deflated or not, and one that extends beyond the end is an error. Deflated data are inflated only as far as
/// reading goes. Sequences deeper than kDeepestSequence are an error.
/// @param until           where reading stops; DCM_UndefinedTagKey: at the end
/// @param inflated_limit  a deflated data set that takes more bytes is an error
DicomRead parse_dicom(DcmFileFormat& format, const std::filesystem::path& file, const DcmTagKey& until,
                      E_FileReadMode mode = ERM_autoDetect, std::size_t inflated_limit = kLargestInflated);
/// Reads an open file like the overload for paths. `format` may keep the file: a deflated data set is inflated on
/// demand.
DicomRead parse_dicom(DcmFileFormat& format, const std::shared_ptr<OpenedFile>& file, const DcmTagKey& until,
                      E_FileReadMode mode = ERM_autoDetect, std::size_t inflated_limit = kLargestInflated);

/// Reads a file in memory like the overload for paths. After a good result nothing in `format` points to that memory.
DicomRead parse_dicom(DcmFileFormat& format, std::span<const std::byte> bytes, const DcmTagKey& until,
                      std::size_t inflated_limit = kLargestInflated);

}  // namespace tetwarp
