// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_dicom.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "io/shown_text.h"

namespace tetwarp::apps {

DicomSegmentation open_segmentation(const AlongVolumeChoice& choice, const InputHeader& input) {
  const std::string name = choice.input.path.string();
  if (!is_object_output(choice.output))
    throw UsageError("a SEG comes out as a SEG, " + name + "; name the output of --with .dcm");
  if (choice.background)
    throw UsageError("background= is not for a SEG, which is empty where nothing maps, " + name + "; leave it out");
  return read_segmentation_header(choice.input.path, input.geometry.spacing.z, &input.geometry);
}

Geometry own_grid(const DicomSegmentation& segmentation, const Geometry& input) {
  constexpr double kRounding = 1e-3;  // of a voxel
  Geometry grid = segmentation.geometry;
  glm::dvec3 low(segmentation.first), high(segmentation.last);
  const AffineMap index = index_from_point(grid), point = point_from_index(input);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 at = index(point(side * glm::dvec3(input.size - std::int64_t{1})));
    low = glm::min(low, glm::ceil(at - kRounding));
    high = glm::max(high, glm::floor(at + kRounding));
  }
  grid.origin = point_from_index(grid)(low);
  grid.size = glm::i64vec3(high - low) + std::int64_t{1};
  return grid;
}

Interpolation usual_interpolation(const DicomSegmentation& segmentation) {
  return segmentation.fractional ? Interpolation::linear : Interpolation::vote;
}

std::optional<std::string> compare_frames(const std::filesystem::path& path, const std::string& frame,
                                          const InputHeader& input) {
  const std::string expected = input.series ? input.series->frame_of_reference_uid : std::string();
  if (expected.empty()) {
    return "INPUT has no Frame of Reference UID (0020,0052): whether " + path.string() +
           " lies in the same space is not known";
  }
  require(frame == expected, path.string() + " has the Frame of Reference UID (0020,0052) " +
                                 (frame.empty() ? "(none)" : shown(frame)) + ", INPUT has " + shown(expected) +
                                 "; give one that lies in the space of INPUT");
  return std::nullopt;
}

DicomAlong dicom_along(const AlongVolumeChoice& choice, const std::string& sha256, Interpolation interpolation,
                       double background, const DerivedOutput& series) {
  DicomAlong along{choice.input.path, sha256, series.derivation};
  const std::string name = name_of(interpolation);
  along.derivation.parameters = "interpolation=" + name + " background=" + nlohmann::json(background).dump() +
                                (choice.own ? " grid=own " : " grid=output ") + series.derivation.parameters;
  along.derivation.description += ", " + name + " interpolation";
  return along;
}

nlohmann::json to_json(const DoseReport& report) {
  return {{"kind", "RTDOSE"},
          {"series_instance_uid", report.series_uid},
          {"sop_instance_uid", report.sop_instance_uid},
          {"dose_grid_scaling", report.scaling},
          {"units", report.units}};
}

nlohmann::json to_json(const SegmentationReport& report, const DicomSegmentation& segmentation) {
  nlohmann::json segments = nlohmann::json::array();
  for (std::size_t n = 0; n < segmentation.segments.size(); ++n)
    segments.push_back({{"number", segmentation.segments[n].number}, {"frames", report.frames[n]}});
  return {{"kind", "SEG"},
          {"series_instance_uid", report.series_uid},
          {"sop_instance_uid", report.sop_instance_uid},
          {"type", segmentation.fractional ? "FRACTIONAL" : "BINARY"},
          {"segments", segments}};
}

}  // namespace tetwarp::apps
