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

/// Puts Derivation Description and Code (PS3.3 C.7.6.1) and Contributing Equipment (C.12.1.1): what was done, and by
/// what.
void put_how_derived(DcmItem& target, const DicomDerivation& derivation);

/// What the slices of a derived series share, and what a slice has to know of the others: taken from the source once,
/// so that slices can then be made in parallel.
struct DerivedSeries {
  std::string study_uid, series_uid, frame_of_reference_uid;
  std::string source_series_uid;                     ///< empty where the source has none
  std::string source_frame_of_reference_uid;         ///< Frame of Reference UID; made up where the source has none
  std::string number, description;                   ///< Series Number and Description
  std::vector<std::string> sop_class, sop_instance;  ///< by slice of the source
  /// By slice of the source: its number among the frames of its file, from 1; 0: the slice is a file of its own.
  std::vector<int> frame;
  std::vector<int> instance_number;          ///< by slice of the output; no number occurs twice
  std::vector<std::size_t> header;           ///< by slice of the output: the source slice whose header it takes over
  std::set<DcmTagKey> varying;               ///< attributes that are left out: see varying_acquisition
  std::optional<Deidentifier> deidentifier;  ///< already applied to the members before this one
  std::optional<PaddingRange> padding;       ///< HU: the source's padding, where all slices agree and int16 can hold it
};

/// Image Type of a slice derived from another, values separated by backslashes. Values 1 to 3 say that it is a
/// cross-section and was computed; the source's further values, which vendors choose, follow.
std::string derived_image_type(DcmDataset& source);

/// Appends an item to Contributing Equipment (PS3.3 C.12.1.1): this program, the field and what was chosen.
/// @param purpose  a code of context group 7005
/// @param meaning  Code Meaning of that code
void put_equipment(DcmItem& target, const std::string& purpose, const std::string& meaning,
                   const DicomDerivation& derivation);

/// Series Number of the derived series: the source's plus 1000, which is near it in a list and seldom taken.
std::string derived_number(DcmItem& source);

/// Series Description: "deformed: " (or "resampled: ") and the source's own, cut to the 64 characters of VR LO. A text
/// whose characters take several bytes is left out if it is too long, since cutting it could break a character. Every
/// description is left out of a de-identified series.
std::string derived_description(DcmItem& source, const DicomDerivation& derivation);

/// Collects what the slices of a derived series share.
/// @param geometry  of the output
/// @throws InputError for headers without slices
DerivedSeries derive_series(const DicomHeaders& source, const Geometry& geometry, const DicomDerivation& derivation);

/// Puts everything of slice k but Pixel Data and SOP Instance UID into the empty item `target`.
/// @param sampled  the source slices that slice k was interpolated from
/// @return attributes of type 2 that were missing and that `target` now has, empty
std::vector<DcmTagKey> derive_slice(DcmItem& target, DcmDataset& source, const DerivedSeries& series,
                                    const DicomDerivation& derivation, const SliceRange& sampled,
                                    const Geometry& geometry, std::size_t k);

}  // namespace tetwarp
