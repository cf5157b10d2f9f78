// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/cli/input.h"
#include "apps/cli/options.h"
#include "apps/cli/output.h"
#include "apps/deform/along_dicom.h"

namespace tetwarp::apps {

/// @throws UsageError for a text that is not IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]
AlongOptions parse_along(const std::string& text);

/// Volumes that go through the same field as INPUT: labels, doses, other modalities.
class AlongVolumes {
 public:
  /// Begins their outputs. @param series  whether OUTPUT is a DICOM series, to which DICOM objects can refer
  /// @throws UsageError, and what OutputSet::add throws
  AlongVolumes(const std::vector<std::string>& texts, bool series, NiftiFrame frame, OutputSet& outputs);

  /// Reads their headers. @throws UsageError, InputError for what does not go with its output or with INPUT
  void open(const InputHeader& input);
  /// Memory of the volumes and of their outputs, the latter with `output_voxels` voxels each.
  std::uint64_t bytes(std::uint64_t output_voxels) const;
  void read(const CommonOptions& common, const Control& control);

  /// Grids of their own that volumes go back onto, each once.
  std::vector<Geometry> own_grids() const;
  /// Targets of the volumes that go onto a grid: with `own`, those that keep their own grid, otherwise the others. The
  /// targets refer to this object.
  std::vector<Target> targets_on(const Geometry& grid, bool own, Interpolation otherwise);
  /// @param series  as it was written, and how: where OUTPUT is one
  void write(const std::optional<int>& compression, const std::string& descrip,
             const std::optional<DerivedOutput>& series);
  nlohmann::json describe() const;
  /// What people should know.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct One {
    AlongOptions options;
    std::filesystem::path staged;
    InputHeader header;
    std::optional<DicomSegmentation> segmentation;
    Geometry own_grid;
    InputVolume input;                        ///< its volume is the only source, or there is none
    std::vector<AnyVolume> sources, outputs;  ///< of a segmentation one each segment, else one
    std::string sha256;
    Target target;  ///< of the first
    std::optional<DoseReport> dose_report;
    std::optional<SegmentationReport> segmentation_report;
  };
  void write_object(One& one, const DerivedOutput& series);

  std::deque<One> volumes_;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::apps
