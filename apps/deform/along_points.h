// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/cli/output.h"
#include "deform/points.h"
#include "io/points_file.h"

namespace tetwarp::apps {

/// The `--points IN=OUT[:lps|:ras]` of one command: landmarks and surfaces that go where the voxels under them go.
class PointsOption {
 public:
  /// @throws UsageError for a text that is not of this form, a suffix that is not known, or two that differ
  explicit PointsOption(const std::vector<std::string>& texts);

  bool empty() const { return pairs_.empty(); }
  std::vector<std::filesystem::path> inputs() const;
  /// Where each is to be written, one a `--points`.
  std::vector<std::filesystem::path> add_outputs(OutputSet& outputs) const;

  /// Reads all files. @throws InputError
  void read();
  /// Moves what was read, by the forward map.
  void move(const Geometry& output, const FieldView& field, const Limits& limits, const Control& control);
  /// @param staged  as `add_outputs` gave
  void write(const std::vector<std::filesystem::path>& staged) const;

  /// "points" of sidecar and report: input, output, points, outside, frame of each.
  nlohmann::json to_json() const;
  /// For people: what was assumed, and how many points lie outside.
  std::vector<std::string> notes() const;

 private:
  struct Pair {
    std::filesystem::path input, output;
    std::optional<PointFrame> told;
    std::optional<PointsFile> file;
    std::vector<glm::dvec3> moved;
    std::vector<PointStatus> status;

    std::size_t outside() const;
  };

  std::vector<Pair> pairs_;
};

}  // namespace tetwarp::apps
