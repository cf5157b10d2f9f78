// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/truth/truth_set.h"

#include <fstream>

#include "deform/errors.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// The place of a file in the folder; null for none.
json place_in(const fs::path& path, const fs::path& folder) {
  return path.empty() ? json() : json(path.lexically_relative(folder).generic_string());
}

/// A file of the set. @throws InputError for a name that leads out of the folder
fs::path member(const json& record, const char* name, const fs::path& folder) {
  if (!record.contains(name) || record.at(name).is_null()) return {};
  const fs::path path = fs::path(record.at(name).get<std::string>()).lexically_normal();
  require(path.is_relative() && !path.empty() && *path.begin() != "..",
          (folder / kSetRecord).string() + " names \"" + path.string() + "\", which is not in the set");
  return folder / path;
}

}  // namespace

json to_json(const TruthSet& set) {
  json record{{"moving", place_in(set.moving, set.folder)},
              {"body", place_in(set.body, set.folder)},
              {"labels", place_in(set.labels, set.folder)},
              {"landmarks", place_in(set.landmarks, set.folder)},
              {"dose", place_in(set.dose, set.folder)},
              {"cases", json::array()},
              {"roles", json::object()}};
  for (const auto& [label, role] : set.roles) record["roles"][std::to_string(label)] = role;
  for (const TruthCase& one : set.cases) {
    record["cases"].push_back({{"name", one.name},
                               {"fixed", place_in(one.fixed, set.folder)},
                               {"field", place_in(one.field, set.folder)},
                               {"body", place_in(one.body, set.folder)},
                               {"labels", place_in(one.labels, set.folder)},
                               {"landmarks", place_in(one.landmarks, set.folder)},
                               {"dose", place_in(one.dose, set.folder)},
                               {"near_slip", place_in(one.bands, set.folder)},
                               {"moving_near_slip", place_in(one.moving_bands, set.folder)},
                               {"near_slip_mm", one.bands_mm}});
  }
  return record;
}

TruthSet read_truth_set(const fs::path& folder) {
  const fs::path file = folder / kSetRecord;
  std::ifstream stream(file);
  require(stream.good(), folder.string() + " is no complete set of known truth: it has no readable " + kSetRecord +
                             "; make one with tetwarp truth, or end one with --resume");
  TruthSet set{.folder = folder, .moving = {}, .body = {}, .labels = {}, .landmarks = {}, .dose = {}, .cases = {}};
  try {
    const json document = json::parse(stream);
    const json& record = document.at("set");
    set.moving = member(record, "moving", folder);
    set.body = member(record, "body", folder);
    set.labels = member(record, "labels", folder);
    set.landmarks = member(record, "landmarks", folder);
    set.dose = member(record, "dose", folder);
    for (const auto& [label, role] : record.at("roles").items()) set.roles[std::stoll(label)] = role.get<std::string>();
    for (const json& one : record.at("cases")) {
      set.cases.push_back({one.at("name").get<std::string>(), member(one, "fixed", folder),
                           member(one, "field", folder), member(one, "body", folder), member(one, "labels", folder),
                           member(one, "landmarks", folder), member(one, "dose", folder),
                           member(one, "near_slip", folder), member(one, "moving_near_slip", folder),
                           one.at("near_slip_mm").get<std::vector<double>>()});
    }
  } catch (const json::exception& error) {
    throw InputError(file.string() + " is damaged: " + error.what());
  } catch (const std::logic_error& error) {  // a role of what is no number
    throw InputError(file.string() + " is damaged: " + error.what());
  }
  require(!set.moving.empty() && !set.body.empty() && !set.cases.empty(),
          file.string() + " names no moving volume, no body of it, or no case");
  for (const TruthCase& one : set.cases) {
    require(!one.fixed.empty() && !one.field.empty() && !one.body.empty(),
            file.string() + " names no fixed volume, field or body of the case " + one.name);
    require(one.bands.empty() == one.bands_mm.empty() && one.bands.empty() == one.moving_bands.empty(),
            file.string() + " names no bands, or says not how far they reach, of the case " + one.name);
  }
  return set;
}

}  // namespace tetwarp::apps
