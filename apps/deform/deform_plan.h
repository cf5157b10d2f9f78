// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "apps/deform/along_structures.h"
#include "apps/deform/along_volumes.h"
#include "apps/deform/map_outputs.h"
#include "apps/deform/points_option.h"

namespace tetwarp::apps {

/// Where the results of `deform` go while they are made.
struct DeformOutputs {
  bool series = false;
  OutputSet set;
  std::optional<MapOutputs> maps;
  std::optional<AlongVolumes> along;
  AlongStructures structures;
  std::filesystem::path volume, sidecar, bids, field, report, preview;
  std::vector<std::filesystem::path> points;
};

/// Checks the options as far as that is possible before anything is read, and begins the outputs.
/// @throws UsageError, and what OutputSet::add throws
DeformOutputs begin_outputs(const DeformOptions& options, const PointsOption& points);

/// What will be made, as far as headers tell.
struct DeformPlan {
  Geometry grid;                   ///< of the output; with --grid fit known only once the field is
  std::uint64_t bytes = 0;         ///< of memory; --grid fit is taken for the input's grid
  std::uint64_t output_bytes = 0;  ///< on disk, were nothing compressed
};

/// Checks the header of the input. @throws UsageError for an output or background that it does not go with, InputError
/// for a volume that cannot be deformed, Error where more memory is needed than is allowed
DeformPlan plan_deformation(const DeformOptions& options, DeformOutputs& outputs, const InputHeader& input);

/// What would be written, for --dry-run.
std::string describe(const DeformPlan& plan, const DeformOptions& options, const DeformOutputs& outputs);

/// Whether the report says what the field is like: that of a pull field does not.
bool reports_quality(const DeformOptions& options);

}  // namespace tetwarp::apps
