#pragma once

// Private to io/: DICOM files as bytes.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

/// The data set as a file holds it: Explicit VR Little Endian, sequences of explicit length, no group lengths.
/// @throws Error when DCMTK cannot encode it
std::vector<std::byte> encoded(DcmDataset& dataset);

/// Gives the data set its SOP Instance UID, a hash of everything else in the file, and writes it as a DICOM file
/// (PS3.10) with `voxels` as its Pixel Data. Every byte is a function of these and the encoding.
///
/// Uncompressed voxels are hashed and written from where they lie: DCMTK, which would copy them four times, encodes the
/// rest.
/// @param dataset  with Rows and Columns; without Pixel Data (7FE0,0010) and what would follow it
/// @return the SOP Instance UID
/// @throws Error naming the file and the system's reason (disk full and so on)
std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset,
                             std::span<const std::int16_t> voxels,
                             DicomEncoding encoding = DicomEncoding::uncompressed);

/// "IM00042.dcm": names sort as their numbers do.
std::string dicom_file_name(int instance_number);

}  // namespace tetwarp
