// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "apps/cli/reads.h"
#include "apps/deform/along_choice.h"
#include "apps/deform/along_points.h"
#include "apps/deform/map_outputs.h"
#include "apps/fields/field_choice.h"
#include "deform/simulate/scenario.h"

namespace tetwarp::apps {

// A run of `deform` goes through stages, each a function that returns a value which later ones take: request (this
// page), outputs (deform_outputs.h), headers and plan (deform_plan.h), inputs and field (deform_field.h), result
// (deform_pass.h), what was written (deform_write.h) and the report (deform_report.h). deform_command.cpp and
// batch/case_run.cpp call them in this order.

/// A field that is simulated, of a page of scenario.
struct ScenarioChoice {
  std::filesystem::path file, labels;  ///< labels: on the grid of INPUT; empty: none
};

/// What the texts of a command line name, parsed.
struct DeformSources {
  std::variant<FieldChoice, ScenarioChoice> field;
  std::vector<AlongChoice> along;
  std::vector<PointsChoice> points;
};
/// @throws UsageError for a text that cannot be taken apart, and as parse_field
DeformSources parse_sources(const DeformOptions& options);
/// What `deform` reads other than INPUT.
Reads other_reads_of(const DeformOptions& options, const DeformSources& sources);

/// A scenario that was read.
struct Simulated {
  ScenarioChoice choice;
  simulate::Scenario scenario;
};

/// What a run is to do: its options, checked as far as that is possible before headers are read.
struct DeformRequest {
  const DeformOptions& options;
  std::variant<FieldChoice, Simulated> field;
  std::vector<AlongVolumeChoice> volumes;
  std::vector<AlongStructuresChoice> structures;
  std::vector<PointsChoice> points;
  bool series = false;  ///< OUTPUT is a DICOM series
  Reads others, reads;  ///< what is read other than INPUT, and with it
};

/// Takes options apart. Refers to them. Nothing is written.
/// @throws UsageError; InputError for a scenario that cannot be read
DeformRequest request_of(const DeformOptions& options);

/// @throws UsageError for an input that has no headers of a CT series
[[noreturn]] void refuse_bids(const DeformOptions& options);

/// The maps that the run makes, and where they are written. @param files  as options name them, or as they are staged
std::vector<WantedMap> wanted_maps(const DeformRequest& request, const MapOptions& files);

bool is_pull(const DeformRequest& request);
bool is_simulated(const DeformRequest& request);

/// Whether the report says what the field is like: that of a pull field does not.
bool reports_quality(const DeformRequest& request);

}  // namespace tetwarp::apps
