// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "apps/deform/deform_report.h"

namespace tetwarp::test {

using namespace tetwarp::apps;

inline const Geometry kGrid{.size = {7, 6, 5}, .spacing = {2, 2, 3}, .origin = {10, 20, 30}};

inline Volume<std::int16_t> ramp(const Geometry& grid) {
  Volume<std::int16_t> volume{grid, {}};
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) volume.voxels.push_back(static_cast<std::int16_t>(7 * n - 300));
  return volume;
}

inline DeformOptions options_of(const std::vector<std::string>& fields) {
  DeformOptions options;
  options.common.quiet = true;
  options.common.threads = 1;
  options.input.path = "nowhere/in.nii.gz";
  options.output = "nowhere/out.nii.gz";
  options.field.forward = fields;
  options.backend = BackendChoice::cpu;
  return options;
}

inline DeformHeaders headers_of(const Geometry& grid) {
  DeformHeaders headers;
  headers.input.geometry = grid;
  return headers;
}

inline DeformInputs inputs_of(const Geometry& grid) {
  auto volume = std::make_shared<InputVolume>();
  volume->volume = AnyVolume(ramp(grid));
  volume->background = -1000;
  return {.input = volume, .headers = nullptr, .background = volume->background, .along = {}};
}

/// The values of a run whose options outlive it.
struct Stages {
  explicit Stages(const DeformOptions& options, const Geometry& grid = kGrid)
      : request(request_of(options)),
        headers(headers_of(grid)),
        plan(plan_deformation(request, headers)),
        inputs(inputs_of(grid)),
        field(make_field(request, plan, inputs, {BackendChoice::cpu, 0})) {}

  /// Sends the volume through a field. @param wanted  maps that no file gets
  DeformResult resampled(const std::vector<WantedMap>& wanted = {}) {
    OutputSet none(Reads(), false);
    DeformSinks sinks{nullptr, MapStream(field.grid, none), none};
    add_maps(wanted, field.grid, nullptr, sinks.maps);
    return resample(request, headers, inputs, field, std::move(field.room), sinks, {BackendChoice::cpu, 0});
  }

  DeformRequest request;
  DeformHeaders headers;
  DeformPlan plan;
  DeformInputs inputs;
  DeformField field;
};

inline std::vector<std::int16_t> voxels_of(const AnyVolume& volume) {
  const auto values = volume.as<std::int16_t>();
  return {values.begin(), values.end()};
}

template <class Failure>
std::string failure(const std::function<void()>& call) {
  try {
    call();
  } catch (const Failure& error) {
    return error.what();
  }
  return "";
}

}  // namespace tetwarp::test
