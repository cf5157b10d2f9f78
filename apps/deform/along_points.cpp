// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_points.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace tetwarp::apps {

namespace {

std::size_t count_outside(const MovedPoints& moved) {
  return static_cast<std::size_t>(std::count(moved.status.begin(), moved.status.end(), PointStatus::outside));
}

}  // namespace

PointsChoice parse_points(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UsageError("--points \"" + text + "\"; expected IN=OUT, IN=OUT:lps or IN=OUT:ras");
  PointsChoice parsed;
  std::string output = text.substr(equals + 1);
  for (const auto& [suffix, frame] : {std::pair{":lps", PointFrame::lps}, std::pair{":ras", PointFrame::ras}}) {
    if (!output.ends_with(suffix)) continue;
    parsed.told = frame;
    output.resize(output.size() - 4);
    break;
  }
  parsed.input = text.substr(0, equals);
  parsed.output = output;
  const std::string form = points_suffix(parsed.input);
  if (form.empty()) {
    throw UsageError("unknown suffix of --points \"" + parsed.input.string() +
                     "\"; use .csv .mrk.json .fcsv .stl .obj .vtk");
  }
  if (points_suffix(parsed.output) != form) {
    throw UsageError("--points writes the form that it reads, " + form + ", not \"" + output +
                     "\"; give the output the suffix " + form);
  }
  return parsed;
}

std::vector<PointsFile> read_points(const std::vector<PointsChoice>& choices) {
  std::vector<PointsFile> files;
  for (const PointsChoice& choice : choices) files.emplace_back(choice.input, choice.told);
  return files;
}

std::vector<MovedPoints> move_all_points(const std::vector<PointsFile>& files, const Geometry& output,
                                         const FieldView& field, const Limits& limits, const Control& control) {
  std::vector<MovedPoints> moved;
  for (const PointsFile& file : files) {
    MovedPoints& one = moved.emplace_back();
    one.points = file.points();
    one.status = move_points(output, field, one.points, limits, control);
  }
  return moved;
}

void write_points(const std::vector<std::filesystem::path>& staged, const std::vector<PointsFile>& files,
                  const std::vector<MovedPoints>& moved) {
  for (std::size_t n = 0; n < files.size(); ++n) files[n].write(staged[n], moved[n].points, moved[n].status);
}

nlohmann::json points_json(const std::vector<PointsChoice>& choices, const std::vector<PointsFile>& files,
                           const std::vector<MovedPoints>& moved) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t n = 0; n < choices.size(); ++n) {
    list.push_back({{"input", choices[n].input.string()},
                    {"output", choices[n].output.string()},
                    {"points", moved[n].points.size()},
                    {"outside", count_outside(moved[n])},
                    {"frame", to_string(files[n].frame())}});
  }
  return list;
}

std::vector<std::string> notes_of(const std::vector<PointsChoice>& choices, const std::vector<PointsFile>& files,
                                  const std::vector<MovedPoints>& moved) {
  std::vector<std::string> notes;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    notes.insert(notes.end(), files[n].notes().begin(), files[n].notes().end());
    const std::size_t outside = count_outside(moved[n]);
    if (outside == 0) continue;
    notes.push_back(std::to_string(outside) + " of " + std::to_string(moved[n].points.size()) + " points of " +
                    choices[n].input.string() + " lie outside the field's lattice and stay where they are");
  }
  return notes;
}

}  // namespace tetwarp::apps
