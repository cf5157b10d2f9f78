// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "io/dicom_series.h"

namespace tetwarp {

/// JSON for a volume that was derived from a CT series, with the names and units of BIDS (Brain Imaging Data Structure
/// 1.x; those of dcm2niix where BIDS has none): scanner, protocol and exposure as far as all slices of the source agree
/// on them, and what was done. Nothing of when, where and of whom: no dates, institution, device number or comments,
/// and no text that holds a word of the patient's name, or the ID.
/// @param output  grid of the volume, whose rows and columns Image Orientation is about
std::string bids_sidecar(const DicomHeaders& source, const Geometry& output, const DicomDerivation& derivation);

}  // namespace tetwarp
