// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <unistd.h>

#include <iostream>
#include <map>

#include "apps/batch/case_record.h"
#include "apps/batch/check.h"
#include "apps/batch/init.h"
#include "apps/batch/runner.h"
#include "apps/batch/threads.h"
#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "backend/devices.h"
#include "backend/factories.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kSomeFailed = 3, kInterrupted = 130;

std::vector<std::string> ids_of(const std::vector<BatchCase>& cases) {
  std::vector<std::string> ids;
  ids.reserve(cases.size());
  for (const BatchCase& one : cases) ids.push_back(one.id);
  return ids;
}

/// Refuses an OUTPUT_DIR in which the manifest would lie among what is written. @throws UsageError
void refuse_manifest_inside(const BatchOptions& options) {
  ReadPlaces manifest;
  manifest.add(options.manifest);
  refuse_reads(manifest, options.output);
}

/// One run of `tetwarp batch`.
class Batch {
 public:
  explicit Batch(const BatchOptions& options)
      : options_(options),
        shard_(options.shard.empty() ? Shard() : parse_shard(options.shard)),
        cases_(read_manifest(options.manifest, options.output)) {}

  int run();

 private:
  void choose();
  void check(BatchProgress& progress);
  void find_finished(const OutputFolder& folder, Results& results);
  int conclude(const Results& results, BatchProgress& progress, const Usage& usage, bool whole) const;
  std::vector<std::string> ids() const;
  std::size_t wanted_jobs(const Devices& devices, bool cuda) const;
  BatchProgress::Form form() const;
  std::uint64_t memory_bytes() const { return options_.memory_bytes.value_or(available_memory_bytes() / 5 * 4); }

  const BatchOptions& options_;
  Shard shard_;
  std::vector<BatchCase> cases_;
  std::vector<const BatchCase*> mine_;  ///< cases of this shard
  std::vector<const BatchCase*> open_;  ///< cases of this shard that are not finished
  /// Of the cases in `open_`, by reason, the ids of those that were made before and have to be made again.
  std::map<std::string, std::vector<std::string>> again_;
  BatchCheck found_;
};

BatchProgress::Form Batch::form() const {
  if (options_.log_json) return BatchProgress::Form::machine;
  return options_.common.quiet ? BatchProgress::Form::none : BatchProgress::Form::person;
}

void Batch::choose() {
  for (std::size_t n = 0; n < cases_.size(); ++n) {
    BatchCase& one = cases_[n];
    one.options.common.quiet = true;
    one.options.common.threads = options_.common.threads;
    if (shard_.holds(n)) mine_.push_back(&one);
  }
}

std::vector<std::string> Batch::ids() const {
  std::vector<std::string> ids;
  for (const BatchCase* one : mine_) ids.push_back(one->id);
  return ids;
}

/// Keeps the cases whose folder is complete. All others are made, and what was made before is replaced.
void Batch::find_finished(const OutputFolder& folder, Results& results) {
  folder.remove_unfinished(ids());
  const std::map<std::string, json> earlier = read_lines(folder.results());
  std::vector<std::optional<json>> lines(mine_.size());
  std::vector<std::string> why(mine_.size());
  for_each_index(mine_.size(), options_.common.threads, {.stop = interrupt_token()},
                 [&](std::size_t n) { lines[n] = finished_line(*mine_[n], folder.case_folder(mine_[n]->id), why[n]); });
  for (std::size_t n = 0; n < mine_.size(); ++n) {
    if (lines[n]) {
      results.keep(*lines[n]);
      continue;
    }
    open_.push_back(mine_[n]);
    const auto line = earlier.find(mine_[n]->id);
    if (why[n].empty() && line != earlier.end())
      why[n] = line->second.value("status", "") == "done" ? "the folder is gone" : "nothing came of them before";
    if (!why[n].empty()) again_[why[n]].push_back(mine_[n]->id);
  }
  for (BatchCase& one : cases_) one.options.common.overwrite = fs::exists(folder.case_folder(one.id) / kFolderRecord);
}

void Batch::check(BatchProgress& progress) {
  Stage stage(options_.common, "check");
  refuse_manifest_inside(options_);
  found_ = check_cases(options_.manifest, options_.output, mine_, memory_bytes(), stage.control());
  for (const std::string& forecast : found_.forecasts) progress.warn(forecast);
}

int Batch::conclude(const Results& results, BatchProgress& progress, const Usage& usage, bool whole) const {
  results.finish();
  const Tally tally = results.tally();
  progress.end({{"done", tally.done}, {"failed", tally.failed}, {"not_run", tally.missing}, {"usage", usage.report()}});
  if (form() == BatchProgress::Form::person) {
    std::cout << results.table(mine_.size() <= 60);
    if (const std::string sentence = usage.sentence(); !sentence.empty()) say(options_.common, sentence);
    if (!whole) say(options_.common, "tetwarp: interrupted; --resume continues");
  }
  if (!whole) return kInterrupted;
  return tally.failed > 0 ? kSomeFailed : 0;
}

/// How many cases to have in work at once. While one is resampled others are read and written, which takes longer than
/// a CUDA device needs.
std::size_t Batch::wanted_jobs(const Devices& devices, bool cuda) const {
  constexpr std::size_t kPerDevice = 8, kOnCpu = 3;
  const std::size_t usual = cuda ? kPerDevice * devices.count() : kOnCpu;
  const std::size_t wanted = options_.jobs > 0 ? static_cast<std::size_t>(options_.jobs) : usual;
  return std::clamp<std::size_t>(mine_.size(), 1, wanted);
}

int Batch::run() {
  choose();
  if (options_.dry_run) {
    for (const BatchCase* one : mine_) {
      std::cout << one->id << ": tetwarp";
      for (const std::string& argument : command_of(*one)) std::cout << " " << shell_quoted(argument);
      std::cout << "\n";
    }
  }
  BatchProgress progress(form());
  const int cuda = may_use_device(options_.backend) ? device_count() : 0;
  Devices devices(options_.backend, cuda);
  const Threads threads(wanted_jobs(devices, cuda > 0));  // started before anything else needs threads
  check(progress);
  if (options_.dry_run) {
    const DiskBytes disk = disk_of(found_, mine_);
    say(options_.common, "would run " + std::to_string(mine_.size()) + " cases; outputs of at most " +
                             format_bytes(disk.plain + disk.packed) + " before compression");
    return 0;
  }
  std::error_code unknown;
  const bool made_before = options_.resume && fs::exists(options_.output, unknown);
  // Checked before a folder is begun, for a later run would refuse to use that.
  if (!made_before) check_space(disk_of(found_, mine_), options_.output);
  if (demands_device(options_.backend) && cuda == 0) {
    Geometry any;
    any.size = glm::i64vec3(2);  // a grid is looked at before a device is
    make_forward_resampler(BackendKind::cuda, any);
  }
  OutputFolder folder(options_.output, shard_, ids_of(cases_), hash_file(options_.manifest), options_.resume);
  Results results(folder, ids());
  find_finished(folder, results);
  const std::string scarce = check_space(disk_of(found_, open_), folder.path());
  MemoryBudget memory(memory_bytes());
  const std::size_t jobs = std::clamp<std::size_t>(open_.size(), 1, threads.jobs());
  progress.begin(open_.size(), mine_.size() - open_.size());
  for (const auto& [reason, cases] : again_) progress.again(reason, cases);
  if (!scarce.empty()) progress.warn(scarce);
  if (threads.limit()) {
    progress.warn("the system gives only " + std::to_string(*threads.limit()) + " threads: " + std::to_string(jobs) +
                  " cases at once (ulimit -u, or pids.max of the control group)");
  }
  Usage usage(devices.places(), devices.count(), cuda > 0, jobs);
  SharedInputs inputs;
  Runner runner(open_, {{memory, devices, inputs}, results, progress, usage});
  const bool whole = runner.run(jobs, [&] {
    folder.remove_unfinished(ids());
    const int status = conclude(results, progress, usage, false);
    std::cout.flush();
    ::_exit(status);
  });
  return conclude(results, progress, usage, whole);
}

int merge(const BatchOptions& options) {
  std::string table;
  refuse_manifest_inside(options);
  const std::vector<BatchCase> cases = read_manifest(options.manifest, options.output);
  const Tally tally = merge_shards(options.output, ids_of(cases), table);
  if (!options.common.quiet) std::cout << table;
  return tally.failed > 0 ? kSomeFailed : 0;
}

}  // namespace

int run_batch(const BatchOptions& options) {
  if (!options.init.empty()) return run_batch_init(options);
  if (options.manifest.empty()) throw UsageError("no manifest; give one, or make one with --init FOLDER");
  return options.merge ? merge(options) : Batch(options).run();
}

}  // namespace tetwarp::apps
