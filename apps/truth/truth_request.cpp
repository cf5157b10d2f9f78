// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/truth/truth_request.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "apps/batch/manifest_rows.h"
#include "deform/text/text_number.h"
#include "io/lower_case.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

/// Roles as options name them. @throws UsageError for a text that is not ROLE=N,..., or a role that no kind needs
truth::Roles parse_roles(const std::vector<std::string>& texts) {
  truth::Roles roles;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string role = text.substr(0, equals);
    const auto needs = [&](const truth::Family& family) {
      return std::find(family.roles.begin(), family.roles.end(), role) != family.roles.end();
    };
    const auto kinds = truth::families();
    if (equals == std::string::npos || std::none_of(kinds.begin(), kinds.end(), needs))
      throw UsageError("--label \"" + text + "\"; expected ROLE=N,... with lung, bone, organ or lump as ROLE");
    std::string_view numbers = std::string_view(text).substr(equals + 1);
    while (true) {
      const std::string_view one = numbers.substr(0, numbers.find(','));
      const auto value = number_from<std::int64_t>(one);
      if (!value)
        throw UsageError("--label \"" + text + "\" holds \"" + std::string(one) + "\"; expected whole numbers");
      std::vector<std::int64_t>& labels = roles[role];
      if (std::find(labels.begin(), labels.end(), *value) == labels.end()) labels.push_back(*value);
      if (one.size() == numbers.size()) break;
      numbers.remove_prefix(one.size() + 1);
    }
  }
  return roles;
}

std::vector<truth::CaseChoice> cases_of(const TruthOptions& options, const truth::Roles& roles) {
  if (options.cases.empty()) return truth::usual_cases(roles);
  std::vector<truth::CaseChoice> cases;
  for (const std::string& text : options.cases) {
    try {
      cases.push_back(truth::parse_case(text));
    } catch (const InputError& error) {
      throw UsageError(error.what());
    }
    const auto same = [&](const truth::CaseChoice& one) { return one.name == cases.back().name; };
    if (std::count_if(cases.begin(), cases.end(), same) > 1)
      throw UsageError("--case " + text + " is given twice, or has the folder of another one");
    for (const std::string_view role : cases.back().family->roles) {
      if (!roles.contains(std::string(role)))
        throw UsageError("--case " + text + " needs to know which labels are " + std::string(role) +
                         "; give --labels FILE and --label " + std::string(role) + "=N");
    }
  }
  return cases;
}

/// Noise of that power; empty: it is to be measured. @throws UsageError for what is no number from 0 to 1000
std::optional<truth::Noise> parse_noise(const std::string& text) {
  if (text == "measured") return std::nullopt;
  const auto value = number_from<double>(text);
  if (!value || !(*value >= 0 && *value <= 1000))
    throw UsageError("--noise \"" + text + "\"; expected a standard deviation of 0 to 1000 HU, or \"measured\"");
  return truth::smoothed_noise(*value);
}

const std::set<std::string> kLists{"label", "case", "with"};

/// How the value of a key of a manifest gets into the options. Paths are relative to its folder.
using SetKey = std::function<void(TruthOptions&, const std::vector<std::string>&, const fs::path&)>;

const std::map<std::string, SetKey>& keys() {
  static const std::map<std::string, SetKey> kKeys{
      {"input", [](auto& to, const auto& values, const auto& folder) { to.input.path = folder / values.front(); }},
      {"labels", [](auto& to, const auto& values, const auto& folder) { to.labels = folder / values.front(); }},
      {"dose", [](auto& to, const auto& values, const auto& folder) { to.dose = folder / values.front(); }},
      {"with",
       [](auto& to, const auto& values, const auto& folder) {
         to.with.clear();
         for (const std::string& value : values) to.with.push_back((folder / value).string());
       }},
      {"label", [](auto& to, const auto& values, const auto&) { to.roles = values; }},
      {"case", [](auto& to, const auto& values, const auto&) { to.cases = values; }},
      {"noise", [](auto& to, const auto& values, const auto&) { to.noise = values.front(); }},
      {"series", [](auto& to, const auto& values, const auto&) { to.input.series = values.front(); }},
  };
  return kKeys;
}

/// All keys, for a message.
std::string known_keys() {
  std::string known = "study";
  for (const auto& [key, set] : keys()) known += ", " + key;
  return known;
}

/// What is wrong with the files that options name; empty: nothing.
std::string missing_file(const TruthOptions& options) {
  std::vector<fs::path> files{options.input.path};
  if (!options.labels.empty()) files.push_back(options.labels);
  if (!options.dose.empty()) files.push_back(options.dose);
  files.insert(files.end(), options.with.begin(), options.with.end());
  for (const fs::path& file : files)
    if (!fs::exists(file)) return "no such file or folder, " + file.string() + "; paths are relative to the manifest";
  return "";
}

}  // namespace

TruthRequest parse_truth(const TruthOptions& options) {
  TruthRequest request;
  request.roles = parse_roles(options.roles);
  request.cases = cases_of(options, request.roles);
  request.noise = parse_noise(options.noise);
  if (options.labels.empty() && !options.roles.empty()) throw UsageError("--label names labels of --labels; give both");
  return request;
}

bool is_truth_manifest(const fs::path& input) {
  const std::string suffix = lower(input.extension().string());
  return suffix == ".csv" || suffix == ".jsonl" || suffix == ".ndjson";
}

std::vector<TruthOptions> read_truth_manifest(const TruthOptions& options) {
  if (!options.labels.empty() || !options.dose.empty() || !options.with.empty() || !options.input.series.empty())
    throw UsageError(
        "--labels, --dose, --with and --series name files of one volume; of a manifest its rows name them");
  const fs::path& manifest = options.input.path;
  ManifestErrors errors(manifest);
  std::vector<TruthOptions> sets;
  std::set<std::string> taken;
  const auto is_list = [](const std::string& key) { return kLists.contains(key); };
  for (const ManifestRow& row : read_rows(manifest, is_list, errors)) {
    TruthOptions of_row = options;
    const std::string study = row.text("study");
    if (!is_plain_name(study)) {
      errors.add(row.line, "the study \"" + study +
                               "\" is no name of a folder; give each row a key study of letters, "
                               "digits, '.', '_' and '-', a letter or digit first");
    } else if (!taken.insert(lower(study)).second) {
      errors.add(row.line, "the study \"" + study + "\" is there twice");
    }
    of_row.output = options.output / study;
    for (const auto& [key, values] : row.values) {
      if (key == "study") continue;
      const auto known = keys().find(key);
      if (known == keys().end()) {
        errors.add(row.line, "unknown key \"" + key + "\"; expected " + known_keys());
      } else if (!values.empty() && !values.front().empty()) {
        known->second(of_row, values, manifest.parent_path());
      }
    }
    if (of_row.input.path == manifest) {
      errors.add(row.line, "no input; give each row one");
    } else if (const std::string missing = missing_file(of_row); !missing.empty()) {
      errors.add(row.line, missing);
    }
    try {
      parse_truth(of_row);
    } catch (const UsageError& error) {
      errors.add(row.line, error.what());
    }
    sets.push_back(std::move(of_row));
  }
  errors.throw_if_any();
  require(!sets.empty(), manifest.string() + " has no rows");
  return sets;
}

}  // namespace tetwarp::apps
