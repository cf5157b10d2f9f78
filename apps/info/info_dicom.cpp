// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/info/info_dicom.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

constexpr std::size_t kNamesShown = 3;

/// Files, or frames of files, that were left out for one reason.
struct ReasonGroup {
  std::string reason;
  std::vector<std::string> files;  ///< names of the files or frames
  std::string noun = "file";
};

/// The files by reason, in the order in which the reasons occur first.
std::vector<ReasonGroup> by_reason(const std::vector<LeftOutFile>& left_out) {
  std::vector<ReasonGroup> groups;
  std::map<std::string, std::size_t> place_of;
  for (const LeftOutFile& one : left_out) {
    const auto [found, is_new] = place_of.try_emplace(one.reason, groups.size());
    if (is_new) groups.push_back({.reason = one.reason, .files = {}});
    groups[found->second].files.push_back(shown(one.file, one.frame));
    if (one.frame) groups[found->second].noun = "frame";
  }
  return groups;
}

json left_out_json(const std::vector<LeftOutFile>& left_out) {
  json list = json::array();
  for (const ReasonGroup& group : by_reason(left_out))
    list.push_back({{"reason", group.reason}, {"count", group.files.size()}, {"files", group.files}});
  return list;
}

bool can_be_deformed(const DicomSeries& series) { return !series.refusal && series.slices.size() > 1; }

/// A path in quotes where a shell needs them.
std::string quoted(const std::filesystem::path& path) {
  const std::string text = shown(path);
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) || std::strchr("_./-+,:@", c); };
  if (std::all_of(text.begin(), text.end(), is_plain)) return text;
  std::string quotes = "'";
  for (const char c : text) quotes += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quotes + "'";
}

/// The command line that deforms the first volume that can be deformed; empty where there is none.
std::string hint(const DicomScan& scan, const InputOptions& input) {
  const auto found = std::find_if(scan.series.begin(), scan.series.end(), can_be_deformed);
  if (found == scan.series.end()) return {};
  const auto number = found - scan.series.begin() + 1;
  return "tetwarp deform " + quoted(input.path) +
         (only_choice(scan) ? std::string() : " --series " + std::to_string(number)) +
         (found->uneven ? " --uneven exact" : "") + " -f FIELD -o OUTPUT";
}

/// The plane of slices, and their extent in patient directions: "axial; head to feet 139 mm".
std::string lie_of(const Geometry& geometry) {
  const std::string plane = plane_name(geometry.direction[2]);
  const char* ways = plane.ends_with("axial")     ? "head to feet"
                     : plane.ends_with("coronal") ? "front to back"
                                                  : "left to right";
  const double length =
      geometry.slices.empty() ? geometry.spacing.z * static_cast<double>(geometry.size.z - 1) : geometry.slices.back();
  return plane + "; " + ways + " " + number_text(length) + " mm";
}

/// Number of files that hold the slices.
std::size_t files_of(const DicomSeries& series) {
  std::set<std::filesystem::path> files;
  for (const DicomSlice& slice : series.slices) files.insert(slice.file);
  return files.size();
}

/// Number of slices, "140 slices"; for frames "140 slices in 1 file".
std::string slices_of(const DicomSeries& series) {
  const std::string slices = plural(series.slices.size(), "slice");
  const bool has_frames =
      std::any_of(series.slices.begin(), series.slices.end(), [](const DicomSlice& slice) { return slice.frame; });
  return has_frames ? slices + " in " + plural(files_of(series), "file") : slices;
}

/// A line that describes a volume: "CT, 512 x 512, 140 slices, 1 mm apart, axial; head to feet 139 mm".
std::string summary(const DicomSeries& series) {
  std::string text = series.modality.empty() ? "unknown kind" : shown(series.modality);
  const Geometry& geometry = series.geometry;
  if (series.slices.empty()) return text + ", no slices";
  if (geometry.size.x > 0) text += ", " + std::to_string(geometry.size.x) + " x " + std::to_string(geometry.size.y);
  text += ", " + slices_of(series);
  if (series.refusal) return text;
  if (series.slices.size() == 1) return text + ", " + plane_name(geometry.direction[2]);
  const std::string apart =
      series.uneven ? ", unevenly spaced, " : ", " + number_text(geometry.spacing.z) + " mm apart, ";
  return text + apart + lie_of(geometry);
}

json series_json(const DicomSeries& series, std::size_t number) {
  json document = {{"number", number},
                   {"series_instance_uid", series.series_uid},
                   {"study_instance_uid", series.study_uid},
                   {"frame_of_reference_uid", series.frame_of_reference_uid},
                   {"series_number", series.series_number ? json(*series.series_number) : json()},
                   {"modality", series.modality},
                   {"description", series.description},
                   {"summary", summary(series)},
                   {"volumes_in_series", series.volumes},
                   {"label", series.label},
                   {"split_by", series.split_by},
                   {"slices", series.slices.size()},
                   {"files", files_of(series)},
                   {"usable", !series.refusal},
                   {"set_aside", left_out_json(series.set_aside)},
                   {"warnings", series.warnings}};
  if (series.refusal)
    document["refusal"] = *series.refusal;
  else
    document["geometry"] = to_json(series.geometry);
  if (series.uneven) document["uneven"] = *series.uneven;
  return document;
}

void print_line(const std::string& line) { std::printf("%s\n", line.c_str()); }

void print_left_out(const std::vector<LeftOutFile>& left_out) {
  for (const ReasonGroup& group : by_reason(left_out)) {
    print_line("     " + plural(group.files.size(), group.noun) + ": " + group.reason);
    for (std::size_t n = 0; n < std::min(group.files.size(), kNamesShown); ++n) print_line("       " + group.files[n]);
    if (group.files.size() > kNamesShown)
      print_line("       and " + std::to_string(group.files.size() - kNamesShown) + " more");
  }
}

void print_uid(const DicomSeries& series) {
  print_line("     UID " + (series.series_uid.empty() ? "(none)" : shown(series.series_uid)));
}

void print_set_aside(const DicomSeries& series) {
  if (series.set_aside.empty() || series.slices.empty()) return;
  print_line("     set aside, no part of the volume:");
  print_left_out(series.set_aside);
}

/// Prints what the volumes of a series have in common, before the first of them.
void print_series_of_several(const DicomSeries& series) {
  print_line("\n     One series" + (series.description.empty() ? "" : ", \"" + series.description + "\",") + " holds " +
             std::to_string(series.volumes) + " volumes, told apart by " + series.split_by + ":");
  print_uid(series);
  print_set_aside(series);
}

void print_state(const DicomSeries& series) {
  if (series.slices.empty()) {
    print_line("     cannot be used, it holds no CT slice:");
    print_left_out(series.set_aside);
  } else if (series.refusal) {
    print_line("     cannot be used: " + *series.refusal);
  } else {
    const glm::dvec3& spacing = series.geometry.spacing;
    print_line("     voxels " + number_text(spacing.x) + " x " + number_text(spacing.y) + " x " +
               number_text(spacing.z) + (series.uneven ? " mm on average" : " mm"));
    if (series.uneven) print_line("     uneven: " + *series.uneven + "; needs --uneven exact");
    if (series.slices.size() == 1) print_line("     cannot be deformed: one slice has no cells");
  }
  for (const std::string& warning : series.warnings) print_line("     note: " + warning);
}

void print_volume(const DicomSeries& series, std::size_t number) {
  const bool several = series.volumes > 1;
  std::string title = std::to_string(number);
  title.insert(0, title.size() < 3 ? 3 - title.size() : 0, ' ');
  if (several)
    title += "  " + series.label + ":";
  else if (!series.description.empty())
    title += "  \"" + series.description + "\":";
  print_line("\n" + title + "  " + summary(series));
  if (!several) print_uid(series);
  print_state(series);
  if (!several) print_set_aside(series);
}

}  // namespace

json describe(const DicomScan& scan, const InputOptions& input) {
  json document = {{"path", shown(input.path)},
                   {"kind", "dicom"},
                   {"files", scan.files},
                   {"series", json::array()},
                   {"skipped", left_out_json(scan.skipped)},
                   {"hint", hint(scan, input)}};
  for (std::size_t n = 0; n < scan.series.size(); ++n) document["series"].push_back(series_json(scan.series[n], n + 1));
  return document;
}

void print(const DicomScan& scan, const InputOptions& input) {
  const auto usable = std::count_if(scan.series.begin(), scan.series.end(), can_be_deformed);
  print_line(shown(input.path) + ": " + plural(scan.files, "file") + ", " +
             (scan.series.empty()
                  ? "no DICOM image"
                  : std::to_string(usable) + " of " + std::to_string(scan.series.size()) + " entries can be deformed"));
  std::size_t left = 0;  // how many volumes of the present series are still to come
  for (std::size_t n = 0; n < scan.series.size(); ++n) {
    const DicomSeries& series = scan.series[n];
    if (left == 0 && series.volumes > 1) print_series_of_several(series);
    left = (left == 0 ? series.volumes : left) - 1;
    print_volume(series, n + 1);
  }
  if (!scan.skipped.empty()) print_line("\n     Other files, no DICOM images:");
  print_left_out(scan.skipped);
  const std::string next = hint(scan, input);
  print_line(next.empty() ? "\nNothing here can be deformed." : "\nTo deform one: " + next);
}

}  // namespace tetwarp::apps
