// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <vector>

#include "apps/cli/output.h"
#include "apps/deform/deform_request.h"

namespace tetwarp::apps {

/// Where the outputs of a run are written until they get their names; a path is empty where there is no such output.
/// They are removed with this object unless they were committed.
struct DeformOutputs {
  OutputSet set;
  std::filesystem::path volume = {}, sidecar = {}, bids = {}, field = {}, report = {}, preview = {};
  MapOptions maps = {};
  std::vector<std::filesystem::path> volumes = {}, structures = {}, points = {};  ///< that go along, one each
};

/// Begins the outputs on disk. Of a dry run into a folder the names alone are checked.
/// @throws what OutputSet::add throws
DeformOutputs begin_outputs(const DeformRequest& request);

}  // namespace tetwarp::apps
