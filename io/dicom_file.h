#pragma once

// Private to io/: DICOM files as bytes.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp {

/// The data set as a file holds it: Explicit VR Little Endian, sequences of explicit length, no group lengths.
/// @throws Error when DCMTK cannot encode it
std::vector<std::byte> encoded(DcmDataset& dataset);

/// Gives the data set its SOP Instance UID, a hash of everything else that it holds, and writes it as a DICOM file
/// (PS3.10). Every byte is a function of the data set. @throws Error naming the file and the system's reason (disk full
/// and so on)
void write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset);

/// "IM00042.dcm": names sort as their numbers do.
std::string dicom_file_name(int instance_number);

}  // namespace tetwarp
