// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_structures.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "apps/cli/input.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// Interpolation loses what is thin and runs at a slant to its slices, so that contours hardly overlap. Where it takes
/// more than this part of the volume away, the nearest contours are taken instead.
constexpr double kThin = 0.1;

std::filesystem::path input_of(const std::string& text) { return text.substr(0, text.find('=')); }

/// Whether a place is in one of the voxels of a grid, or on the border of one.
bool is_in_voxel(const AffineMap& index, const glm::i64vec3& size, const glm::dvec3& point) {
  const glm::dvec3 at = index(point), last(size - std::int64_t{1});
  constexpr double kHalf = 0.501;
  return glm::clamp(at, glm::dvec3(-kHalf), last + kHalf) == at;
}

std::size_t count_beyond(const std::vector<MovedContour>& contours, const Geometry& output) {
  const AffineMap index = index_from_point(output);
  return static_cast<std::size_t>(std::count_if(contours.begin(), contours.end(), [&](const MovedContour& moved) {
    return std::any_of(moved.contour.points.begin(), moved.contour.points.end(),
                       [&](const glm::dvec3& point) { return !is_in_voxel(index, output.size, point); });
  }));
}

/// mm3; 0 where the contours are no solid.
double volume_of(std::span<const Contour> contours, const Geometry& grid) try {
  return ContourStack(contours, grid).volume();
} catch (const InputError&) {
  return 0;
}

}  // namespace

bool AlongStructures::is_one(const std::string& text) { return is_dicom_structure_set(input_of(text)); }

AlongStructures::AlongStructures(const std::vector<std::string>& texts, bool series, OutputSet& outputs) {
  for (const std::string& text : texts) {
    Set& set = sets_.emplace_back();
    set.input = input_of(text);
    set.output = text.substr(std::min(text.find('='), text.size() - 1) + 1);
    if (set.output.extension() != ".dcm") {
      throw UsageError("--with \"" + text +
                       "\" is an RT Structure Set, which is written as one; expected IN.dcm=OUT.dcm");
    }
    if (!series) {
      throw UsageError(
          "--with \"" + text +
          "\" is an RT Structure Set, whose contours lie on slices of a DICOM series; name a folder as OUTPUT");
    }
    set.staged = outputs.add(set.output);
  }
}

void AlongStructures::read(const std::string& frame_of_reference_uid) {
  for (Set& set : sets_) {
    set.structures = read_structure_set(set.input);
    set.sha256 = hash_file(set.input);
    set.rois.resize(set.structures.structures.size());
    for (const Structure& structure : set.structures.structures) {
      const std::string& frame = structure.frame_of_reference_uid;
      require(!frame.empty() && frame == frame_of_reference_uid,
              "ROI " + std::to_string(structure.number) + " lies in the frame of reference " +
                  (frame.empty() ? "(no UID)" : shown(frame)) + ", the series in " +
                  (frame_of_reference_uid.empty() ? "(no UID)" : shown(frame_of_reference_uid)) + ", " +
                  shown(set.input) + "; give a structure set that was drawn on the series");
    }
  }
}

void AlongStructures::move(Roi& roi, const Structure& structure, const PointMover* mover, const Geometry& source,
                           const Geometry& output, Outside outside) {
  const std::vector<Contour>& contours = structure.contours;
  std::vector<MovedContour> moved;
  for (const Contour& contour : contours) {
    if (is_closed(contour.kind)) continue;
    if (mover) moved.push_back(ContourMover(*mover, output).move(contour));
    if (mover && (moved.back().outside == 0 || outside == Outside::rest)) continue;
    ++roi.left_out;
    if (mover) moved.pop_back();
  }
  if (!moved.empty()) roi.how = How::points;
  roi.beyond = count_beyond(moved, output);
  for (MovedContour& one : moved) roi.moved.push_back(std::move(one.contour));
  if (std::none_of(contours.begin(), contours.end(), [](const Contour& c) { return is_closed(c.kind); })) return;
  roi.volume_before = volume_of(contours, source);
  if (mover && take_moved(roi, ContourMover(*mover, output), contours, source, output, outside)) return;
  try {
    roi.reslicer.emplace(contours, source, output);
  } catch (const InputError& error) {
    roi.problem = error.what();
    return;
  }
  roi.how = How::resliced;
  roi.parts = roi.reslicer->solid().parts();
  if (!mover) return;
  std::vector<MovedContour> closed;
  for (const Contour& contour : contours)
    if (is_closed(contour.kind)) closed.push_back(ContourMover(*mover, output).move(contour));
  roi.beyond += count_beyond(closed, output);
}

bool AlongStructures::take_moved(Roi& roi, const ContourMover& mover, std::span<const Contour> contours,
                                 const Geometry& source, const Geometry& output, Outside outside) {
  auto moved = mover.move_within_slices(contours, source, outside);
  if (!moved) return false;
  roi.how = How::points;
  roi.beyond += count_beyond(*moved, output);
  std::vector<Contour> closed;
  for (MovedContour& one : *moved) closed.push_back(std::move(one.contour));
  roi.volume_after = volume_of(closed, output);
  std::move(closed.begin(), closed.end(), std::back_inserter(roi.moved));
  return true;
}

void AlongStructures::move(const PointMover* mover, const Geometry& source, const Geometry& output, Outside outside,
                           int threads) {
  forward_ = mover != nullptr;
  last_slice_ = output.size.z - 1;
  for (Set& set : sets_) {
    for_each_index(set.rois.size(), threads, {.stop = interrupt_token()}, [&](std::size_t n) {
      move(set.rois[n], set.structures.structures[n], mover, source, output, outside);
    });
  }
}

bool AlongStructures::needs_inverse() const {
  return std::any_of(sets_.begin(), sets_.end(), [](const Set& set) {
    return std::any_of(set.rois.begin(), set.rois.end(), [](const Roi& roi) { return roi.reslicer.has_value(); });
  });
}

void AlongStructures::reslice(const ConstVolumeView& inverse_mm, int threads) {
  std::vector<Roi*> rois;
  for (Set& set : sets_)
    for (Roi& roi : set.rois)
      if (roi.reslicer) rois.push_back(&roi);
  const auto [begin, end] = std::pair(inverse_mm.buffered.begin.z, inverse_mm.buffered.end.z);
  const auto slices = static_cast<std::size_t>(end - begin);
  std::vector<std::array<SlicedContours, 2>> sliced(rois.size() * slices);
  for_each_index(sliced.size(), threads, {.stop = interrupt_token()}, [&, begin = begin](std::size_t n) {
    sliced[n] = rois[n / slices]->reslicer->slice(inverse_mm, begin + static_cast<std::int64_t>(n % slices));
  });
  for (std::size_t n = 0; n < sliced.size(); ++n) {
    for (std::size_t kind = 0; kind < sliced[n].size(); ++kind) {
      Drawn& drawn = rois[n / slices]->drawn[kind];
      SlicedContours& slice = sliced[n][kind];
      drawn.volume += slice.area * inverse_mm.geometry->spacing.z;
      drawn.cut = drawn.cut || slice.cut;
      std::move(slice.contours.begin(), slice.contours.end(), std::back_inserter(drawn.contours));
    }
  }
}

void AlongStructures::finish() {
  for (Set& set : sets_) {
    for (Roi& roi : set.rois) {
      if (!roi.reslicer) continue;
      const double nearest = roi.drawn[static_cast<std::size_t>(Between::nearest)].volume;
      const double interpolated = roi.drawn[static_cast<std::size_t>(Between::interpolated)].volume;
      if (interpolated < (1 - kThin) * nearest) roi.between = Between::nearest;
      Drawn& drawn = roi.drawn[static_cast<std::size_t>(roi.between)];
      roi.volume_after = drawn.volume;
      roi.cut = drawn.cut;
      roi.at_end = !forward_ && std::any_of(drawn.contours.begin(), drawn.contours.end(), [&](const Contour& contour) {
        return contour.slice == 0 || contour.slice == last_slice_;
      });
      std::move(drawn.contours.begin(), drawn.contours.end(), std::back_inserter(roi.moved));
      roi.drawn = {};
      roi.reslicer.reset();
    }
  }
}

void AlongStructures::write(const DicomWriteReport& series, const DicomDerivation& derivation) {
  for (Set& set : sets_) {
    std::vector<std::vector<Contour>> moved;
    for (Roi& roi : set.rois) moved.push_back(roi.moved);
    set.written = write_structure_set(set.staged, set.structures, moved, series, derivation);
  }
}

nlohmann::json AlongStructures::describe() const {
  constexpr double kMillilitre = 1000;  // mm3
  nlohmann::json list = nlohmann::json::array();
  for (const Set& set : sets_) {
    nlohmann::json rois = nlohmann::json::array();
    for (std::size_t n = 0; n < set.rois.size(); ++n) {
      const Roi& roi = set.rois[n];
      const Structure& structure = set.structures.structures[n];
      nlohmann::json one = {
          {"number", structure.number},
          {"moved", roi.how == How::points ? "points" : (roi.how == How::resliced ? "resliced" : "nothing")},
          {"contours", {structure.contours.size(), roi.moved.size()}},
          {"volume_ml", {roi.volume_before / kMillilitre, roi.volume_after / kMillilitre}}};
      if (roi.how == How::resliced)
        one["between_contours"] = roi.between == Between::interpolated ? "interpolated" : "nearest";
      if (roi.parts > 1) one["parts"] = roi.parts;
      if (roi.left_out > 0) one["contours_left_out"] = roi.left_out;
      if (roi.beyond > 0) one["contours_beyond_output"] = roi.beyond;
      if (roi.cut) one["cut"] = true;
      if (roi.at_end) one["at_end"] = true;
      if (!roi.problem.empty()) one["problem"] = roi.problem;
      rois.push_back(std::move(one));
    }
    list.push_back({{"input", set.input.string()},
                    {"sha256", set.sha256},
                    {"output", set.output.string()},
                    {"series_instance_uid", set.written.series_uid},
                    {"sop_instance_uid", set.written.sop_instance_uid},
                    {"rois", std::move(rois)}});
  }
  return list;
}

std::vector<std::string> AlongStructures::notes() const {
  std::vector<std::string> notes;
  for (const Set& set : sets_) {
    for (std::size_t n = 0; n < set.rois.size(); ++n) {
      const Roi& roi = set.rois[n];
      const Structure& structure = set.structures.structures[n];
      const std::string name = "ROI " + std::to_string(structure.number) + " of " + shown(set.input);
      const std::string of = " of " + std::to_string(structure.contours.size()) + " contours of " + name;
      if (!roi.problem.empty()) notes.push_back(name + " is left empty: " + roi.problem);
      if (roi.left_out > 0)
        notes.push_back(std::to_string(roi.left_out) + of + " are left out: the field does not say where they go");
      if (roi.beyond > 0) notes.push_back(std::to_string(roi.beyond) + of + " come to lie beyond the output");
      if (roi.cut) notes.push_back(name + " is cut off where the output ends or the field maps nothing");
      if (roi.at_end) {
        notes.push_back(name + " reaches the first or the last slice; a pull field does not say what is beyond");
      }
      if (roi.how == How::resliced && roi.moved.empty()) notes.push_back(name + " has no contour in the output");
    }
  }
  return notes;
}

}  // namespace tetwarp::apps
