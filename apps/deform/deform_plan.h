// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "apps/cli/output.h"
#include "apps/cli/shared_input.h"
#include "apps/deform/along_structures.h"
#include "apps/deform/along_volumes.h"
#include "apps/deform/deform_request.h"

namespace tetwarp::apps {

/// What headers say, and small files that are read whole.
struct DeformHeaders {
  InputHeader input;
  AlongHeaders along;
  std::vector<StructuresInput> structures;
  std::vector<PointsFile> points;
  std::optional<Geometry> grid;    ///< of the volume that --grid names
  std::vector<std::string> notes;  ///< for people, of INPUT and of files that are read for their grid or values
  double seconds = 0;
};

/// Reads headers. @param outputs  learn of the slices that are read
/// @throws UsageError for an output or background that INPUT does not go with, or an output that touches a slice;
/// InputError for a volume that cannot be deformed, or a file that cannot be read
DeformHeaders open_headers(const DeformRequest& request, SharedInput& input, OutputSet& outputs);

/// What outputs take on disk, but for what is small.
struct DiskBytes {
  std::uint64_t plain = 0;   ///< of outputs that are written as they are
  std::uint64_t packed = 0;  ///< of outputs that are compressed or leave out what is empty, before that

  DiskBytes& operator+=(const DiskBytes& other) {
    plain += other.plain;
    packed += other.packed;
    return *this;
  }
};

/// What will be made, as far as headers tell.
struct DeformPlan {
  std::optional<Geometry> grid;  ///< of the output; none where it is known only once the field is
  std::uint64_t bytes = 0;       ///< of memory; a grid that is not known is taken for INPUT's
  DiskBytes disk;                ///< of all outputs; a grid that is not known is taken for INPUT's
};

/// Touches the disk for a field of files alone, whose size their headers tell.
/// @throws InputError for a field that cannot be read or a grid that does not go with the outputs, Error where more
/// memory is needed than is allowed
DeformPlan plan_deformation(const DeformRequest& request, const DeformHeaders& headers);

/// What would be written, for --dry-run.
std::string describe(const DeformPlan& plan, const DeformRequest& request);

}  // namespace tetwarp::apps
