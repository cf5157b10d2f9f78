// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/record.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <string>

#include "deform/errors.h"
#include "deform/fields/formula.h"

namespace tetwarp::apps {

using nlohmann::json;

namespace {

constexpr const char* kReasons[] = {"an input is refused", "the options are refused", "there was not enough memory",
                                    "a device failed", "something failed"};
constexpr const char* kElsewhere = "; standard error of the batch says why, for that may name paths";

/// A word of the program: short, without slashes and backslashes.
bool is_word(const std::string& text) {
  constexpr std::size_t kLongest = 64;
  return text.size() <= kLongest && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return std::isalnum(c) ||
                  std::string_view(" .,:;+-_()").find(static_cast<char>(c)) != std::string_view::npos;
         });
}

bool is_digest(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

bool is_uid(const std::string& text) {
  return text.size() <= 64 && text.find_first_not_of("0123456789.") == std::string::npos;
}

/// A formula is a name of the program's and numbers: what it was made of has been read, or nothing would be written.
bool is_field(const std::string& text) { return is_formula(text); }

bool is_grid(const std::string& text) { return text == "same" || text == "fit"; }

bool is_frame(const std::string& text) { return text == "LPS" || text == "RAS" || text == "lps" || text == "ras"; }

bool is_reason(const std::string& text) {
  return std::any_of(std::begin(kReasons), std::end(kReasons),
                     [&](const char* reason) { return text == std::string(reason) + kElsewhere; });
}

/// What verdict() of deform/field_quality.h makes of numbers.
bool is_sentence(const std::string& text) { return text.find_first_of("/\\\"'") == std::string::npos; }

/// The name of a case or of a file in its folder, which is to be seen there anyway.
bool is_any(const std::string&) { return true; }

/// Where texts may stand: members by their keys, "[]" for what a list holds, "*" for any key of "files" and "identity".
const std::map<std::string, bool (*)(const std::string&)>& places() {
  static const std::map<std::string, bool (*)(const std::string&)> places = {
      // of every record
      {"program", is_word},
      {"version", is_word},
      {"commit", is_word},
      {"command", is_word},
      {"backend", is_word},
      // OUTPUT.json and --report
      {"options/interpolation", is_word},
      {"options/outside", is_word},
      {"options/preserve", is_word},
      {"options/grid", is_grid},
      {"options/field[]", is_field},
      {"options/dicom/transfer_syntax", is_word},
      {"options/dicom/deidentified/PS3.15 2026d[]", is_word},
      {"field/sha256", is_digest},
      {"field/direction", is_word},
      {"field/arithmetic", is_word},
      {"field/files[]/format", is_word},
      {"field/files[]/direction", is_word},
      {"field/files[]/frame", is_frame},
      {"field/files[]/known/direction", is_word},
      {"field/files[]/known/frame", is_word},
      {"field/files[]/known/units", is_word},
      {"field/files[]/known/absolute", is_word},
      {"field/lattice/orientation", is_word},
      {"field/simulation/method", is_word},
      {"field/simulation/backend", is_word},
      {"output/voxel_type", is_word},
      {"output/geometry/orientation", is_word},
      {"output/series_instance_uid", is_uid},
      {"output/frame_of_reference_uid", is_uid},
      {"output/added_empty_attributes[]", is_word},
      {"with[]/grid", is_word},
      {"with[]/voxel_type", is_word},
      {"with[]/interpolation", is_word},
      {"with[]/dicom/kind", is_word},
      {"with[]/dicom/type", is_word},
      {"with[]/dicom/series_instance_uid", is_uid},
      {"with[]/dicom/sop_instance_uid", is_uid},
      {"structures[]/series_instance_uid", is_uid},
      {"structures[]/sop_instance_uid", is_uid},
      {"structures[]/rois[]/moved", is_word},
      {"structures[]/rois[]/between_contours", is_word},
      {"points[]/frame", is_frame},
      {"quality/verdict", is_sentence},
      // lines of a batch
      {"case", is_any},
      {"status", is_word},
      {"reason", is_reason},
      {"worker", is_word},
      {"outputs[]/path", is_any},
      {"outputs[]/sha256", is_digest},
      // case.json
      {"identity", is_digest},
      {"identity/*", is_word},
      {"files/*/sha256", is_digest},
      {"result/case", is_any},
      {"result/status", is_word},
      {"result/version", is_word},
      {"result/commit", is_word},
      {"result/field/sha256", is_digest},
      {"result/field/direction", is_word},
      {"result/outputs[]/path", is_any},
      {"result/outputs[]/sha256", is_digest},
  };
  return places;
}

bool may_pass(const std::string& text, const std::string& place) {
  const auto found = places().find(place);
  return found != places().end() && found->second(text);
}

json closed_at(const json& value, const std::string& place) {
  if (value.is_array()) {
    json list = json::array();
    for (const json& item : value) {
      const bool left_out = item.is_string() && !may_pass(item.get<std::string>(), place + "[]");
      list.push_back(left_out ? json("left out") : closed_at(item, place + "[]"));
    }
    return list;
  }
  if (!value.is_object()) return value;
  const bool any_key = place == "files" || place == "identity";
  json members = json::object();
  for (const auto& [key, member] : value.items()) {
    const std::string at = (place.empty() ? "" : place + "/") + (any_key ? "*" : key);
    if (!member.is_string() || may_pass(member.get<std::string>(), at)) members[key] = closed_at(member, at);
  }
  return members;
}

}  // namespace

Record Record::closed(const json& document) { return Record(closed_at(document, "")); }

std::string fixed_text(FixedReason reason) {
  return std::string(kReasons[static_cast<std::size_t>(reason)]) + kElsewhere;
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) throw Error("cannot be written whole, " + path.string() + "; is the disk full?");
}

void write_json(const std::filesystem::path& path, const Record& record) {
  write_text(path, record.document().dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace tetwarp::apps
