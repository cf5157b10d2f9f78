// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/output.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "apps/cli/reads.h"
#include "deform/version.h"
#include "io/image_file.h"
#include "io/lower_case.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

namespace {

/// Without slashes and "." at its end, as StagedOutput takes it.
fs::path plain(fs::path path) {
  while (path.has_relative_path() && (!path.has_filename() || path.filename() == ".")) path = path.parent_path();
  return path;
}

/// Of two real paths. A folder is inside itself.
bool is_inside(const fs::path& inner, const fs::path& outer) {
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

/// Whether the record of the folder that a file lies in, or of the one around it, names it.
bool is_recorded(const fs::path& file) {
  for (fs::path folder = file.parent_path(), name = file.filename(); folder.has_filename();
       name = folder.filename() / name, folder = folder.parent_path()) {
    if (name == kFolderRecord) return true;
    std::ifstream record(folder / kFolderRecord, std::ios::binary);
    if (!record) continue;
    const nlohmann::json document = nlohmann::json::parse(record, nullptr, false);
    if (!document.is_object() || !document.contains("files")) return false;
    const nlohmann::json& files = document["files"];
    return files.is_object() && files.contains(name.generic_string());
  }
  return false;
}

}  // namespace

bool is_series_output(const fs::path& output) {
  if (has_image_suffix(output)) return false;
  if (output.has_filename() && output.has_extension()) {
    throw UsageError("unknown suffix of \"" + output.string() +
                     "\"; use .nii .nii.gz .nrrd .mha, or a folder name for DICOM");
  }
  return true;
}

void refuse_reads(const ReadPlaces& reads, const fs::path& output) {
  const std::optional<fs::path> input = reads.touched_by(output);
  if (!input) return;
  throw UsageError("the output " + output.string() + " is, is inside, or is around the input " + input->string() +
                   "; choose another place");
}

OutputSet::OutputSet(const Reads& reads, bool overwrite, const fs::path& folder, bool only_look)
    : overwrite_(overwrite), together_(!folder.empty()), only_look_(only_look) {
  for (const fs::path& path : reads.paths()) reads_.add(path);
  if (!together_) return;
  refuse_reads(folder);
  take_place(folder / kFolderRecord);
  targets_.push_back(folder / kFolderRecord);
  if (only_look_) return;
  staged_.push_back(std::make_unique<StagedOutput>(plain(folder), StagedOutput::Kind::folder, overwrite, is_recorded));
}

void OutputSet::add_reads(const std::vector<fs::path>& files) {
  for (const fs::path& file : files) reads_.add(file);
  for (const fs::path& target : targets_) refuse_reads(target);
}

void OutputSet::refuse_reads(const fs::path& target) const { apps::refuse_reads(reads_, target); }

/// Paths are ordered component by component: what lies inside a folder follows upon it, and no taken place lies inside
/// another. So only two neighbours can be at odds with a new one.
void OutputSet::take_place(const fs::path& target) {
  const fs::path place = real_path(target);
  const auto next = places_.lower_bound(place);
  for (auto other = next == places_.begin() ? next : std::prev(next); other != places_.end(); ++other) {
    if (is_inside(place, other->first) || is_inside(other->first, place)) {
      throw UsageError("two outputs have the same place, " + other->second.string() + " and " + target.string() +
                       "; choose another name for one");
    }
    if (other == next) break;
  }
  places_.emplace(place, target);
}

fs::path OutputSet::add(const fs::path& target, StagedOutput::Kind kind) {
  if (target.empty()) return {};
  refuse_reads(target);
  take_place(target);
  targets_.push_back(target);
  if (only_look_) return target;
  if (together_) {
    const fs::path path = folder() / plain(target).filename();
    if (kind == StagedOutput::Kind::folder)
      fs::create_directory(path);
    else
      std::ofstream(path).close();
    return path;
  }
  staged_.push_back(std::make_unique<StagedOutput>(plain(target), kind, overwrite_,
                                                   kind == StagedOutput::Kind::folder ? is_tetwarp_dicom : nullptr));
  return staged_.back()->path();
}

void OutputSet::write(const std::function<void()>& write) {
  try {
    write();
  } catch (const InputError&) {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    std::string message = error.what();
    for (const auto& output : staged_) {
      const std::string staged = output->path().string();
      for (auto at = message.find(staged); at != std::string::npos; at = message.find(staged)) {
        message.replace(at, staged.size(), output->target().string());
      }
    }
    throw Error(message + "; nothing was written");
  }
}

void OutputSet::commit() { commit_together(staged_); }

fs::path sidecar_of(const fs::path& output) { return plain(output).string() + ".json"; }

fs::path bids_sidecar_of(const fs::path& output) {
  const auto has_suffix = [](const fs::path& path, const std::string& suffix) {
    return lower(path.extension().string()) == suffix;
  };
  fs::path stem = output;
  if (has_suffix(stem, ".gz")) stem.replace_extension();
  if (!has_suffix(stem, ".nii")) return {};
  return stem.replace_extension(".json");
}

std::filesystem::path frame_path(const std::filesystem::path& output, int number, int most) {
  const std::string name = output.filename().string();
  std::string suffix = output.extension().string();
  if (suffix.size() == 3 && (suffix[1] == 'g' || suffix[1] == 'G'))
    suffix = output.stem().extension().string() + suffix;  // .nii.gz
  std::string digits = std::to_string(number);
  digits.insert(0, std::max<std::size_t>(4, std::to_string(most).size()) - digits.size(), '0');
  return output.parent_path() / (name.substr(0, name.size() - suffix.size()) + "." + digits + suffix);
}

nlohmann::json to_json(const Geometry& geometry) {
  const auto list = [](const auto& v) { return nlohmann::json::array({v.x, v.y, v.z}); };
  nlohmann::json document = {
      {"size", list(geometry.size)},
      {"spacing_mm", list(geometry.spacing)},
      {"origin_lps_mm", list(geometry.origin)},
      {"direction_columns", {list(geometry.direction[0]), list(geometry.direction[1]), list(geometry.direction[2])}},
      {"orientation", orientation_code(geometry)}};
  if (!geometry.slices.empty()) document["slices_mm"] = geometry.slices;
  return document;
}

nlohmann::json to_json(const Residuals& residuals) {
  return {{"points", residuals.points},
          {"mean_mm", residuals.mean},
          {"percentile_99_mm", residuals.percentile_99},
          {"largest_mm", residuals.largest}};
}

nlohmann::json provenance(const std::string& command) {
  return {{"program", "tetwarp"}, {"version", version()}, {"commit", commit()}, {"command", command}};
}

}  // namespace tetwarp::apps
