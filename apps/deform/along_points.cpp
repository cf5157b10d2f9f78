// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/points_option.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace tetwarp::apps {

PointsOption::PointsOption(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UsageError("--points \"" + text + "\"; expected IN=OUT, IN=OUT:lps or IN=OUT:ras");
    Pair pair;
    std::string output = text.substr(equals + 1);
    for (const auto& [suffix, frame] : {std::pair{":lps", PointFrame::lps}, std::pair{":ras", PointFrame::ras}}) {
      if (!output.ends_with(suffix)) continue;
      pair.told = frame;
      output.resize(output.size() - 4);
      break;
    }
    pair.input = text.substr(0, equals);
    pair.output = output;
    const std::string form = points_suffix(pair.input);
    if (form.empty()) {
      throw UsageError("unknown suffix of --points \"" + pair.input.string() +
                       "\"; use .csv .mrk.json .fcsv .stl .obj .vtk");
    }
    if (points_suffix(pair.output) != form) {
      throw UsageError("--points writes the form that it reads, " + form + ", not \"" + output +
                       "\"; give the output the suffix " + form);
    }
    pairs_.push_back(std::move(pair));
  }
}

std::vector<std::filesystem::path> PointsOption::inputs() const {
  std::vector<std::filesystem::path> paths;
  for (const Pair& pair : pairs_) paths.push_back(pair.input);
  return paths;
}

std::vector<std::filesystem::path> PointsOption::add_outputs(OutputSet& outputs) const {
  std::vector<std::filesystem::path> staged;
  for (const Pair& pair : pairs_) staged.push_back(outputs.add(pair.output));
  return staged;
}

void PointsOption::read() {
  for (Pair& pair : pairs_) pair.file.emplace(pair.input, pair.told);
}

void PointsOption::move(const Geometry& output, const FieldView& field, const Limits& limits, const Control& control) {
  for (Pair& pair : pairs_) {
    pair.moved = pair.file->points();
    pair.status = move_points(output, field, pair.moved, limits, control);
  }
}

void PointsOption::write(const std::vector<std::filesystem::path>& staged) const {
  for (std::size_t n = 0; n < pairs_.size(); ++n) pairs_[n].file->write(staged[n], pairs_[n].moved, pairs_[n].status);
}

std::size_t PointsOption::Pair::outside() const {
  return static_cast<std::size_t>(std::count(status.begin(), status.end(), PointStatus::outside));
}

nlohmann::json PointsOption::to_json() const {
  nlohmann::json list = nlohmann::json::array();
  for (const Pair& pair : pairs_) {
    list.push_back({{"input", pair.input.string()},
                    {"output", pair.output.string()},
                    {"points", pair.moved.size()},
                    {"outside", pair.outside()},
                    {"frame", to_string(pair.file->frame())}});
  }
  return list;
}

std::vector<std::string> PointsOption::notes() const {
  std::vector<std::string> notes;
  for (const Pair& pair : pairs_) {
    notes.insert(notes.end(), pair.file->notes().begin(), pair.file->notes().end());
    if (pair.outside() == 0) continue;
    notes.push_back(std::to_string(pair.outside()) + " of " + std::to_string(pair.moved.size()) + " points of " +
                    pair.input.string() + " lie outside the field's lattice and stay where they are");
  }
  return notes;
}

}  // namespace tetwarp::apps
