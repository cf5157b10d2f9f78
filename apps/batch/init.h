// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// Writes a manifest with a row for every volume of a folder that can be deformed, to be edited by a person. Volumes
/// that cannot be deformed are named in comments. It holds paths and UIDs, and nothing else that tells who a patient
/// is.
/// @throws InputError for a folder without a usable volume, and whatever scan_dicom and StagedOutput throw
int run_batch_init(const BatchOptions& options);

}  // namespace tetwarp::apps
