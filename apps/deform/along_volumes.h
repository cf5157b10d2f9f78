// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/cli/input.h"
#include "apps/deform/along_dicom.h"

namespace tetwarp::apps {

// Volumes that go along with INPUT through the field: labels, doses, other modalities. Each stage of a run has a value
// for each of them, in the order of the options.

/// What is known of one from its header.
struct AlongHeader {
  AlongVolumeChoice choice;
  InputHeader header;
  std::optional<DicomSegmentation> segmentation;
  Geometry own_grid;
};
/// Those of a run, with what people should know.
struct AlongHeaders {
  std::vector<AlongHeader> volumes;
  std::vector<std::string> notes;
};

/// The voxels of one.
struct AlongInput {
  std::vector<AnyVolume> sources;       ///< of a segmentation one each segment, else one
  std::optional<PaddingRange> padding;  ///< of a DICOM series
  double background = 0;
  std::string sha256;
};

/// One as it came out of the field.
struct AlongResult {
  std::vector<AnyVolume> outputs;  ///< one each source
  Interpolation interpolation = Interpolation::linear;
  double background = 0;
};

/// What was written of one, if it is a DICOM object.
struct AlongWritten {
  std::optional<DoseReport> dose;
  std::optional<SegmentationReport> segmentation;
};

/// Reads headers. @throws UsageError, InputError for what does not go with its output or with INPUT
AlongHeaders open_along(const std::vector<AlongVolumeChoice>& choices, const InputHeader& input);

/// Bytes of the output of one volume, which has `output_voxels` voxels unless it has a grid of its own.
std::uint64_t along_result_bytes(const AlongHeader& header, std::uint64_t output_voxels);
/// Bytes of volumes and of their outputs, which have `output_voxels` voxels each.
std::uint64_t along_bytes(const std::vector<AlongHeader>& headers, std::uint64_t output_voxels);

std::vector<AlongInput> read_along(const std::vector<AlongHeader>& headers, const CommonOptions& common,
                                   const Control& control);

/// Grids of their own that volumes go back onto, each once.
std::vector<Geometry> own_grids_of(const std::vector<AlongHeader>& headers);

/// Room for what comes out. @param output  grid of OUTPUT
/// @param otherwise  interpolation of a volume that has none of its own
std::vector<AlongResult> make_along_results(const std::vector<AlongHeader>& headers,
                                            const std::vector<AlongInput>& inputs, const Geometry& output,
                                            Interpolation otherwise);

/// Targets of the volumes that go onto a grid: OUTPUT's, or one of `own_grids_of`. They refer to inputs and results.
std::vector<Target> along_targets(const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                                  std::vector<AlongResult>& results, const Geometry& grid, bool own);

/// @param staged  where each is written
/// @param series  OUTPUT as it was written, and how: where it is a series
std::vector<AlongWritten> write_along(const std::vector<std::filesystem::path>& staged,
                                      const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                                      const std::vector<AlongResult>& results, const ImageWriteOptions& how,
                                      const std::optional<DerivedOutput>& series);

/// "with" of sidecar and report.
nlohmann::json along_json(const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                          const std::vector<AlongResult>& results, const std::vector<AlongWritten>& written);
/// What people should know of what was written.
std::vector<std::string> notes_of(const std::vector<AlongHeader>& headers, const std::vector<AlongWritten>& written);

}  // namespace tetwarp::apps
