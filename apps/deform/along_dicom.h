// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/cli/input.h"
#include "apps/deform/along_choice.h"
#include "io/dicom_dose.h"
#include "io/dicom_segmentation.h"

namespace tetwarp::apps {

/// OUTPUT, where it is a series: as it was written, and how it came to be.
struct DerivedOutput {
  WrittenSeries written;
  DicomDerivation derivation;  ///< its parameters and description without what is about the voxels of INPUT
};

/// The header of a SEG. @throws UsageError for an output that is none, or a background; what read_segmentation_header
/// throws
DicomSegmentation open_segmentation(const AlongVolumeChoice& choice, const InputHeader& input);

/// The grid that a segmentation goes back onto: that of its frames, with as many slices more as lie between those of
/// INPUT if they are parallel, so that what is moved beyond the outermost frames is not lost.
Geometry own_grid(const DicomSegmentation& segmentation, const Geometry& input);

/// What a segmentation goes through a field with, unless something else is chosen: a binary one by vote.
Interpolation usual_interpolation(const DicomSegmentation& segmentation);

/// @param frame  Frame of Reference UID of the object at `path`
/// @return a note, where INPUT has none. @throws InputError where the two differ
std::optional<std::string> compare_frames(const std::filesystem::path& path, const std::string& frame,
                                          const InputHeader& input);

/// How an object came to be. @param interpolation, background  with which it went through the field
DicomAlong dicom_along(const AlongVolumeChoice& choice, const std::string& sha256, Interpolation interpolation,
                       double background, const DerivedOutput& series);

nlohmann::json to_json(const DoseReport& report);
nlohmann::json to_json(const SegmentationReport& report, const DicomSegmentation& segmentation);

}  // namespace tetwarp::apps
