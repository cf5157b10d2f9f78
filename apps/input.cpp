#include "apps/input.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include "io/dicom_dose.h"
#include "io/hash.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

constexpr double kAirHu = -1024;

std::string number_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr;
  return std::string(text, end);
}

std::string list_series(const DicomScan& scan) {
  std::string list;
  for (std::size_t n = 0; n < scan.series.size(); ++n) list += "\n" + describe(scan.series[n], n + 1);
  return list;
}

/// The series that --series names, or the only one that holds CT slices, usable or not.
const DicomSeries& choose_series(const DicomScan& scan, const InputOptions& options) {
  const std::string where = options.path.string();
  require(!scan.series.empty(),
          "no DICOM image found, " + where + "; give a folder that holds a CT series" +
              (scan.skipped.empty() ? std::string() : " (first file: " + scan.skipped.front() + ")"));
  if (!options.series.empty()) {
    std::size_t number = 0;
    const char* const end = options.series.data() + options.series.size();
    if (std::from_chars(options.series.data(), end, number).ptr == end && number >= 1 && number <= scan.series.size()) {
      return scan.series[number - 1];
    }
    const auto found = std::find_if(scan.series.begin(), scan.series.end(),
                                    [&](const DicomSeries& series) { return series.series_uid == options.series; });
    require(found != scan.series.end(),
            "no series \"" + options.series + "\", " + where + "; choose one of" + list_series(scan));
    return *found;
  }
  const DicomSeries* only = &scan.series.front();
  std::size_t holding_slices = 0;
  for (const DicomSeries& series : scan.series) {
    if (series.slices.empty()) continue;  // localizers, captures, doses: nothing to choose
    only = &series;
    ++holding_slices;
  }
  if (holding_slices == 1 || scan.series.size() == 1) return *only;
  const bool usable =
      std::any_of(scan.series.begin(), scan.series.end(), [](const DicomSeries& series) { return !series.refusal; });
  throw InputError(std::to_string(scan.series.size()) + " series found, " + where +
                   (usable ? "; choose one with --series" : "; none of them is a usable volume") + list_series(scan));
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

std::string describe(const DicomSeries& series, std::size_t number) {
  std::string line =
      "  " + std::to_string(number) + "  " + (series.series_uid.empty() ? "(no UID)" : series.series_uid) + "  " +
      (series.modality.empty() ? "??" : series.modality) + "  " + std::to_string(series.slices.size()) + " slices";
  if (series.refusal) return line + "  not usable: " + *series.refusal;
  const glm::dvec3& spacing = series.geometry.spacing;
  return line + "  " + to_string(series.geometry.size) + "  " + number_text(spacing.x) + " x " +
         number_text(spacing.y) + " x " + number_text(spacing.z) + " mm";
}

InputHeader open_input(const InputOptions& options, const Control& control, bool components) {
  if (has_image_suffix(options.path)) {
    if (!options.series.empty() || options.single) {
      throw UsageError("--series and --single are for DICOM, " + options.path.string() + "; leave them out");
    }
    const ImageHeader header = read_image_header(options.path);
    require(components || header.components == 1, std::to_string(header.components) + " components a voxel, " +
                                                      options.path.string() + "; expected a volume with one");
    return {header.geometry, header.type, {}, false, header.components};
  }
  if (is_dicom_dose(options.path)) return {read_dose_header(options.path).geometry, VoxelType::f32, {}, true, 1};
  if (options.single && std::filesystem::is_directory(options.path)) {
    throw UsageError("--single is for one DICOM file, " + options.path.string() + " is a folder; name a file in it");
  }
  const DicomScan scan = scan_dicom(options.path, options.single, control);
  const DicomSeries& series = choose_series(scan, options);
  require(!series.refusal, series.refusal.value_or(""));
  require(!series.uneven || options.uneven,
          series.uneven.value_or("") + "; add what is missing, or give --uneven exact, which takes each slice where it is");
  return {series.geometry, VoxelType::i16, series, false, 1};
}

InputVolume read_input(const InputOptions& options, const InputHeader& header, const CommonOptions& common,
                       const Control& control) {
  InputVolume input;
  if (!header.series) {
    input.volume = header.dose ? read_dose(options.path) : read_image(options.path);
    input.background = smallest_value(input.volume);
    return input;
  }
  input.dicom = load_dicom(*header.series, common.threads, control);
  input.background = input.dicom->padding ? input.dicom->padding->low : kAirHu;
  input.volume = AnyVolume(std::move(input.dicom->volume));
  return input;
}

bool fits(VoxelType type, double value) {
  return dispatch(type, [&](auto voxel) {
    using V = decltype(voxel);
    return value >= static_cast<double>(std::numeric_limits<V>::lowest()) &&
           value <= static_cast<double>(std::numeric_limits<V>::max());
  });
}

std::string hash_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  require(file.good(), "cannot be read, " + path.string());
  Sha256 hash;
  std::vector<char> buffer(std::size_t{1} << 20);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    hash.add(std::as_bytes(std::span(buffer.data(), static_cast<std::size_t>(file.gcount()))));
  }
  require(file.eof(), "cannot be read to its end, " + path.string());
  return hash.hex();
}

}  // namespace tetwarp::apps
