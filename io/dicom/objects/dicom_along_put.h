// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what objects that go along with a derived series have in common.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <span>
#include <string>
#include <vector>

#include "io/dicom_along.h"

namespace tetwarp {

/// SOP Class UID of a DICOM file; empty for what is none or cannot be read.
std::string sop_class_of(const std::filesystem::path& path);

/// Reads the object up to its Pixel Data, and de-identifies it if the derivation says so.
/// @throws InputError for a file that changed since its header was read
DcmDataset& read_source(DcmFileFormat& format, const DicomAlong& along);

/// Puts patient, study, series, frame of reference, equipment and derivation into the empty item `target`: of the
/// source what `carry_over` takes, in the study and frame of reference of the derived series, as a series of its own.
/// Where the source belongs to another study, Study Date, Time, ID and Accession Number are those of the derived
/// series, and its description goes.
/// @param type_2  put in empty where missing
/// @throws InputError for a Patient ID other than that of the derived series
void put_along(DcmItem& target, DcmDataset& source, const DicomAlong& along, const WrittenSeries& series,
               std::span<const DcmTagKey> type_2);

/// Appends a reference to slice k of the derived series (PS3.3 10.8). @return the item
DcmItem& append_slice_reference(DcmItem& target, const DcmTagKey& sequence, const WrittenSeries& series, std::size_t k);

}  // namespace tetwarp
