// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/view/view_save.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include "apps/cli/input.h"
#include "io/shown_text.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

constexpr const char* kDemoFile = "phantom.nii.gz";

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

/// @throws InputError for a name that might be anything but a file of the folder
void require_plain(const std::string& name) {
  require(!name.empty() && name.size() <= 64 && name.front() != '-' && std::all_of(name.begin(), name.end(), is_plain),
          "a name has letters, digits, hyphens and underscores, up to 64 of them");
}

/// A word of a command line, in quotes where it needs them.
std::string word(const fs::path& path) {
  const std::string text = path.string();
  const auto is_safe = [](char c) { return is_plain(c) || c == '/' || c == '.'; };
  return !text.empty() && std::all_of(text.begin(), text.end(), is_safe) ? text : shell_quoted(text);
}

/// Three numbers of an option.
template <class Numbers>
std::string listed(const Numbers& numbers) {
  std::string text;
  for (const auto number : numbers) text += (text.empty() ? "" : ",") + number_text(static_cast<double>(number));
  return text;
}

PhantomOptions demo_phantom(const fs::path& folder) {
  PhantomOptions phantom;
  phantom.output = folder / kDemoFile;
  phantom.size.assign(std::begin(kDemoSize), std::end(kDemoSize));
  phantom.spacing.assign(std::begin(kDemoSpacing), std::end(kDemoSpacing));
  phantom.common.quiet = true;
  return phantom;
}

}  // namespace

std::vector<std::string> saved_volume_kinds(bool is_dicom) {
  std::vector<std::string> kinds = {".nii.gz", ".mha", ".nrrd"};
  if (is_dicom) kinds.insert(kinds.begin(), "dicom");
  return kinds;
}

Saving::Saving(const ViewOptions& options)
    : options_(options), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Saving::~Saving() { thread_.request_stop(); }

void Saving::begin(Wish wish, std::function<void(Result)> done) {
  const std::lock_guard lock(mutex_);
  wishes_.emplace_back(std::move(wish), std::move(done));
  wake_.notify_one();
}

void Saving::run(const std::stop_token& stop) {
  for (;;) {
    std::pair<Wish, std::function<void(Result)>> next;
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return !wishes_.empty(); })) return;
      next = std::move(wishes_.front());
      wishes_.pop_front();
    }
    Result result;
    try {
      result = save(next.first);
    } catch (const std::exception& error) {
      result.problem = error.what();
    }
    next.second(std::move(result));
  }
}

void Saving::write_scenario(const fs::path& path, const std::string& text) const {
  StagedOutput staged(path, StagedOutput::Kind::file, false);
  std::ofstream file(staged.path(), std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error("cannot write " + path.string() + "; check the free space");
  staged.commit();
}

Saving::Result Saving::save(const Wish& wish) const {
  require_plain(wish.name);
  const std::vector<std::string> kinds = saved_volume_kinds(true);
  require(wish.volume.empty() || std::find(kinds.begin(), kinds.end(), wish.volume) != kinds.end(),
          "no volume is written as that");
  std::error_code ignored;
  fs::create_directories(options_.output, ignored);  // what cannot be written there says so
  const fs::path scenario = options_.output / (wish.name + ".json");
  const bool is_series = wish.volume == "dicom";
  DeformOptions deform;
  deform.common = options_.common;
  deform.common.quiet = true;
  deform.input = options_.input;
  deform.scenario = scenario;
  deform.labels = options_.labels;
  deform.output = options_.output / (is_series ? wish.name : wish.name + wish.volume);
  deform.backend = options_.backend;
  deform.device = options_.device;
  if (!wish.volume.empty()) require(!fs::exists(deform.output), deform.output.string() + " exists; take another name");
  write_scenario(scenario, wish.scenario);
  Result result{{scenario.string()}, {}, {}};
  if (options_.demo) {
    deform.input.path = options_.output / kDemoFile;
    const PhantomOptions phantom = demo_phantom(options_.output);
    if (!wish.volume.empty() && !fs::exists(phantom.output)) run_phantom(phantom);
    result.command = "tetwarp phantom -o " + word(phantom.output) + " --size " + listed(kDemoSize) + " --spacing " +
                     listed(kDemoSpacing) + "\n";
  }
  result.command += "tetwarp deform " + word(deform.input.path) + " --scenario " + word(scenario);
  if (!options_.labels.empty()) result.command += " --labels " + word(options_.labels);
  result.command += " -o " + word(wish.volume.empty() ? options_.output / (wish.name + ".nii.gz") : deform.output);
  if (wish.volume.empty()) return result;
  run_deform(deform);
  result.files.push_back(deform.output.string());
  return result;
}

}  // namespace tetwarp::apps
