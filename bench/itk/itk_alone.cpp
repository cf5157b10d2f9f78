// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Both sides of a measurement in a process of its own.
#include <tbb/global_control.h>

#include <fstream>
#include <limits>

#include "bench/harness/files.h"
#include "bench/itk/itk.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

fs::path request_file(const ItkFiles& files) { return files.folder / "request.json"; }
fs::path answer_file(const ItkFiles& files) { return files.folder / "answer.json"; }

Json read_json(const fs::path& path) {
  std::ifstream file(path);
  const Json document = Json::parse(file, nullptr, false);
  if (document.is_discarded()) throw Error("no JSON that can be read, " + path.string());
  return document;
}

/// VmRSS, the process's resident set, or VmHWM, its largest since it was forgotten (or the process's start, where the
/// kernel does not let it be forgotten). @throws Error where there is no such file
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

void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

Json to_json(const Deviation& found) {
  return {{"rms", number_or_null(found.rms)},
          {"mean", number_or_null(found.mean)},
          {"largest", number_or_null(found.largest)},
          {"compared", found.compared},
          {"missing", found.missing}};
}

}  // namespace

Json ask_alone(const ItkRequest& request, const ItkFiles& files) {
  write_json(request_file(files), {{"method", request.method},
                                   {"field", request.field},
                                   {"cell_size", request.cell_size},
                                   {"threads", request.threads},
                                   {"divisions", request.divisions},
                                   {"is_compared", request.is_compared}});
  fs::remove(answer_file(files));
  run_program({fs::read_symlink("/proc/self/exe").string(), "itk-alone", files.folder.string()});
  return read_json(answer_file(files));
}

int run_itk_alone(const fs::path& folder) {
  const ItkFiles files{folder};
  const Json json = read_json(request_file(files));
  const ItkRequest request{json["method"],  json["field"],     json["cell_size"],
                           json["threads"], json["divisions"], json["is_compared"]};
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(request.threads));
  const ItkWork work = make_itk_work(request, files);
  forget_peak();
  const std::uint64_t resident = status_bytes("VmRSS:");
  Samples times;
  timed(request.method, work.run).run(times);
  write_json(answer_file(files),
             {{"ms", times["ms"].front()},
              {"cpu_ms", times["cpu_ms"].front()},
              {"peak_bytes", status_bytes("VmHWM:") - resident},
              {"input_bytes", work.input_bytes},
              {"output_bytes", work.output_bytes()},
              {"error", request.is_compared && work.deviation ? to_json(work.deviation()) : Json(nullptr)}});
  return 0;
}

}  // namespace tetwarp::bench
