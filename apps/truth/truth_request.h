// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/cli/options.h"
#include "deform/truth/family.h"
#include "deform/truth/noise.h"

namespace tetwarp::apps {

/// What the options of `truth` ask for, taken apart.
struct TruthRequest {
  truth::Roles roles;
  std::vector<truth::CaseChoice> cases;
  /// Noise that is added; empty: as much as the volume has, which is measured.
  std::optional<truth::Noise> noise;
};

/// @throws UsageError for options that are no roles, cases or noise, or do not go together
TruthRequest parse_truth(const TruthOptions& options);

/// Whether INPUT is a manifest by its suffix: .csv, .jsonl or .ndjson.
bool is_truth_manifest(const std::filesystem::path& input);

/// The options of each row of a manifest: those of the command line, with what the row has in their place. Sets lie in
/// folders of OUTPUT, named by the key `study`. Files that rows name have to exist; their paths are relative to the
/// manifest's folder.
/// @throws InputError with all errors of the manifest; UsageError for --labels and the like beside a manifest
std::vector<TruthOptions> read_truth_manifest(const TruthOptions& options);

}  // namespace tetwarp::apps
