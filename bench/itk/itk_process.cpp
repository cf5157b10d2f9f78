// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_process.h"

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "bench/harness/output_file.h"
#include "bench/harness/program.h"
#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

fs::path request_file(const ItkFiles& files) { return files.folder / "request.json"; }
fs::path answer_file(const ItkFiles& files) { return files.folder / "answer.json"; }

Json read_json(const fs::path& path) {
  std::ifstream file(path);
  const Json document = Json::parse(file, nullptr, false);
  if (document.is_discarded()) throw Error("no JSON that can be read, " + path.string());
  return document;
}

std::uint64_t status_bytes(const std::string& wanted) {
  std::ifstream file("/proc/self/status");
  std::string key;
  std::uint64_t kib = 0;
  while (file >> key) {
    if (key == wanted && file >> kib) return kib * 1024;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  throw Error("no " + wanted + " in /proc/self/status; memory is measured on Linux alone");
}

Json to_json(const Deviation& found) {
  return {{"rms", found.rms},
          {"mean", found.mean},
          {"largest", found.largest},
          {"compared", found.compared},
          {"missing", found.missing}};
}

Deviation to_deviation(const Json& json) {
  const auto number = [&](const char* key) { return json[key].is_null() ? NAN : json[key].get<double>(); };
  return {number("rms"), number("mean"), number("largest"), json["compared"], json["missing"]};
}

}  // namespace

fs::path ItkFiles::forward(const std::string& field, std::int64_t cell_size) const {
  return folder / (field + "-forward-" + std::to_string(cell_size) + ".mha");
}

fs::path ItkFiles::inverse(const std::string& field, std::int64_t cell_size) const {
  return folder / (field + "-inverse-" + std::to_string(cell_size) + ".mha");
}

ItkAnswer ask_alone(const ItkRequest& request, const ItkFiles& files) {
  write_text(request_file(files), Json{{"method", request.method},
                                       {"field", request.field},
                                       {"cell_size", request.cell_size},
                                       {"threads", request.threads},
                                       {"divisions", request.divisions},
                                       {"is_compared", request.is_compared}}
                                      .dump());
  fs::remove(answer_file(files));
  run_program({fs::read_symlink("/proc/self/exe").string(), "itk-alone", files.folder.string()});
  const Json json = read_json(answer_file(files));
  ItkAnswer answer{json["ms"], json["cpu_ms"], json["input_bytes"], json["output_bytes"], json["peak_bytes"]};
  if (!json["deviation"].is_null()) answer.deviation = to_deviation(json["deviation"]);
  return answer;
}

ItkRequest read_request(const ItkFiles& files) {
  const Json json = read_json(request_file(files));
  return {json["method"], json["field"], json["cell_size"], json["threads"], json["divisions"], json["is_compared"]};
}

void write_answer(const ItkAnswer& answer, const ItkFiles& files) {
  write_text(answer_file(files), Json{{"ms", answer.ms},
                                      {"cpu_ms", answer.cpu_ms},
                                      {"input_bytes", answer.input_bytes},
                                      {"output_bytes", answer.output_bytes},
                                      {"peak_bytes", answer.peak_bytes},
                                      {"deviation", answer.deviation ? to_json(*answer.deviation) : Json(nullptr)}}
                                     .dump());
}

std::uint64_t resident_bytes() { return status_bytes("VmRSS:"); }
std::uint64_t peak_resident_bytes() { return status_bytes("VmHWM:"); }

void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace tetwarp::bench
