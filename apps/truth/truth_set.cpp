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
              {"labels", place_in(set.labels, set.folder)},
              {"landmarks", place_in(set.landmarks, set.folder)},
              {"cases", json::array()}};
  for (const TruthCase& one : set.cases) {
    record["cases"].push_back({{"name", one.name},
                               {"fixed", place_in(one.fixed, set.folder)},
                               {"field", place_in(one.field, set.folder)},
                               {"body", place_in(one.body, set.folder)},
                               {"labels", place_in(one.labels, set.folder)},
                               {"landmarks", place_in(one.landmarks, set.folder)},
                               {"apart", place_in(one.apart, set.folder)}});
  }
  return record;
}

TruthSet read_truth_set(const fs::path& folder) {
  const fs::path file = folder / kSetRecord;
  std::ifstream stream(file);
  require(stream.good(), folder.string() + " is no complete set of known truth: it has no readable " + kSetRecord +
                             "; make one with tetwarp truth, or end one with --resume");
  TruthSet set{.folder = folder, .moving = {}, .labels = {}, .landmarks = {}, .cases = {}};
  try {
    const json document = json::parse(stream);
    const json& record = document.at("set");
    set.moving = member(record, "moving", folder);
    set.labels = member(record, "labels", folder);
    set.landmarks = member(record, "landmarks", folder);
    for (const json& one : record.at("cases")) {
      set.cases.push_back({one.at("name").get<std::string>(), member(one, "fixed", folder),
                           member(one, "field", folder), member(one, "body", folder), member(one, "labels", folder),
                           member(one, "landmarks", folder), member(one, "apart", folder)});
    }
  } catch (const json::exception& error) {
    throw InputError(file.string() + " is damaged: " + error.what());
  }
  require(!set.moving.empty() && !set.cases.empty(), file.string() + " names no moving volume, or no case");
  for (const TruthCase& one : set.cases) {
    require(!one.fixed.empty() && !one.field.empty() && !one.body.empty(),
            file.string() + " names no fixed volume, field or body of the case " + one.name);
  }
  return set;
}

}  // namespace tetwarp::apps
