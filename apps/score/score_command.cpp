// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <iostream>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/score/case_scorer.h"

namespace tetwarp::apps {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// @throws UsageError for options that do not go together
void check_together(const ScoreOptions& options) {
  if (!options.back.empty() && options.back.size() != options.results.size())
    throw UsageError("--back is given " + std::to_string(options.back.size()) + " times, -r " +
                     std::to_string(options.results.size()) + " times; give one for each");
  if (!options.triples.empty() && (options.forward || options.results.size() > 1))
    throw UsageError("--triples goes with one -r, from fixed to moving");
}

/// Folders or files of results, with the options behind their names. @throws InputError for one that is not there
std::vector<FieldSource> sources_of(const std::vector<std::string>& texts) {
  std::vector<FieldSource> sources;
  for (const std::string& text : texts) {
    sources.push_back(parse_field_source(text));
    require(fs::exists(sources.back().path), "the results, " + sources.back().path.string() + ", are not there");
  }
  return sources;
}

}  // namespace

int run_score(const ScoreOptions& options) {
  check_together(options);
  const std::vector<ScoreLimit> limits = read_limits(options.limits);
  const TruthSet set = read_truth_set(options.set);
  Reads reads;
  reads.add_file(options.set / kSetRecord);
  for (const TruthCase& one : set.cases) {
    for (const fs::path& file : {one.fixed, one.field, one.body, one.labels, one.landmarks, one.dose, one.bands})
      if (!file.empty()) reads.add_file(file);
  }
  const std::vector<FieldSource> results = sources_of(options.results), back = sources_of(options.back);
  for (const FieldSource& result : results) {
    const bool folder = fs::is_directory(result.path);
    if (!folder) reads.add_file(result.path);
    for (const fs::path& output : {options.json, options.csv, options.html}) {
      if (!output.empty() && folder &&
          fs::weakly_canonical(fs::absolute(output).parent_path()) == fs::canonical(result.path))
        throw UsageError(output.string() + " would lie among the results; put it elsewhere");
    }
  }
  require(options.triples.empty() || fs::is_directory(parse_field_source(options.triples).path),
          options.triples + " is no folder");
  if (!options.limits.empty()) reads.add_file(options.limits);
  OutputSet outputs(reads, options.common.overwrite);
  const fs::path json_file = outputs.add(options.json), csv = outputs.add(options.csv),
                 html = outputs.add(options.html);
  const CaseScorer scorer(options, set);
  std::vector<CaseScore> scores;
  for (const TruthCase& one : set.cases) {
    for (std::size_t n = 0; n < results.size(); ++n) {
      scores.push_back(scorer.score(results[n], back.empty() ? nullptr : &back[n], one, limits));
      std::cout << (results.size() > 1 ? scores.back().result + ", " : "") << line_of(scores.back()) << "\n";
      for (const std::string& note : scores.back().notes)
        say(options.common, "tetwarp: note: " + one.name + ": " + note);
    }
  }
  outputs.write([&] {
    if (!json_file.empty()) {
      json document = provenance("score");
      document["set"] = options.set.string();
      document["direction"] = options.forward ? "forward" : "pull";
      document["scores"] = json::array();
      for (const CaseScore& score : scores) document["scores"].push_back(to_json(score));
      write_json(json_file, Record::open(document));
    }
    if (!csv.empty()) write_text(csv, csv_of(scores));
    if (!html.empty()) write_text(html, page_of(options.set.string(), scores, limits));
  });
  outputs.commit();
  return std::all_of(scores.begin(), scores.end(), [](const CaseScore& score) { return score.passed(); }) ? 0 : 3;
}

}  // namespace tetwarp::apps
