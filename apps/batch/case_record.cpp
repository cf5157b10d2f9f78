#include "apps/batch/case_record.h"

#include <fstream>

#include "apps/reads.h"
#include "deform/version.h"
#include "io/hash.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// Files below a folder by their names in it, its record left out.
json files_of(const fs::path& folder) {
  json files = json::object();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (name != kFolderRecord) files[name] = {{"sha256", hash_file(entry.path())}, {"bytes", entry.file_size()}};
  }
  return files;
}

/// The outputs as a person sees them: files, and of a folder one digest of the names and digests of all it holds.
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
  if (!of.options.dicom.deidentification) line["command"] = command_of(of);
  return line;
}

}  // namespace

std::string hash_input(const DeformOptions& options) {
  if (has_image_suffix(options.input.path)) return hash_file(options.input.path);
  const InputHeader header = open_input(options.input, Control{.stop = interrupt_token()});
  return header.series ? hash_files(*header.series, options.common.threads, {.stop = interrupt_token()})
                       : hash_file(options.input.path);
}

std::string case_identity(const BatchCase& of, const std::string& input_sha256) {
  Sha256 hash;
  hash.add("tetwarp case").add(version());
  for (const std::string& argument : of.arguments) hash.add(argument);
  hash.add(input_sha256);
  const Reads further = further_reads_of(of.options);
  for (const fs::path& file : further.paths()) {
    hash.add(file.string());
    if (fs::is_regular_file(file)) hash.add(hash_file(file));
  }
  if (of.options.dicom.deidentification) hash.add(std::as_bytes(std::span(of.options.dicom.deidentification->key)));
  return hash.hex();
}

json record_case(const BatchCase& of, const Deformation& made) {
  const DeformRecord& record = made.record();
  const fs::path& folder = record.outputs.set.folder();
  const json files = files_of(folder), told = sidecar(record);
  json line = line_of(of, "done");
  if (!of.options.dicom.deidentification) line["input"] = told["input"];
  line["field"] = {{"sha256", record.field_sha256}, {"direction", told["field"]["direction"]}};
  line["report"] = told["report"];
  line["outputs"] = outputs_of(files, of.id);
  line["notes"] = made.notes();
  write_json(
      folder / kFolderRecord,
      {{"case", of.id}, {"identity", case_identity(of, record.input_sha256)}, {"result", line}, {"files", files}});
  return line;
}

json failed_line(const BatchCase& of, const std::string& status, const std::string& reason) {
  json line = line_of(of, status);
  line["reason"] = reason;
  return line;
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
    if (record.value("identity", "") != case_identity(of, hash_input(of.options))) {
      why = "its row, its input or the program has changed";
      return std::nullopt;
    }
    if (files_of(folder) != record["files"]) {
      why = "its files are not as they were written";
      return std::nullopt;
    }
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    why = error.what();
    return std::nullopt;
  }
  return record["result"];
}

}  // namespace tetwarp::apps
