// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "io/dicom_series.h"

namespace tetwarp::apps {

/// What is known of an input from its headers.
struct InputHeader {
  Geometry geometry;
  VoxelType type = VoxelType::i16;
  std::optional<DicomSeries> series;    ///< of a DICOM series; its warnings are for people
  bool dose = false;                    ///< a DICOM RT Dose file
  int components = 1;                   ///< values a voxel
  std::vector<std::string> notes = {};  ///< for people, of a file: "FILE: ..."
};

/// A volume as read, from a DICOM series or a file.
struct InputVolume {
  AnyVolume volume;
  std::optional<DicomVolume> dicom;  ///< what travels beside the voxels of a series; its own volume is moved out
  double background = 0;             ///< where nothing maps, unless an option says otherwise

  bool is_dicom() const { return dicom.has_value(); }
};

/// @throws InputError for a pipe, a socket or a device: reading one may wait for ever
void refuse_pipes(const std::filesystem::path& path);

/// Reads headers alone. @param components  whether a voxel may have several values
/// @throws InputError when there is not one usable volume (several series: lists them), UsageError
/// for DICOM options with a file, or --single with a folder
InputHeader open_input(const InputOptions& options, const Control& control, bool components = false);

/// Reads headers as the other overload does, and shows a progress bar.
InputHeader open_input(const InputOptions& options, const CommonOptions& common, bool components = false);

/// Reads the voxels of what `open_input` found.
InputVolume read_input(const InputOptions& options, const InputHeader& header, const CommonOptions& common,
                       const Control& control);

/// What is to be said of a volume file that is read for its grid or values: "FILE: ..."; nothing of what is none.
std::vector<std::string> notes_of_file(const std::filesystem::path& path, NiftiFrame frame);

/// The index of the series that is taken without --series: the only one that holds CT slices, usable or not, or the
/// only one at all.
std::optional<std::size_t> only_choice(const DicomScan& scan);

/// Six significant digits.
std::string number_text(double value);
/// The shortest text that is read as the same number.
std::string exact_number_text(double value);

/// One line a series: number, UID, modality, what tells it from other volumes of its series, size, spacing, what is
/// wrong.
std::string describe(const DicomSeries& series, std::size_t number);

/// Whether a value can be stored as a voxel of this type, rounded.
bool fits(VoxelType type, double value);

/// SHA-256 of a file's bytes, hexadecimal. @throws InputError when it cannot be read
std::string hash_file(const std::filesystem::path& path);

}  // namespace tetwarp::apps
