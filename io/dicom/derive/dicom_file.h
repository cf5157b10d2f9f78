// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: data sets as the bytes of a DICOM file, and the writing of DICOM files.
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

/// The data set as a file holds it: little endian, sequences of explicit length, no group lengths.
/// @throws Error when DCMTK cannot encode it
std::vector<std::byte> encoded(DcmDataset& dataset, E_TransferSyntax syntax = EXS_LittleEndianExplicit);

/// What a file has before its data set: preamble, "DICM" and group 0002 (PS3.10 7.1).
/// @throws Error when DCMTK cannot encode it
std::vector<std::byte> encoded_meta(const std::string& sop_class, const std::string& sop_instance,
                                    const std::string& transfer_syntax);

/// Appends the lowest `count` bytes of a number, the lowest first.
void append_number(std::vector<std::byte>& bytes, std::uint64_t value, std::size_t count);
/// Appends tag and length of an item or a delimiter (PS3.5 7.5). @param element  element number in group fffe
void append_item_start(std::vector<std::byte>& bytes, unsigned element, std::size_t length);

/// Gives the data set its SOP Instance UID, a hash of everything else in the file, and writes it as a DICOM file
/// (PS3.10) with `voxels` as its Pixel Data. Every byte depends on these and the encoding alone.
///
/// Uncompressed voxels are hashed and written from where they lie. DCMTK, which would copy them four times, encodes
/// only what else the data set has.
/// @param dataset  with Rows and Columns; without Pixel Data (7FE0,0010) and what would follow it
/// @return the SOP Instance UID
/// @throws Error naming the file and the system's reason (disk full and so on)
std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset,
                             std::span<const std::int16_t> voxels,
                             DicomEncoding encoding = DicomEncoding::uncompressed);

/// Writes a data set without Pixel Data as a DICOM file (PS3.10). Its SOP Instance UID is a hash of everything else in
/// it. An existing file is replaced. The transfer syntax is Implicit VR Little Endian: explicit ones limit a decimal
/// string to 65534 bytes, and the points of a contour may need more.
/// @return the SOP Instance UID
/// @throws Error naming the file and the system's reason
std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset);
/// Words that Pixel Data consist of: bytes (VR OB) or words of 16 bits (VR OW, PS3.5 A.2).
enum class DicomWords : std::uint8_t { bytes, of_16_bits };

/// Writes a data set as a DICOM file (PS3.10) with `pixels`, uncompressed and of any size, as its Pixel Data: as they
/// lie in memory, with a zero added to an odd number of bytes. Its SOP Instance UID is a hash of everything else in it.
/// An existing file is replaced.
/// @return the SOP Instance UID
/// @throws Error naming the file and the system's reason
std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset, std::span<const std::byte> pixels,
                             DicomWords words);

/// The name of the file of one instance, "IM00042.dcm": names sort as their numbers do.
std::string dicom_file_name(int instance_number);

}  // namespace tetwarp
