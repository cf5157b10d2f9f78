// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the data set of a derived slice.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/dicom/privacy/dicom_deidentify.h"
#include "io/dicom/scan/dicom_headers.h"

namespace tetwarp {

/// Whether a text is a UID (PS3.5 9.1).
bool is_uid(const std::string& text);

/// Derivation Description and Code (PS3.3 C.7.6.1) and Contributing Equipment (C.12.1.1): what was done, and by what.
void put_how_derived(DcmItem& target, const DicomDerivation& derivation);

/// What the slices of a derived series share, and what a slice has to know of the others: taken from the source once,
/// so that slices can then be made in parallel.
struct DerivedSeries {
  std::string study_uid, series_uid, frame_of_reference_uid;
  std::string source_series_uid;                     ///< empty where the source has none
  std::string source_frame_of_reference_uid;         ///< made up where the source has none
  std::string number, description;                   ///< Series Number and Description
  std::vector<std::string> sop_class, sop_instance;  ///< of the source's slices
  std::vector<int> frame;                    ///< frame of each slice of the source, from 1; 0: the slice is a file
  std::vector<int> instance_number;          ///< of the output's slices, each once
  std::vector<std::size_t> header;           ///< of the output's slices, the source's whose header each takes over
  std::set<DcmTagKey> varying;               ///< see varying_acquisition
  std::optional<Deidentifier> deidentifier;  ///< de-identified the members before this one
  std::optional<PaddingRange> padding;       ///< HU: the source's, where all slices agree and int16 can hold it
};

/// Image Type of a slice derived from another: values 1 to 3 are those of a cross-section that was computed; vendors'
/// own ones follow. Separated by backslashes.
std::string derived_image_type(DcmDataset& source);

/// Appends an item to Contributing Equipment (PS3.3 C.12.1.1): this program, the field and what was chosen.
/// @param purpose  code of context group 7005, and @param meaning  its meaning
void put_equipment(DcmItem& target, const std::string& purpose, const std::string& meaning,
                   const DicomDerivation& derivation);

/// Series Number: the one of the source plus 1000: beside it in a list, and seldom taken.
std::string derived_number(DcmItem& source);

/// Series Description: "deformed: " (or "resampled: ") and the source's own, cut to the 64 characters of VR LO. A text
/// of several bytes a character that is too long is left out, as cutting it could break a character; so is all of a
/// de-identified series.
std::string derived_description(DcmItem& source, const DicomDerivation& derivation);

/// @param geometry  of the output
/// @throws InputError for headers without slices
DerivedSeries derive_series(const DicomHeaders& source, const Geometry& geometry, const DicomDerivation& derivation);

/// Puts everything of slice k but Pixel Data and SOP Instance UID into the empty item `target`.
/// @param sampled  the source slices that it was interpolated from
/// @return type 2 attributes that were missing and are now there, empty
std::vector<DcmTagKey> derive_slice(DcmItem& target, DcmDataset& source, const DerivedSeries& series,
                                    const DicomDerivation& derivation, const SliceRange& sampled,
                                    const Geometry& geometry, std::size_t k);

}  // namespace tetwarp
