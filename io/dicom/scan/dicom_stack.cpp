// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_stack.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

using Headers = std::vector<DicomFileHeader>;

double along(const DicomFileHeader& header, const glm::dvec3& normal) { return glm::dot(*header.position, normal); }

std::string point_text(const glm::dvec3& p) { return number(p.x) + "\\" + number(p.y) + "\\" + number(p.z); }

/// A refusal that names the largest set of slices at one position; none if no position has several.
std::optional<std::string> same_position(const Headers& files, const glm::dvec3& normal) {
  std::size_t crowded = 0, worst = 0, worst_count = 1;
  for (std::size_t i = 0; i < files.size();) {
    std::size_t end = i + 1;
    while (end < files.size() && along(files[end], normal) - along(files[end - 1], normal) <= kSamePosition) ++end;
    if (end - i > 1) ++crowded;
    if (end - i > worst_count) {
      worst = i;
      worst_count = end - i;
    }
    i = end;
  }
  if (crowded == 0) return std::nullopt;
  std::string names;
  for (std::size_t i = worst; i < worst + std::min<std::size_t>(worst_count, 4); ++i) {
    names += (names.empty() ? "" : ", ") + shown(files[i]);
  }
  if (worst_count > 4) names += " and " + std::to_string(worst_count - 4) + " more";
  if (crowded > 1) names += " (likewise at " + std::to_string(crowded - 1) + " other positions)";
  return std::to_string(worst_count) + " slices at the same position " + point_text(*files[worst].position) +
         ", expected one: " + names + "; keep one phase or acquisition in the folder";
}

/// How far slices lie beside a line through the first one.
struct Drift {
  /// The slice that is farthest from the line; null: all lie on it, but for rounding.
  const DicomFileHeader* slice = nullptr;
  /// How far `slice` lies from the line, and along the line from the first slice.
  double beside_mm = 0, distance_mm = 0;
};

/// Measures how far slices lie from a line through the first one. Rounding of position and orientation explains 0.01 mm
/// and 1e-4 of the distance along the line.
Drift drift_from(const Headers& files, const glm::dvec3& direction) {
  Drift worst;
  double worst_ratio = 1;
  for (const DicomFileHeader& header : files) {
    const glm::dvec3 step = *header.position - *files.front().position;
    const double distance = glm::dot(step, direction);
    const double beside = glm::length(step - distance * direction);
    const double ratio = beside / (0.01 + 1e-4 * distance);
    if (ratio <= worst_ratio) continue;
    worst_ratio = ratio;
    worst = {&header, beside, distance};
  }
  return worst;
}

/// Lets the stack lean as the positions of its slices say: a gantry tilt. @return why the slices are no stack; none if
/// they are one
std::optional<std::string> lean(const Headers& files, DicomSeries& series) {
  Geometry& geometry = series.geometry;
  const glm::dvec3 normal = geometry.direction[2];
  if (!drift_from(files, normal).slice) return std::nullopt;
  const glm::dvec3 along = glm::normalize(*files.back().position - *files.front().position);
  if (const Drift drift = drift_from(files, along); drift.slice) {
    return "slices are not stacked on one line, " + shown(*drift.slice) + " lies " + number(drift.beside_mm) +
           " mm beside the line from " + shown(files.front()) + " to " + shown(files.back()) +
           ", expected 0; choose the slices of one stack";
  }
  const double degrees = std::acos(std::min(glm::dot(along, normal), 1.0)) * 180 / M_PI;
  constexpr double kMost = 60;
  if (degrees > kMost) {
    return "slices lie " + number(degrees) + " degrees beside their normal, expected a gantry tilt of less than " +
           number(kMost) + "; choose the slices of one stack";
  }
  series.warnings.push_back("gantry tilt: the stack leans " + number(degrees) +
                            " degrees from the normal of its slices, which are taken where they lie");
  geometry.direction[2] = along;
  return std::nullopt;
}

/// What the last written digit of the positions means along the normal, mm, at most 0.01.
double written_digit(const Headers& files, const glm::dvec3& normal) {
  std::array<int, 3> digits{};
  for (const DicomFileHeader& header : files) {
    for (int axis = 0; axis < 3; ++axis) digits[axis] = std::max(digits[axis], header.position_decimals[axis]);
  }
  double digit = 0;
  for (int axis = 0; axis < 3; ++axis) digit += std::abs(normal[axis]) * std::pow(10.0, -digits[axis]);
  return std::min(digit, 0.01);
}

std::string gap_text(double gap, double usual, const DicomFileHeader& before, const DicomFileHeader& after) {
  std::string text = "slice gap " + number(gap) + " mm between " + shown(before) + " and " + shown(after) + ", " +
                     number(usual) + " mm elsewhere";
  const double missing = std::round(gap / usual) - 1;
  if (missing >= 1 && std::abs(gap / usual - missing - 1) < 0.02) {
    text += " (" + number(missing) + (missing > 1 ? " slices missing)" : " slice missing)");
  }
  return text;
}

/// What is uneven about the gaps between slices, by the rules of `stack_slices`; none if they are even.
std::optional<std::string> unevenness(const Headers& files, const glm::dvec3& normal) {
  std::vector<double> positions;
  for (const DicomFileHeader& header : files) positions.push_back(along(header, normal));
  const double usual = median_gap(positions), digit = written_digit(files, normal);
  const double step = (positions.back() - positions.front()) / static_cast<double>(positions.size() - 1);
  std::size_t worst = 0, uneven = 0;
  double worst_gap = usual;
  std::optional<std::size_t> off_place;
  for (std::size_t k = 1; k < positions.size(); ++k) {
    const double gap = positions[k] - positions[k - 1];
    if (std::abs(gap - usual) > 1e-3 * usual + digit) ++uneven;
    if (std::abs(gap - usual) > std::abs(worst_gap - usual)) {
      worst = k;
      worst_gap = gap;
    }
    const double place = positions.front() + step * static_cast<double>(k);
    if (!off_place && std::abs(positions[k] - place) > 1e-2 * step + digit) off_place = k;
  }
  if (uneven > 0) {
    std::string text = gap_text(worst_gap, usual, files[worst - 1], files[worst]);
    if (uneven > 1) text += " (" + std::to_string(uneven) + " gaps of " + std::to_string(files.size() - 1) + " differ)";
    return text;
  }
  if (!off_place) return std::nullopt;
  const double place = step * static_cast<double>(*off_place);
  return "slice gaps drift: " + shown(files[*off_place]) + " is expected " + number(place) +
         " mm from the first slice, found " + number(positions[*off_place] - positions.front()) + " mm";
}

/// Distance of slices, mm, for a slice that is alone: what its header says of neighbours, else its thickness.
double lone_spacing(const DicomFileHeader& slice, DicomSeries& series) {
  for (const auto& [value, name] : {std::pair{slice.slice_spacing, "Spacing Between Slices (0018,0088)"},
                                    std::pair{slice.thickness, "Slice Thickness (0018,0050)"}}) {
    if (!value || *value <= 0) continue;
    series.warnings.push_back("one slice only: its spacing of " + number(*value) + " mm is " + name);
    return *value;
  }
  series.warnings.push_back("one slice only, of unknown thickness: its spacing is set to 1 mm");
  return 1;
}

void warn_of_rotation(const Headers& files, const Geometry& geometry, DicomSeries& series) {
  const DicomFileHeader& first = files.front();
  const std::array<double, 6>& c = *first.orientation;
  const glm::dvec2 extent{geometry.spacing.x * first.pixels.columns, geometry.spacing.y * first.pixels.rows};
  const double moved = extent.x * glm::length(glm::dvec3(c[0], c[1], c[2]) - geometry.direction[0]) +
                       extent.y * glm::length(glm::dvec3(c[3], c[4], c[5]) - geometry.direction[1]);
  if (moved <= 0.01) return;
  series.warnings.push_back("Image Orientation is rounded: making it a rotation moves voxels by up to " +
                            number(moved) + " mm");
}

}  // namespace

double median_gap(const std::vector<double>& positions) {
  std::vector<double> gaps;
  for (std::size_t k = 1; k < positions.size(); ++k) gaps.push_back(positions[k] - positions[k - 1]);
  const auto middle = gaps.begin() + std::ssize(gaps) / 2;
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

glm::dmat3 rotation_of(const std::array<double, 6>& orientation) {
  const std::array<double, 6>& c = orientation;
  const glm::dvec3 row = glm::normalize(glm::dvec3(c[0], c[1], c[2]));
  const glm::dvec3 column{c[3], c[4], c[5]};
  const glm::dvec3 straight = glm::normalize(column - glm::dot(column, row) * row);
  return {row, straight, glm::cross(row, straight)};
}

std::optional<std::string> stack_slices(Headers& files, DicomSeries& series) {
  Geometry& geometry = series.geometry;
  geometry.direction = rotation_of(*files.front().orientation);
  const glm::dvec3 normal = geometry.direction[2];
  std::stable_sort(files.begin(), files.end(), [&](const DicomFileHeader& a, const DicomFileHeader& b) {
    return along(a, normal) < along(b, normal);
  });
  const DicomFileHeader &first = files.front(), &last = files.back();
  geometry.size = {first.pixels.columns, first.pixels.rows, std::ssize(files)};
  geometry.origin = *first.position;
  geometry.spacing = {first.spacing->x, first.spacing->y, 1};
  if (auto crowd = same_position(files, normal)) return crowd;
  if (files.size() == 1) {
    geometry.spacing.z = lone_spacing(first, series);
  } else {
    if (auto crooked = lean(files, series)) return crooked;
    const double leaning = glm::dot(geometry.direction[2], normal);  // cosine of the tilt: 1 for a straight stack
    const double length = (along(last, normal) - along(first, normal)) / leaning;
    geometry.spacing.z = length / static_cast<double>(files.size() - 1);
    series.uneven = unevenness(files, normal);
    for (std::size_t k = 0; series.uneven && k < files.size(); ++k)
      geometry.slices.push_back((along(files[k], normal) - along(first, normal)) / leaning);
  }
  warn_of_rotation(files, geometry, series);
  return std::nullopt;
}

}  // namespace tetwarp
