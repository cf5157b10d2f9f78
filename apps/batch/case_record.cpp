// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/case_record.h"

#include <fstream>

#include "apps/cli/reads.h"
#include "deform/version.h"
#include "io/hash.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;
using nlohmann::json;

bool hides(const BatchCase& of) { return of.options.dicom.deidentification.has_value(); }

namespace {

/// The digests of the files below a folder, by their names relative to it; its record is left out.
json files_of(const fs::path& folder) {
  json files = json::object();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (name != kFolderRecord) files[name] = {{"sha256", hash_file(entry.path())}, {"bytes", entry.file_size()}};
  }
  return files;
}

/// The outputs of a case for the results: a digest for each file, and for each folder one digest of the names and
/// digests of all files in it.
json outputs_of(const json& files, const std::string& id) {
  json outputs = json::array();
  std::string folder;
  Sha256 hash;
  std::uint64_t bytes = 0, count = 0;
  const auto end_folder = [&] {
    if (!folder.empty())
      outputs.push_back({{"path", id + "/" + folder}, {"sha256", hash.hex()}, {"bytes", bytes}, {"files", count}});
    folder.clear();
  };
  for (const auto& [name, file] : files.items()) {  // by rising name
    const std::string of = name.find('/') == std::string::npos ? "" : name.substr(0, name.find('/'));
    if (of != folder) end_folder();
    if (of.empty()) {
      outputs.push_back({{"path", id + "/" + name}, {"sha256", file["sha256"]}, {"bytes", file["bytes"]}});
      continue;
    }
    if (folder.empty()) {
      hash = Sha256();
      bytes = count = 0;
    }
    folder = of;
    hash.add(name).add(file["sha256"].get_ref<const std::string&>());
    bytes += file["bytes"].get<std::uint64_t>();
    ++count;
  }
  end_folder();
  return outputs;
}

json line_of(const BatchCase& of, const std::string& status) {
  json line = {{"case", of.id}, {"status", status}, {"version", version()}, {"commit", commit()}};
  if (!hides(of)) line["command"] = command_of(of);
  return line;
}

}  // namespace

json case_identity(const BatchCase& of, const std::string& input_sha256, const std::vector<std::string>& others) {
  json identity = {{"program", version()}};
  const auto add = [&](const char* name, const std::vector<std::string>& values) {
    Sha256 hash;
    hash.add("tetwarp case").add(name);
    for (const std::string& value : values) hash.add(value);
    const auto& hidden = of.options.dicom.deidentification;
    identity[name] = hidden ? Sha256().add(keyed_digest(hidden->key, hash.hex())).hex() : hash.hex();
  };
  add("row", of.row);
  add("input", {input_sha256});
  add("further", others);
  return identity;
}

namespace {

/// What differs between a case and the one that was recorded, in words; empty: nothing does.
std::string difference(const json& now, const json& recorded) {
  if (!recorded.is_object() || recorded.value("program", json()) != now["program"]) return "another version made them";
  for (const auto& [name, what] : {std::pair("row", "the row has changed"),
                                   {"input", "the input has changed"},
                                   {"further", "another file that is read has changed"}}) {
    if (recorded.value(name, json()) != now[name]) return what;
  }
  return "";
}

/// A recorded line with the paths that it would have now, for OUTPUT_DIR and the manifest may have moved.
json with_current_paths(json line, const BatchCase& of) {
  if (line.contains("command")) line["command"] = command_of(of);
  if (line.contains("input") && line["input"].contains("path")) line["input"]["path"] = of.options.input.path.string();
  return line;
}

}  // namespace

Record record_case(const BatchCase& of, const DeformOutputs& outputs, const DeformRun& run,
                   const DeformWritten& written, const std::vector<std::string>& others) {
  const fs::path& folder = outputs.set.folder();
  const json files = files_of(folder), told = sidecar(run, written);
  json line = line_of(of, "done");
  if (!hides(of)) line["input"] = told["input"];
  line["field"] = {{"sha256", run.field.sha256}, {"direction", told["field"]["direction"]}};
  line["report"] = told["report"];
  line["outputs"] = outputs_of(files, of.id);
  line["notes"] = notes_of(run, written);
  write_json(folder / kFolderRecord,
             Record::of(hides(of), {{"case", of.id},
                                    {"identity", case_identity(of, written.input_sha256, others)},
                                    {"result", line},
                                    {"files", files}}));
  return Record::of(hides(of), line);
}

Record failed_line(const BatchCase& of, const std::string& status, FixedReason kind, const std::string& reason) {
  json line = line_of(of, status);
  line["reason"] = hides(of) ? fixed_text(kind) : reason;
  return Record::of(hides(of), line);
}

std::optional<json> finished_line(const BatchCase& of, const fs::path& folder, std::string& why) {
  std::ifstream file(folder / kFolderRecord, std::ios::binary);
  if (!file) return std::nullopt;
  const json record = json::parse(file, nullptr, false);
  if (!record.is_object() || !record.contains("result") || !record.contains("files")) {
    why = std::string(kFolderRecord) + " is damaged";
    return std::nullopt;
  }
  try {
    const int threads = of.options.common.threads;
    const Reads others = other_reads_of(of.options, parse_sources(of.options));
    const json identity = case_identity(of, hash_volume(of.options.input, threads), others.digests(threads));
    why = difference(identity, record.value("identity", json()));
    if (why.empty() && files_of(folder) != record["files"]) why = "the outputs are not as they were written";
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception&) {  // left to the making of the case, which says what is wrong
    why = "what is read cannot be read now";
  }
  if (!why.empty()) return std::nullopt;
  return with_current_paths(record["result"], of);
}

}  // namespace tetwarp::apps
