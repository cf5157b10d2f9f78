// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/init.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include "apps/batch/output_folder.h"
#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "io/csv_record.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

namespace {

/// The innermost folder that contains all files of a series.
fs::path folder_of(const DicomSeries& series) {
  fs::path folder = series.slices.front().file.parent_path();
  for (const DicomSlice& slice : series.slices) {
    const fs::path other = slice.file.parent_path();
    const auto ends = std::mismatch(folder.begin(), folder.end(), other.begin(), other.end());
    if (ends.first == folder.end()) continue;
    fs::path shared;
    for (auto part = folder.begin(); part != ends.first; ++part) shared /= *part;
    folder = shared;
  }
  return folder;
}

bool is_same(const DicomSeries& a, const DicomSeries& b) {
  return a.series_uid == b.series_uid && a.label == b.label && a.slices.size() == b.slices.size() &&
         a.slices.front().file.filename() == b.slices.front().file.filename();
}

/// The argument of `--series` that names one series of a scan; empty where none is needed.
std::string name_in(const DicomScan& scan, const DicomSeries& wanted) {
  const auto found = std::find_if(scan.series.begin(), scan.series.end(),
                                  [&](const DicomSeries& series) { return is_same(series, wanted); });
  require(found != scan.series.end(), "the files of a folder changed while it was read, " + wanted.series_uid);
  const auto index = static_cast<std::size_t>(found - scan.series.begin());
  if (only_choice(scan) == index) return "";
  const auto count = std::count_if(scan.series.begin(), scan.series.end(),
                                   [&](const DicomSeries& series) { return series.series_uid == wanted.series_uid; });
  return count == 1 && !wanted.series_uid.empty() ? wanted.series_uid : std::to_string(index + 1);
}

/// A path as a manifest in the folder `base` names it: relative if it lies in that folder.
fs::path as_named(const fs::path& folder, const fs::path& base) {
  const fs::path from = fs::weakly_canonical(base.empty() ? fs::path(".") : base), to = fs::weakly_canonical(folder);
  const fs::path relative = to.lexically_relative(from);
  return relative.empty() || *relative.begin() == ".." ? to : relative;
}

std::string comment_of(const DicomSeries& series) {
  const glm::dvec3& spacing = series.geometry.spacing;
  return to_string(series.geometry.size) + ", " + number_text(spacing.x) + " x " + number_text(spacing.y) + " x " +
         number_text(spacing.z) + " mm" + (series.label.empty() ? "" : ", " + series.label);
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Why a volume cannot be a case; empty where it can.
std::string problem_of(const DicomSeries& series) {
  if (series.refusal || series.slices.empty()) return series.refusal.value_or("no CT slices");
  const glm::i64vec3& size = series.geometry.size;
  return std::min({size.x, size.y, size.z}) < 2 ? "a volume of " + to_string(size) + " voxels has no cell to deform"
                                                : "";
}

/// Writes the rows of a scan.
class Rows {
 public:
  Rows(const BatchOptions& options, const DicomScan& scan) : options_(options), scan_(scan) {}

  std::string text();
  std::size_t count() const { return count_; }

 private:
  std::string row(const DicomSeries& series);
  const DicomScan& scan_of(const fs::path& folder);

  const BatchOptions& options_;
  const DicomScan& scan_;
  std::map<fs::path, DicomScan> scans_;
  std::size_t count_ = 0;
};

const DicomScan& Rows::scan_of(const fs::path& folder) {
  std::error_code error;
  if (fs::equivalent(folder, options_.init, error)) return scan_;
  const auto [found, is_new] = scans_.try_emplace(folder);
  if (is_new) found->second = scan_dicom(folder, false, {.stop = interrupt_token()});
  return found->second;
}

std::string Rows::row(const DicomSeries& series) {
  const fs::path folder = folder_of(series);
  char id[32];
  std::snprintf(id, sizeof id, "case-%03zu", ++count_);
  const std::vector<std::string> cells = {id,
                                          as_named(folder, options_.output.parent_path()).string(),
                                          name_in(scan_of(folder), series),
                                          series.uneven ? "exact" : "",
                                          options_.field,
                                          "deformed.nii.gz",
                                          comment_of(series)};
  std::string line;
  for (const std::string& cell : cells) line += (&cell == &cells.front() ? "" : ",") + quoted(cell);
  return line + "\n";
}

std::string Rows::text() {
  std::string rows = "case,input,series,uneven,field,output,comment\n", others;
  for (const DicomSeries& series : scan_.series) {
    const std::string problem = problem_of(series);
    if (problem.empty()) {
      // Slices at uneven distances may mean that some are missing; a person has to confirm that they are meant.
      if (series.uneven)
        rows += "# " + one_line(*series.uneven) + "; to take each slice where it is, remove the # before:\n#";
      rows += row(series);
      continue;
    }
    others += "# not usable: " + (series.series_uid.empty() ? "no UID" : shown(series.series_uid)) + ": " +
              one_line(problem) + "\n";
  }
  return rows + others;
}

}  // namespace

int run_batch_init(const BatchOptions& options) {
  if (options.output.extension() != ".csv")
    throw UsageError("unknown suffix of \"" + options.output.string() + "\"; a manifest is written as .csv");
  std::error_code error;
  if (fs::exists(options.output, error) && !options.common.overwrite)
    throw Error(options.output.string() + " exists; choose another name or add --overwrite");
  ReadPlaces study;
  study.add(options.init);
  refuse_reads(study, options.output);
  Stage stage(options.common, "scan");
  const DicomScan scan = scan_dicom(options.init, false, stage.control());
  Rows rows(options, scan);
  const std::string text = rows.text();
  require(rows.count() > 0, "no volume that can be deformed, " + shown(options.init) + "; see tetwarp info");
  write_whole(options.output, text);
  say(options.common, "wrote " + options.output.string() + ": " + plural(rows.count(), "case") +
                          "; edit the fields, then tetwarp batch " + options.output.string() + " -o OUTPUT_DIR");
  return 0;
}

}  // namespace tetwarp::apps
