// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/deform/deform_field.h"
#include "apps/deform/deform_outputs.h"
#include "deform/field_quality.h"

namespace tetwarp::apps {

/// What a forward field is like, and its inverse.
struct FieldCheck {
  FieldQuality quality;
  RoundTrip trip;
};

/// What receives results while they are made. Without files nothing is written.
struct DeformSinks {
  std::unique_ptr<DerivedSeriesWriter> series;  ///< null: OUTPUT is written as a whole, later
  MapStream maps;
  OutputSet& outputs;
};
/// Begins the files of maps, and of a series. @throws Error where one cannot be written
DeformSinks open_sinks(const DeformRequest& request, const DeformInputs& inputs, const DeformField& field,
                       DeformOutputs& outputs);

/// What came out of the field.
struct DeformResult {
  std::string backend;
  AnyVolume output;
  std::vector<AlongResult> along;
  std::vector<MovedStructures> structures;
  std::vector<MovedPoints> points;
  Report report;
  std::optional<FieldCheck> check;  ///< where the report tells of it
  double seconds = 0, check_seconds = 0;
};

/// Sends all that goes through the field; sinks get their parts meanwhile. Then looks at what the field is like, where
/// the report says so. @param room  of the field, which becomes the output
DeformResult resample(const DeformRequest& request, const DeformHeaders& headers, const DeformInputs& inputs,
                      const DeformField& field, AnyVolume room, DeformSinks& sinks, const Worker& worker);

/// How all that goes through the field came to be; INPUT's voxels have parameters of their own.
DicomDerivation derivation_of(const DeformRequest& request, const DeformInputs& inputs, const DeformField& field);
DicomDerivation input_derivation_of(const DeformRequest& request, const DeformInputs& inputs, const DeformField& field);

}  // namespace tetwarp::apps
