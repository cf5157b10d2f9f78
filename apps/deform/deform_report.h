// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/deform/deform_pass.h"

namespace tetwarp::apps {

/// What a run came to in its stages. It refers to their values, which are finished.
struct DeformRun {
  const DeformRequest& request;
  const DeformPlan& plan;
  const DeformHeaders& headers;
  const DeformInputs& inputs;
  const DeformField& field;
  const DeformResult& result;
};

/// What was written, of that which only writing tells.
struct DeformWritten {
  std::string input_sha256;
  std::optional<DicomWriteReport> series;  ///< of OUTPUT, where it is one
  std::vector<AlongWritten> along;
  std::vector<StructureWriteReport> structures;
  double seconds = 0;
};

/// OUTPUT.json: without a clock. It names all that was read; Record closes that of a de-identified run.
nlohmann::json sidecar(const DeformRun& run, const DeformWritten& written);
/// --report: the sidecar, times, memory, and what the field is like.
nlohmann::json report_with_times(const DeformRun& run, const DeformWritten& written);
/// One line for people.
std::string summary(const DeformRun& run);
/// What people should know, "warning: ..." and "note: ...".
std::vector<std::string> notes_of(const DeformRun& run, const DeformWritten& written);
/// What the preview says above the pictures: the fields by name, files without their folders, or where they would tell
/// the patient not at all.
std::string title_of(const DeformRequest& request);

}  // namespace tetwarp::apps
