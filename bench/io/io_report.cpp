// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/io/io_report.h"

#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"
#include "bench/harness/report.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr char kTimesNote[] = R"(## Times

ms, median (q1-q3), each program in turn; CPU ms of all threads. All files were just written, so they are read from the page cache and written
to it; only the whole job flushes to the disk, as `tetwarp deform` does. In: list the folder and read it; the loop with
DCMTK knows the order of the files. "tetwarp, hashed" makes the hash of the files as well, which `deform` records; it hashes every slice that it writes.
ITK reads and writes series, and NIfTI, in one thread. Whole job: `tetwarp deform` as a program, and its stages alone;
deform alone hashes the field, as the program does. The program writes slices while others are deformed. A program's memory is
given back when it ends, so that is a stage, too.
CUDA, awake: the whole job in this process, which has used the device before.

)";

std::string introduction(const IoResults& results) {
  return std::string("# tetwarp-bench io, ") + version() + " (" + commit() + ")\n\n- host: " + results.machine.cpu +
         ", " + std::to_string(results.machine.threads) + " threads\n- input: phantom, " + to_string(results.size) +
         ", int16\n" + format("- %d repeats\n\n", results.options.repeats);
}

std::string time_table(const IoResults& results) {
  std::string text = kTimesNote + heading({"step", "by", "ms", "CPU ms"});
  for (const IoTime& time : results.times) text += row({time.step, time.by, cell(time.ms), cell(time.cpu_ms)});
  return text + "\n";
}

std::string size_table(const IoResults& results) {
  std::string text = "## Sizes\n\n" + heading({"file", "by", "bytes"});
  for (const IoSize& size : results.sizes) text += row({size.file, size.by, std::to_string(size.bytes)});
  return text + "\n";
}

Json options_json(const IoOptions& options) {
  return {{"width", options.width},
          {"slices", options.slices},
          {"steps", options.steps},
          {"cell_sizes", options.cell_sizes},
          {"repeats", options.repeats}};
}

}  // namespace

nlohmann::json to_json(const IoResults& results, const std::vector<Floor>& floors) {
  Json times = Json::array(), sizes = Json::array();
  for (const IoTime& time : results.times)
    times.push_back({{"step", time.step}, {"by", time.by}, {"ms", to_json(time.ms)}, {"cpu_ms", to_json(time.cpu_ms)}});
  for (const IoSize& size : results.sizes)
    sizes.push_back({{"file", size.file}, {"by", size.by}, {"bytes", size.bytes}});
  return {{"program", "tetwarp-bench io"},
          {"version", version()},
          {"commit", commit()},
          {"options", options_json(results.options)},
          {"machine", to_json(results.machine)},
          {"input", input_json("phantom")},
          {"size", size_json(results.size)},
          {"page_cache", true},
          {"times", times},
          {"sizes", sizes},
          {"floors", to_json(floors)}};
}

std::string to_markdown(const IoResults& results, const std::vector<Floor>& floors) {
  return introduction(results) + time_table(results) + size_table(results) + to_markdown(floors);
}

}  // namespace tetwarp::bench
