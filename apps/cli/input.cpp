// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/input.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/text/text_number.h"
#include "io/dicom_dose.h"
#include "io/dicom_text.h"
#include "io/hash.h"
#include "io/image_file.h"
#include "io/opened_file.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

constexpr double kAirHu = -1024;

/// A line for each volume of a scan, for messages. @param uid  only those of the series with this UID; none: all
std::string list_series(const DicomScan& scan, const std::optional<std::string>& uid = {}) {
  std::string list;
  for (std::size_t n = 0; n < scan.series.size(); ++n) {
    if (!uid || scan.series[n].series_uid == *uid) list += "\n" + describe(scan.series[n], n + 1);
  }
  return list;
}

/// The series that --series names.
const DicomSeries& named_series(const DicomScan& scan, const InputOptions& options) {
  const std::string where = shown(options.path), name = shown(options.series);
  const std::size_t number = number_from<std::size_t>(options.series).value_or(0);
  if (number >= 1 && number <= scan.series.size()) return scan.series[number - 1];
  const auto is_named = [&](const DicomSeries& series) { return series.series_uid == options.series; };
  const auto found = std::find_if(scan.series.begin(), scan.series.end(), is_named);
  require(found != scan.series.end(), "no series \"" + name + "\", " + where + "; choose one of" + list_series(scan));
  const auto count = std::count_if(scan.series.begin(), scan.series.end(), is_named);
  require(count == 1, "the series " + name + " holds " + std::to_string(count) + " volumes, " + where +
                          "; choose one by its number" + list_series(scan, options.series));
  return *found;
}

/// The series that --series names, or the only one that holds CT slices, usable or not.
const DicomSeries& choose_series(const DicomScan& scan, const InputOptions& options) {
  const std::string where = shown(options.path);
  require(!scan.series.empty(),
          "no DICOM image found, " + where + "; give a folder that holds a CT series" +
              (scan.skipped.empty() ? std::string() : " (first file: " + to_string(scan.skipped.front()) + ")"));
  if (!options.series.empty()) return named_series(scan, options);
  if (const auto only = only_choice(scan)) return scan.series[*only];
  const bool usable =
      std::any_of(scan.series.begin(), scan.series.end(), [](const DicomSeries& series) { return !series.refusal; });
  const bool several =
      std::any_of(scan.series.begin(), scan.series.end(), [](const DicomSeries& series) { return series.volumes > 1; });
  throw InputError(std::to_string(scan.series.size()) + (several ? " volumes" : " series") + " found, " + where +
                   (!usable               ? "; none of them is a usable volume"
                    : options.has_options ? "; choose one with --series"
                                          : "; name a folder that holds one of them alone") +
                   list_series(scan));
}

/// The files that were set aside of the series of a volume. Where a series has several volumes, the first of them has
/// the list.
const std::vector<LeftOutFile>& set_aside_with(const DicomScan& scan, const DicomSeries& volume) {
  const auto index = static_cast<std::size_t>(&volume - scan.series.data());
  std::size_t first = 0;
  while (first + scan.series[first].volumes <= index) first += scan.series[first].volumes;
  return scan.series[first].set_aside;
}

std::vector<std::string> named(std::vector<std::string> notes, const std::filesystem::path& file) {
  for (std::string& note : notes) note.insert(0, file.string() + ": ");
  return notes;
}

double smallest_value(const AnyVolume& volume) {
  return dispatch(volume.type(), [&](auto voxel) {
    using V = decltype(voxel);
    bool any = false;
    V smallest{};
    for (const V value : volume.as<V>()) {
      if (value == value && (!any || value < smallest)) {
        smallest = value;
        any = true;
      }
    }
    return static_cast<double>(smallest);
  });
}

}  // namespace

std::optional<std::size_t> only_choice(const DicomScan& scan) {
  if (scan.series.size() == 1) return 0;
  std::optional<std::size_t> only;
  for (std::size_t n = 0; n < scan.series.size(); ++n) {
    if (scan.series[n].slices.empty()) continue;  // localizers, captures, doses: nothing to choose
    if (only) return std::nullopt;
    only = n;
  }
  return only;
}

std::string number_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr;
  return std::string(text, end);
}

std::string exact_number_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string describe(const DicomSeries& series, std::size_t number) {
  std::string line = "  " + std::to_string(number) + "  " +
                     (series.series_uid.empty() ? "(no UID)" : shown(series.series_uid)) + "  " +
                     (series.modality.empty() ? "??" : shown(series.modality)) + "  " +
                     (series.label.empty() ? "" : series.label + "  ") + plural(series.slices.size(), "slice");
  if (series.refusal) return line + "  not usable: " + *series.refusal;
  const glm::dvec3& spacing = series.geometry.spacing;
  return line + "  " + to_string(series.geometry.size) + "  " + number_text(spacing.x) + " x " +
         number_text(spacing.y) + " x " + number_text(spacing.z) + " mm";
}

void refuse_pipes(const std::filesystem::path& path) { kind_at(path); }

InputHeader open_input(const InputOptions& options, const Control& control, bool components) {
  refuse_pipes(options.path);
  if (has_image_suffix(options.path)) {
    if (!options.series.empty() || options.single) {
      throw UsageError("--series and --single are for DICOM, " + options.path.string() + "; leave them out");
    }
    const ImageHeader header = read_image_header(options.path, options.nifti_frame);
    require(components || header.components == 1, std::to_string(header.components) + " components a voxel, " +
                                                      options.path.string() + "; expected a volume with one");
    return {header.geometry, header.type, {}, false, header.components, named(header.notes, options.path)};
  }
  if (is_dicom_dose(options.path)) return {read_dose_header(options.path).geometry, VoxelType::f32, {}, true, 1};
  if (options.single && is_folder(options.path)) {
    throw UsageError("--single is for one DICOM file, " + options.path.string() + " is a folder; name a file in it");
  }
  const DicomScan scan = scan_dicom(options.path, options.single, control);
  const DicomSeries& chosen = choose_series(scan, options);
  require(!chosen.refusal, chosen.refusal.value_or(""));
  require(!chosen.uneven || options.uneven,
          chosen.uneven.value_or("") + "; add what is missing" +
              (options.has_options ? ", or give --uneven exact, which takes each slice where it is" : ""));
  DicomSeries series = chosen;
  series.set_aside = set_aside_with(scan, chosen);
  return {series.geometry, VoxelType::i16, series, false, 1};
}

InputHeader open_input(const InputOptions& options, const CommonOptions& common, bool components) {
  Stage stage(common, "scan");
  return open_input(options, stage.control(), components);
}

InputVolume read_input(const InputOptions& options, const InputHeader& header, const CommonOptions& common,
                       const Control& control) {
  InputVolume input;
  if (!header.series) {
    input.volume = header.dose ? read_dose(options.path) : read_image(options.path, options.nifti_frame);
    input.background = smallest_value(input.volume);
    return input;
  }
  input.dicom = load_dicom(*header.series, common.threads, control, options.hash);
  input.background = input.dicom->padding ? input.dicom->padding->low : kAirHu;
  input.volume = AnyVolume(std::move(input.dicom->volume));
  return input;
}

std::vector<std::string> notes_of_file(const std::filesystem::path& path, NiftiFrame frame) {
  if (!has_image_suffix(path)) return {};
  return named(read_image_header(path, frame).notes, path);
}

bool fits(VoxelType type, double value) {
  return dispatch(type, [&](auto voxel) {
    using V = decltype(voxel);
    return value >= static_cast<double>(std::numeric_limits<V>::lowest()) &&
           value <= static_cast<double>(std::numeric_limits<V>::max());
  });
}

std::string hash_file(const std::filesystem::path& path) {
  std::ifstream file = opened(path);
  Sha256 hash;
  std::vector<char> buffer(std::size_t{1} << 20);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    hash.add(std::as_bytes(std::span(buffer.data(), static_cast<std::size_t>(file.gcount()))));
  }
  require(file.eof(), "cannot be read to its end, " + path.string());
  return hash.hex();
}

}  // namespace tetwarp::apps
