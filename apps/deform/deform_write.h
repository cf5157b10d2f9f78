// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "apps/deform/deform_report.h"

namespace tetwarp::apps {

/// The last two stages of `tetwarp deform` and of a case of `batch`, after the pass (deform_pass.h) has made the
/// results.
///
/// Writes what is not written yet: OUTPUT, volumes that go along, structure sets, and last the sidecar and the report.
/// All files have hidden names in the folders of their outputs until `commit_outputs`, so that an output appears whole
/// or not at all.
/// @param run           the request, and what the stages before made
/// @param sinks         files of maps and of a series, which got their parts while these were made; they are closed
/// here
/// @param outputs       where the files are put; an exception before `commit_outputs` removes them
/// @param input_sha256  of INPUT, as sidecars give it
/// @return  what only writing tells, for `deform_report.h`
/// @throws Error where a file cannot be written; Cancelled
DeformWritten write_outputs(const DeformRun& run, DeformSinks sinks, DeformOutputs& outputs, std::string input_sha256);

/// Gives the outputs their names, replacing files that had them. Meanwhile other threads free the volumes and the field
/// that the stages made. @throws Error where a name cannot be given
void commit_outputs(DeformOutputs& outputs, DeformInputs inputs, DeformField field, DeformResult result);

}  // namespace tetwarp::apps
