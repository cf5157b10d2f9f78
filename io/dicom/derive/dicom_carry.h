// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: which attributes of the source a derived series keeps.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <set>
#include <span>
#include <vector>

namespace tetwarp {

/// Attributes of acquisition (group 0018) that do not have one value for the whole series: tube current, exposure,
/// table position. After a deformation a slice shows tissue of several source slices, so these values would be false of
/// it.
/// @param own  whether each output slice takes the header of its own source slice. KVP and Slice Thickness are then
/// carried slice by slice. Otherwise Slice Thickness, where it varies, is left out: it belongs to no slice, and readers
/// that go by it (GDCM's series details) would divide an even stack
std::set<DcmTagKey> varying_acquisition(const std::vector<DcmDataset*>& slices, bool own);

/// Copies into `target` what stays true of a derived slice.
///
/// What is copied is chosen by group, because each group has a subject, and new editions of the standard add attributes
/// to groups:
/// - 0010, 0012, 0032, 0038, 0040 (patient, trial, request, visit, procedure): everything but maps of stored values;
/// - 0008, 0018, 0020 (identification, acquisition, relationship): everything but what is about one instance, other
///   images, or the place of the slice, and but the attributes in `varying`;
/// - 0028 (what the pixels mean): only a list of attributes that are about the displayed values or the patient, for all
///   the others describe stored values that no longer exist;
/// - no other group: private ones, overlays 60xx, curves 50xx, icons 0088, presentation 2050, signatures and padding
///   fffa and fffc, and what belongs to no CT are left out.
///
/// Private attributes within sequences are left out, too. An attribute of VR UN is copied as it is: nobody can look
/// into it.
void carry_over(DcmItem& target, DcmDataset& source, const std::set<DcmTagKey>& varying);

/// Copies what a companion object of a derived series (a structure set, a dose) says of patient, study and frame of
/// reference: groups 0010, 0012 and 0038, and the attributes of General Study (PS3.3 C.7.2.1), except Referenced Study
/// Sequence, whose class is retired. Private attributes are left out, within sequences too.
void carry_patient_and_study(DcmItem& target, DcmDataset& source);
/// Copies one attribute, or several, if they are there. Private attributes within their items are left out, as
/// `carry_over` does.
void carry_attribute(DcmItem& target, DcmItem& source, const DcmTagKey& tag);
void copy_over(DcmItem& target, DcmItem& source, std::span<const DcmTagKey> tags);

/// Attributes of type 2 of the CT Image IOD (PS3.3 A.3), in ascending order. They may be empty but may not be missing.
std::vector<DcmTagKey> type_2_attributes();

}  // namespace tetwarp
