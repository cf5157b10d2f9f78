// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/deform/deform_plan.h"
#include "apps/deform/field_source.h"
#include "deform/field_quality.h"

namespace tetwarp::apps {

/// What a forward field is like, and its inverse.
struct FieldCheck {
  FieldQuality quality;
  RoundTrip trip;
};

/// One run of `deform`: what it was given, and what it did.
struct DeformRecord {
  explicit DeformRecord(const DeformOptions& given)
      : options(given), points(given.points), outputs(begin_outputs(given, points)) {}

  const DeformOptions& options;
  PointsOption points;
  DeformOutputs outputs;
  DeformPlan plan;
  std::shared_ptr<const InputVolume> input;
  std::shared_ptr<const DicomHeaders> headers;  ///< of a series: this run's own, for one thread at a time reads them
  std::string volume_label;                     ///< which of several volumes of its series the input is
  std::vector<std::string> set_aside;           ///< files of the input's folder that are no slices of it
  AnyField field;
  std::string input_sha256, field_sha256, backend;
  double background = 0;
  AnyVolume output;
  Report report;
  std::optional<FieldCheck> check;  ///< where the report tells of it
  std::optional<DicomWriteReport> dicom_report;
  std::vector<std::pair<std::string, double>> stages;  ///< seconds
};

/// How all that goes through the field came to be; INPUT's voxels have parameters of their own.
DicomDerivation derivation(const DeformRecord& of);
DicomDerivation input_derivation(const DeformRecord& of);

/// What a de-identification did not do, "note: ..." and "warning: ..."; none where there was no de-identification.
std::vector<std::string> deidentification_notes(const DeformRecord& of);

/// OUTPUT.json: without a clock. It names all that was read; Record closes that of a de-identified run.
nlohmann::json sidecar(const DeformRecord& of);
/// --report: the sidecar, times, memory, and what the field is like.
nlohmann::json report_with_times(const DeformRecord& of);
/// One line for people.
std::string summary(const DeformRecord& of);

}  // namespace tetwarp::apps
