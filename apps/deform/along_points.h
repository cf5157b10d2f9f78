// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/cli/options.h"
#include "deform/points.h"
#include "io/points_file.h"

namespace tetwarp::apps {

// Landmarks and surfaces, which go where the voxels under them go. Each stage of a run has a value for each of them, in
// the order of the options.

/// A --points: IN=OUT[:lps|:ras].
struct PointsChoice {
  std::filesystem::path input, output;
  std::optional<PointFrame> told;
};

/// Points as the field moved them, one for each that was read.
struct MovedPoints {
  std::vector<glm::dvec3> points;  ///< LPS mm
  std::vector<PointStatus> status;
};

/// @throws UsageError for a text that is not of this form, a suffix that is not known, or two that differ
PointsChoice parse_points(const std::string& text);

/// Reads all files. @throws InputError
std::vector<PointsFile> read_points(const std::vector<PointsChoice>& choices);
/// Moves what was read, by the forward map. @param output  grid of OUTPUT
std::vector<MovedPoints> move_all_points(const std::vector<PointsFile>& files, const Geometry& output,
                                         const FieldView& field, const Limits& limits, const Control& control);
/// @param staged  where each is written
void write_points(const std::vector<std::filesystem::path>& staged, const std::vector<PointsFile>& files,
                  const std::vector<MovedPoints>& moved);

/// "points" of sidecar and report: input, output, points, outside, frame of each.
nlohmann::json points_json(const std::vector<PointsChoice>& choices, const std::vector<PointsFile>& files,
                           const std::vector<MovedPoints>& moved);
/// For people: what was assumed, and how many points lie outside.
std::vector<std::string> notes_of(const std::vector<PointsChoice>& choices, const std::vector<PointsFile>& files,
                                  const std::vector<MovedPoints>& moved);

}  // namespace tetwarp::apps
