// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/score/score_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "apps/cli/input.h"
#include "deform/errors.h"
#include "io/csv_record.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

json to_json(const score::Errors& errors) {
  return {{"points", errors.points},
          {"missing", errors.missing},
          {"mean_mm", errors.mean},
          {"median_mm", errors.median},
          {"percentile_95_mm", errors.percentile_95},
          {"percentile_99_mm", errors.percentile_99},
          {"largest_mm", errors.largest},
          {"worst_lps_mm", {errors.worst.x, errors.worst.y, errors.worst.z}}};
}

/// The mean; infinite where no point has a place.
double mean_or_none(const score::Errors& errors) {
  return errors.points == 0 && errors.missing > 0 ? INFINITY : errors.mean;
}

/// The largest of several means.
template <class Key>
double worst_mean(const std::map<Key, score::Errors>& all) {
  double worst = 0;
  for (const auto& [key, errors] : all) worst = std::max(worst, mean_or_none(errors));
  return worst;
}

json to_json(const std::map<std::int64_t, score::Errors>& by_label) {
  json all = json::object();
  for (const auto& [label, errors] : by_label) all[std::to_string(label)] = to_json(errors);
  return all;
}

/// The value that a limit bounds; empty where it was not measured.
std::optional<double> value_of(const CaseScore& score, const std::string& limit) {
  if (score.landmarks && score.landmarks->points > 0) {
    if (limit == "landmarks_mean_mm") return score.landmarks->mean;
    if (limit == "landmarks_largest_mm") return score.landmarks->largest;
  }
  if (score.dense && score.dense->all.points > 0) {
    if (limit == "folded_voxels") return static_cast<double>(score.dense->folded);
    if (limit == "missing_voxels")
      return static_cast<double>(score.dense->all.missing + (score.apart ? score.apart->missing : 0));
    if (limit == "mean_mm") return score.dense->all.mean;
    if (limit == "percentile_95_mm") return score.dense->all.percentile_95;
  }
  if (limit == "surface_mean_mm" && !score.surfaces.empty()) return worst_mean(score.surfaces);
  if (limit == "inverse_consistency_mean_mm" && score.inverse_consistency)
    return mean_or_none(*score.inverse_consistency);
  if (limit == "transitivity_mean_mm" && !score.transitivity.empty()) return worst_mean(score.transitivity);
  if (limit == "gamma_failing_percent" && score.gamma) return 100 - score.gamma->passing_percent();
  return {};
}

}  // namespace

std::vector<ScoreLimit> usual_limits() {
  const std::string tg132 = "AAPM TG-132, as in Latifi et al. 2018 (PMC6036411)";
  const std::string tg218 = "AAPM TG-218: global gamma index of 3 %, 2 mm, above 10 %, in at least 95 %";
  return {{"landmarks_mean_mm", "mean error of landmarks, mm", 2, tg132},
          {"landmarks_largest_mm", "largest error of a landmark, mm", 5, tg132},
          {"folded_voxels", "voxels with a Jacobian determinant of 0 or below", 0, tg132},
          {"missing_voxels", "voxels of the body without a place", 0, "a result has to cover the body"},
          {"surface_mean_mm", "mean distance of the surfaces of a label, the worst one, mm", 0, tg132, true},
          {"inverse_consistency_mean_mm", "mean inverse consistency, mm", 0, tg132, true},
          {"transitivity_mean_mm", "mean transitivity, mm", 0, tg132, true},
          {"gamma_failing_percent", "doses that fail the gamma index, %", 5, tg218}};
}

std::vector<ScoreLimit> read_limits(const std::filesystem::path& file) {
  std::vector<ScoreLimit> limits = usual_limits();
  if (file.empty()) return limits;
  std::ifstream stream(file);
  require(stream.good(), "the limits, " + file.string() + ", cannot be read");
  try {
    // What is bounded only where a file says so.
    const std::vector<ScoreLimit> more{{"mean_mm", "mean error over the body, mm", 0, ""},
                                       {"percentile_95_mm", "error that 95 % of the body keep, mm", 0, ""}};
    const json document = json::parse(stream);
    require(document.is_object(), file.string() + " is no page of limits: expected {\"NAME\": {\"most\": ...}}");
    for (const auto& [name, given] : document.items()) {
      const auto is_it = [&key = name](const ScoreLimit& one) { return one.name == key; };
      auto found = std::find_if(limits.begin(), limits.end(), is_it);
      if (found == limits.end()) {
        const auto another = std::find_if(more.begin(), more.end(), is_it);
        std::string known;
        for (const auto& list : {usual_limits(), more})
          for (const ScoreLimit& one : list) known += (known.empty() ? "" : ", ") + one.name;
        require(another != more.end(), file.string() + " has a limit \"" + name + "\"; expected " + known);
        found = limits.insert(limits.end(), *another);
      }
      found->most = given.at("most").get<double>();
      found->is_voxel_side = false;
      found->source = given.value("source", file.string());
    }
  } catch (const json::exception& error) {
    throw InputError(file.string() + " is no page of limits: " + error.what());
  }
  return limits;
}

bool CaseScore::passed() const {
  const bool has_points = (!dense || dense->all.points > 0) && (!landmarks || landmarks->points > 0);
  return failure.empty() && !file.empty() && has_points && !checks.empty() &&
         std::all_of(checks.begin(), checks.end(), [](const ScoreCheck& one) { return one.passed(); });
}

std::vector<ScoreCheck> check(const CaseScore& score, const std::vector<ScoreLimit>& limits) {
  std::vector<ScoreCheck> checks;
  for (const ScoreLimit& limit : limits) {
    const std::optional<double> value = value_of(score, limit.name);
    if (!value) continue;
    checks.push_back({limit, *value});
    if (limit.is_voxel_side) checks.back().limit.most = score.voxel_side_mm;
  }
  return checks;
}

json to_json(const CaseScore& score) {
  json record{{"result", score.result}, {"case", score.name}, {"passed", score.passed()}, {"notes", score.notes}};
  if (!score.failure.empty()) record["failure"] = score.failure;
  record["file"] = score.file.empty() ? json() : json(score.file.string());
  if (score.dense) {
    const score::DenseScore& dense = *score.dense;
    json readings = json::object();
    for (std::size_t n = 0; n < score::kReadings; ++n)
      readings[score::to_string(static_cast<score::Reading>(n))] = dense.readings[n];
    record["body"] = to_json(dense.all);
    record["labels"] = to_json(score.labels);
    record["mean_mm_read_as"] = readings;
    record["jacobian"] = {{"voxels", dense.determinants},
                          {"folded", dense.folded},
                          {"smallest", dense.smallest_determinant},
                          {"largest", dense.largest_determinant},
                          {"mean_error", dense.mean_determinant_error}};
  }
  if (score.apart) record["near_slip"] = to_json(*score.apart);
  if (score.landmarks) record["landmarks"] = to_json(*score.landmarks);
  if (!score.overlaps.empty()) {
    json dice = json::object();
    for (const auto& [label, overlap] : score.overlaps) dice[std::to_string(label)] = overlap.dice();
    record["dice"] = dice;
    record["surfaces"] = to_json(score.surfaces);
  }
  if (!score.bands.empty()) {
    record["from_slip"] = json::array();
    for (const BandErrors& band : score.bands) {
      record["from_slip"].push_back(to_json(band.errors));
      record["from_slip"].back()["from_mm"] = band.from_mm;
      record["from_slip"].back()["to_mm"] = std::isinf(band.to_mm) ? json() : json(band.to_mm);
    }
  }
  if (score.gamma)
    record["gamma"] = {{"points", score.gamma->points},
                       {"passing", score.gamma->passing},
                       {"passing_percent", score.gamma->passing_percent()},
                       {"largest_dose", score.gamma->largest_dose}};
  if (score.inverse_consistency) record["inverse_consistency"] = to_json(*score.inverse_consistency);
  if (!score.transitivity.empty()) {
    record["transitivity"] = json::object();
    for (const auto& [over, errors] : score.transitivity) record["transitivity"][over] = to_json(errors);
  }
  record["checks"] = json::array();
  for (const ScoreCheck& one : score.checks) {
    record["checks"].push_back({{"name", one.limit.name},
                                {"value", std::isinf(one.value) ? json() : json(one.value)},
                                {"most", one.limit.most},
                                {"source", one.limit.source},
                                {"passed", one.passed()}});
  }
  return record;
}

std::string band_name(const BandErrors& band) {
  char text[80];
  if (std::isinf(band.to_mm)) {
    std::snprintf(text, sizeof text, "more than %.1f mm from the slip", band.from_mm);
  } else {
    std::snprintf(text, sizeof text, "%.1f to %.1f mm from the slip", band.from_mm, band.to_mm);
  }
  return text;
}

std::string label_name(const CaseScore& score, std::int64_t label) {
  const auto role = score.roles.find(label);
  return "label " + std::to_string(label) + (role == score.roles.end() ? "" : " (" + role->second + ")");
}

std::string csv_of(const std::vector<CaseScore>& scores) {
  std::string text = "result,case,part,points,missing,mean_mm,median_mm,p95_mm,p99_mm,largest_mm,dice\n";
  const auto row = [&](const CaseScore& score, const std::string& part, const score::Errors& errors,
                       const std::string& dice = "") {
    text += quoted(score.result) + "," + score.name + "," + part + "," + std::to_string(errors.points) + "," +
            std::to_string(errors.missing);
    for (const double value : {errors.mean, errors.median, errors.percentile_95, errors.percentile_99, errors.largest})
      text += "," + exact_number_text(value);
    text += "," + dice + "\n";
  };
  for (const CaseScore& score : scores) {
    if (score.dense) row(score, "body", score.dense->all);
    for (const auto& [label, errors] : score.labels) {
      const auto overlap = score.overlaps.find(label);
      row(score, "label " + std::to_string(label), errors,
          overlap == score.overlaps.end() ? "" : exact_number_text(overlap->second.dice()));
    }
    for (const auto& [label, errors] : score.surfaces) row(score, "surface of label " + std::to_string(label), errors);
    if (score.apart) row(score, "near slip", *score.apart);
    for (const BandErrors& band : score.bands) row(score, band_name(band), band.errors);
    if (score.landmarks) row(score, "landmarks", *score.landmarks);
    if (score.inverse_consistency) row(score, "inverse consistency", *score.inverse_consistency);
    for (const auto& [over, errors] : score.transitivity) row(score, "transitivity over " + over, errors);
  }
  return text;
}

std::string line_of(const CaseScore& score) {
  if (!score.failure.empty()) return score.name + ": cannot be scored: " + score.failure;
  if (score.file.empty()) return score.name + ": no result in " + score.result;
  std::string text = score.name + ": ";
  char part[160];
  if (score.dense) {
    const score::Errors& all = score.dense->all;
    std::snprintf(part, sizeof part, "body mean %.2f, 95 %% %.2f, largest %.2f mm (%.2f without registration), ",
                  all.mean, all.percentile_95, all.largest,
                  score.dense->readings[static_cast<std::size_t>(score::Reading::nothing)]);
    text += part;
    text += std::to_string(score.dense->folded) + " folded, ";
  }
  if (score.landmarks && score.landmarks->points > 0) {
    std::snprintf(part, sizeof part, "landmarks mean %.2f, largest %.2f mm, ", score.landmarks->mean,
                  score.landmarks->largest);
    text += part;
  }
  if (score.gamma) {
    std::snprintf(part, sizeof part, "gamma %.1f %%, ", score.gamma->passing_percent());
    text += part;
  }
  return text + (score.passed() ? "passes" : "fails");
}

}  // namespace tetwarp::apps
