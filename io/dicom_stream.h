#pragma once

// Private to io/: how DCMTK is given the bytes of a file.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <cstddef>
#include <filesystem>
#include <span>

namespace tetwarp {

struct DicomRead {
  OFCondition result;
  std::size_t rest = 0;  ///< bytes behind the place where reading ended, inflated
};

/// Reads a file as DCMTK's own loadFileUntilTag does, but for deflated data sets, of which DCMTK reads every value at
/// once and so allocates whatever length a damaged one says. Here long values wait where they are until they are asked
/// for, deflated or not, and one that goes beyond the end is an error before that.
/// @param until  where reading stops; DCM_UndefinedTagKey: at the end
DicomRead parse_dicom(DcmFileFormat& format, const std::filesystem::path& file, const DcmTagKey& until,
                      E_FileReadMode mode = ERM_autoDetect);

/// The same of a file in memory, to which nothing of `format` points after a good result.
DicomRead parse_dicom(DcmFileFormat& format, std::span<const std::byte> bytes, const DcmTagKey& until);

}  // namespace tetwarp
