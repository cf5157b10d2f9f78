// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "io/dicom_series.h"

namespace tetwarp {

/// The JSON sidecar of a volume derived from a CT series, with names and units of BIDS (Brain Imaging Data Structure
/// 1.x; those of dcm2niix where BIDS has none).
///
/// It states scanner, protocol and exposure, as far as all slices of the source agree on them, and what was done. It
/// states nothing of when, where and of whom: no date, institution, device number or comment, and no text that contains
/// a word of the patient's name or the Patient ID.
/// @param source      headers of the source series
/// @param output      grid of the volume, to whose rows and columns Image Orientation refers
/// @param derivation  what was done
std::string bids_sidecar(const DicomHeaders& source, const Geometry& output, const DicomDerivation& derivation);

}  // namespace tetwarp
