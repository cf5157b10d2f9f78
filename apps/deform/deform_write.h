// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "apps/deform/deform_report.h"

namespace tetwarp::apps {

/// Writes what is not written yet, under hidden names: the last are the sidecar and the report.
/// @param sinks  which got their parts while these were made; they end here
/// @param input_sha256  of INPUT, as sidecars give it
DeformWritten write_outputs(const DeformRun& run, DeformSinks sinks, DeformOutputs& outputs, std::string input_sha256);

/// Gives the outputs their names. Meanwhile what the stages hold is freed.
void commit_outputs(DeformOutputs& outputs, DeformInputs inputs, DeformField field, DeformResult result);

}  // namespace tetwarp::apps
