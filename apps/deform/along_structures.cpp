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

/// Volume inside contours in mm3; 0 where they are no solid.
double volume_of(std::span<const Contour> contours, const Geometry& grid) try {
  return ContourStack(contours, grid).volume();
} catch (const InputError&) {
  return 0;
}

/// Moves closed contours whose slices stay slices. @return whether they do; else nothing is taken
bool take_moved(MovedRoi& roi, const ContourMover& mover, std::span<const Contour> contours, const Geometry& source,
                const Geometry& output, Outside outside) {
  auto moved = mover.move_within_slices(contours, source, outside);
  if (!moved) return false;
  roi.how = MovedRoi::How::points;
  roi.beyond += count_beyond(*moved, output);
  std::vector<Contour> closed;
  for (MovedContour& one : *moved) closed.push_back(std::move(one.contour));
  roi.volume_after = volume_of(closed, output);
  std::move(closed.begin(), closed.end(), std::back_inserter(roi.contours));
  return true;
}

/// Moves contours that are not closed, those of which it is known where they go.
void take_open(MovedRoi& roi, std::span<const Contour> contours, const PointMover* mover, const Geometry& output,
               Outside outside) {
  std::vector<MovedContour> moved;
  for (const Contour& contour : contours) {
    if (is_closed(contour.kind)) continue;
    if (mover) moved.push_back(ContourMover(*mover, output).move(contour));
    if (mover && (moved.back().outside == 0 || outside == Outside::rest)) continue;
    ++roi.left_out;
    if (mover) moved.pop_back();
  }
  if (!moved.empty()) roi.how = MovedRoi::How::points;
  roi.beyond = count_beyond(moved, output);
  for (MovedContour& one : moved) roi.contours.push_back(std::move(one.contour));
}

}  // namespace

std::vector<StructuresInput> read_structures(const std::vector<AlongStructuresChoice>& choices,
                                             const std::string& frame_of_reference_uid) {
  std::vector<StructuresInput> sets;
  for (const AlongStructuresChoice& choice : choices) {
    const StructuresInput& set = sets.emplace_back(StructuresInput{choice, {}, read_structure_set(choice.input)});
    sets.back().sha256 = hash_file(choice.input);
    for (const Structure& structure : set.structures.structures) {
      const std::string& frame = structure.frame_of_reference_uid;
      require(!frame.empty() && frame == frame_of_reference_uid,
              "ROI " + std::to_string(structure.number) + " lies in the frame of reference " +
                  (frame.empty() ? "(no UID)" : shown(frame)) + ", the series in " +
                  (frame_of_reference_uid.empty() ? "(no UID)" : shown(frame_of_reference_uid)) + ", " +
                  shown(choice.input) + "; give a structure set that was drawn on the series");
    }
  }
  return sets;
}

StructureMover::StructureMover(const std::vector<StructuresInput>& sets, const PointMover* mover,
                               const Geometry& source, const Geometry& output, Outside outside, int threads)
    : sets_(sets.size()), forward_(mover != nullptr), output_(output), outside_(outside), threads_(threads) {
  for (std::size_t n = 0; n < sets.size(); ++n) {
    const std::vector<Structure>& structures = sets[n].structures.structures;
    sets_[n].resize(structures.size());
    for_each_index(structures.size(), threads, {.stop = interrupt_token()},
                   [&](std::size_t roi) { move(sets_[n][roi], structures[roi], mover, source); });
  }
}

void StructureMover::move(Roi& roi, const Structure& structure, const PointMover* mover, const Geometry& source) const {
  const std::vector<Contour>& contours = structure.contours;
  take_open(roi.moved, contours, mover, output_, outside_);
  if (std::none_of(contours.begin(), contours.end(), [](const Contour& c) { return is_closed(c.kind); })) return;
  roi.moved.volume_before = volume_of(contours, source);
  if (mover && take_moved(roi.moved, ContourMover(*mover, output_), contours, source, output_, outside_)) return;
  try {
    roi.reslicer.emplace(contours, source, output_);
  } catch (const InputError& error) {
    roi.moved.problem = error.what();
    return;
  }
  roi.moved.how = MovedRoi::How::resliced;
  roi.moved.parts = roi.reslicer->solid().parts();
  if (!mover) return;
  std::vector<MovedContour> closed;
  for (const Contour& contour : contours)
    if (is_closed(contour.kind)) closed.push_back(ContourMover(*mover, output_).move(contour));
  roi.moved.beyond += count_beyond(closed, output_);
}

bool StructureMover::needs_inverse() const {
  return std::any_of(sets_.begin(), sets_.end(), [](const std::vector<Roi>& set) {
    return std::any_of(set.begin(), set.end(), [](const Roi& roi) { return roi.reslicer.has_value(); });
  });
}

void StructureMover::reslice(const ConstVolumeView& inverse_mm) {
  std::vector<Roi*> rois;
  for (std::vector<Roi>& set : sets_)
    for (Roi& roi : set)
      if (roi.reslicer) rois.push_back(&roi);
  const std::int64_t begin = inverse_mm.buffered.begin.z, end = inverse_mm.buffered.end.z;
  const auto slices = static_cast<std::size_t>(end - begin);
  std::vector<std::array<SlicedContours, 2>> sliced(rois.size() * slices);
  for_each_index(sliced.size(), threads_, {.stop = interrupt_token()}, [&](std::size_t n) {
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

void StructureMover::finish(Roi& roi) const {
  if (!roi.reslicer) return;
  MovedRoi& moved = roi.moved;
  const double nearest = roi.drawn[static_cast<std::size_t>(Between::nearest)].volume;
  const double interpolated = roi.drawn[static_cast<std::size_t>(Between::interpolated)].volume;
  if (interpolated < (1 - kThin) * nearest) moved.between = Between::nearest;
  Drawn& drawn = roi.drawn[static_cast<std::size_t>(moved.between)];
  moved.volume_after = drawn.volume;
  moved.cut = drawn.cut;
  const std::int64_t last_slice = output_.size.z - 1;
  moved.at_end = !forward_ && std::any_of(drawn.contours.begin(), drawn.contours.end(), [&](const Contour& contour) {
    return contour.slice == 0 || contour.slice == last_slice;
  });
  std::move(drawn.contours.begin(), drawn.contours.end(), std::back_inserter(moved.contours));
}

std::vector<MovedStructures> StructureMover::finish() && {
  std::vector<MovedStructures> results;
  for (std::vector<Roi>& set : sets_) {
    MovedStructures& result = results.emplace_back();
    for (Roi& roi : set) {
      finish(roi);
      result.push_back(std::move(roi.moved));
    }
  }
  return results;
}

std::vector<StructureWriteReport> write_structures(const std::vector<std::filesystem::path>& staged,
                                                   const std::vector<StructuresInput>& sets,
                                                   const std::vector<MovedStructures>& moved,
                                                   const DicomWriteReport& series, const DicomDerivation& derivation) {
  std::vector<StructureWriteReport> written;
  for (std::size_t n = 0; n < sets.size(); ++n) {
    std::vector<std::vector<Contour>> contours;
    for (const MovedRoi& roi : moved[n]) contours.push_back(roi.contours);
    written.push_back(write_structure_set(staged[n], sets[n].structures, contours, series, derivation));
  }
  return written;
}

namespace {

const char* name_of(MovedRoi::How how) {
  if (how == MovedRoi::How::points) return "points";
  return how == MovedRoi::How::resliced ? "resliced" : "nothing";
}

nlohmann::json to_json(const MovedRoi& roi, const Structure& structure) {
  constexpr double kMillilitre = 1000;  // mm3
  nlohmann::json one = {{"number", structure.number},
                        {"moved", name_of(roi.how)},
                        {"contours", {structure.contours.size(), roi.contours.size()}},
                        {"volume_ml", {roi.volume_before / kMillilitre, roi.volume_after / kMillilitre}}};
  if (roi.how == MovedRoi::How::resliced)
    one["between_contours"] = roi.between == Between::interpolated ? "interpolated" : "nearest";
  if (roi.parts > 1) one["parts"] = roi.parts;
  if (roi.left_out > 0) one["contours_left_out"] = roi.left_out;
  if (roi.beyond > 0) one["contours_beyond_output"] = roi.beyond;
  if (roi.cut) one["cut"] = true;
  if (roi.at_end) one["at_end"] = true;
  if (!roi.problem.empty()) one["problem"] = roi.problem;
  return one;
}

void add_notes(const MovedRoi& roi, const Structure& structure, const std::filesystem::path& input,
               std::vector<std::string>& notes) {
  const std::string name = "ROI " + std::to_string(structure.number) + " of " + shown(input);
  const std::string of = " of " + std::to_string(structure.contours.size()) + " contours of " + name;
  if (!roi.problem.empty()) notes.push_back(name + " is left empty: " + roi.problem);
  if (roi.left_out > 0)
    notes.push_back(std::to_string(roi.left_out) + of + " are left out: the field does not say where they go");
  if (structure.repeated > 0)
    notes.push_back(std::to_string(structure.repeated) + " contours of " + name +
                    " are there twice and are taken once");
  if (roi.beyond > 0) notes.push_back(std::to_string(roi.beyond) + of + " come to lie beyond the output");
  if (roi.cut) notes.push_back(name + " is cut off where the output ends or the field maps nothing");
  if (roi.at_end)
    notes.push_back(name + " reaches the first or the last slice; a pull field does not say what is beyond");
  if (roi.how == MovedRoi::How::resliced && roi.contours.empty())
    notes.push_back(name + " has no contour in the output");
}

}  // namespace

nlohmann::json structures_json(const std::vector<StructuresInput>& sets, const std::vector<MovedStructures>& moved,
                               const std::vector<StructureWriteReport>& written) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t n = 0; n < sets.size(); ++n) {
    nlohmann::json rois = nlohmann::json::array();
    for (std::size_t roi = 0; roi < moved[n].size(); ++roi)
      rois.push_back(to_json(moved[n][roi], sets[n].structures.structures[roi]));
    list.push_back({{"input", sets[n].choice.input.string()},
                    {"sha256", sets[n].sha256},
                    {"output", sets[n].choice.output.string()},
                    {"series_instance_uid", written[n].series_uid},
                    {"sop_instance_uid", written[n].sop_instance_uid},
                    {"rois", std::move(rois)}});
  }
  return list;
}

std::vector<std::string> notes_of(const std::vector<StructuresInput>& sets, const std::vector<MovedStructures>& moved) {
  std::vector<std::string> notes;
  for (std::size_t n = 0; n < sets.size(); ++n) {
    for (std::size_t roi = 0; roi < moved[n].size(); ++roi)
      add_notes(moved[n][roi], sets[n].structures.structures[roi], sets[n].choice.input, notes);
  }
  return notes;
}

}  // namespace tetwarp::apps
