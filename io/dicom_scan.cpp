#include <algorithm>
#include <climits>
#include <map>
#include <set>
#include <tuple>

#include "io/dicom_assemble.h"
#include "io/dicom_header.h"
#include "io/dicom_series.h"
#include "io/parallel.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// Lists the regular files of a folder tree in a fixed order, each real file and folder once.
class FileList {
 public:
  explicit FileList(const fs::path& root) : root_(fs::canonical(root)) {}

  void add_folder(const fs::path& folder, bool with_sub_folders) {
    if (!seen_.insert(fs::canonical(folder)).second) return;
    std::error_code error;
    std::vector<fs::path> entries;
    for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error))
      entries.push_back(i->path());
    if (error) skipped.push_back(folder.string() + ": cannot be read: " + error.message());
    std::sort(entries.begin(), entries.end());
    for (const fs::path& entry : entries) add_entry(entry, with_sub_folders);
  }

  std::vector<fs::path> files;
  std::vector<std::string> skipped;

 private:
  void add_entry(const fs::path& entry, bool with_sub_folders) {
    std::error_code error;
    const fs::file_status status = fs::status(entry, error);
    if (fs::is_directory(status)) {
      if (!with_sub_folders) return;
      if (leads_outwards(entry))
        skipped.push_back(entry.string() + ": a link to a folder that holds the input, not followed");
      else
        add_folder(entry, true);
    } else if (fs::is_regular_file(status)) {
      const fs::path real = fs::canonical(entry, error);
      if (seen_.insert(error ? entry : real).second) files.push_back(entry);
    } else if (status.type() == fs::file_type::none) {
      skipped.push_back(entry.string() + ": cannot be read: " + error.message());
    } else if (fs::is_symlink(fs::symlink_status(entry, error))) {
      skipped.push_back(entry.string() + ": a link that leads nowhere");
    } else {
      skipped.push_back(entry.string() + ": not a regular file");
    }
  }

  /// Whether a link leads to a folder around the input: a cycle that would draw in what lies beside the input.
  bool leads_outwards(const fs::path& entry) const {
    const fs::path real = fs::canonical(entry);
    const auto [end, ignored] = std::mismatch(real.begin(), real.end(), root_.begin(), root_.end());
    return end == real.end() && real != root_;
  }

  fs::path root_;
  std::set<fs::path> seen_;
};

std::vector<DicomFileHeader> read_headers(const std::vector<fs::path>& files, const Control& control) {
  std::vector<DicomFileHeader> headers(files.size());
  for_each_index(files.size(), 0, control, [&](std::size_t i) { headers[i] = read_dicom_header(files[i]); });
  return headers;
}

/// Files of one series. Where the Series Instance UID was wiped, study, series number and folder stand in for it.
using SeriesKey = std::tuple<std::string, std::string, std::optional<int>, fs::path>;

SeriesKey key_of(const DicomFileHeader& header) {
  if (!header.series_uid.empty()) return {header.series_uid, "", std::nullopt, ""};
  return {"", header.study_uid, header.series_number, header.file.parent_path()};
}

/// Names a file that nobody can know: it bears the suffix of the slices beside it, and may be one of them.
std::string lost_slice(const std::vector<DicomFileHeader>& broken, const std::set<fs::path>& suffixes) {
  for (const DicomFileHeader& header : broken) {
    const fs::path name = header.file.filename();
    if (name.string().front() == '.' || !suffixes.contains(name.extension())) continue;
    return header.skip + ", " + header.file.string() + "; it may be a slice of this series: mend it, or take it away";
  }
  return {};
}

struct NumberedSeries {
  int number;
  DicomSeries series;
};

DicomScan group(std::vector<DicomFileHeader> headers, const std::optional<fs::path>& wanted) {
  DicomScan scan;
  std::map<SeriesKey, std::vector<DicomFileHeader>> groups;
  std::optional<SeriesKey> wanted_key;
  std::vector<DicomFileHeader> broken;
  std::set<fs::path> suffixes;
  for (DicomFileHeader& header : headers) {
    const bool is_wanted = wanted && header.file == *wanted;
    if (header.broken) broken.push_back(header);
    if (header.skip.empty()) suffixes.insert(header.file.extension());
    if (!header.skip.empty()) {
      if (!wanted || is_wanted) scan.skipped.push_back(header.file.string() + ": " + header.skip);
      continue;
    }
    const SeriesKey key = key_of(header);
    if (is_wanted) wanted_key = key;
    groups[key].push_back(std::move(header));
  }
  std::vector<NumberedSeries> numbered;
  for (auto& [key, files] : groups) {
    if (wanted && key != wanted_key) continue;
    const int number = files.front().series_number.value_or(INT_MAX);
    numbered.push_back({number, assemble_series(std::move(files))});
  }
  std::stable_sort(numbered.begin(), numbered.end(), [](const NumberedSeries& a, const NumberedSeries& b) {
    return std::tie(a.number, a.series.series_uid) < std::tie(b.number, b.series.series_uid);
  });
  const std::string lost = lost_slice(broken, suffixes);
  for (NumberedSeries& one : numbered) {
    if (!lost.empty() && !one.series.slices.empty() && !one.series.refusal) one.series.refusal = lost;
    scan.series.push_back(std::move(one.series));
  }
  return scan;
}

}  // namespace

DicomScan scan_dicom(const fs::path& path, bool single, const Control& control) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  require(fs::exists(status), "no such file or folder, " + path.string() + "; check the path");
  if (fs::is_directory(status)) {
    fs::directory_iterator readable(path, error);
    require(!error, "the folder cannot be read, " + path.string() + ": " + error.message() + "; check its permissions");
    FileList list(path);
    list.add_folder(path, true);
    DicomScan scan = group(read_headers(list.files, control), std::nullopt);
    scan.skipped.insert(scan.skipped.end(), list.skipped.begin(), list.skipped.end());
    return scan;
  }
  require(fs::is_regular_file(status), "neither a file nor a folder, " + path.string() + "; name one of them");
  if (single) return group(read_headers({path}, control), path);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  FileList list(folder);
  list.add_folder(folder, false);
  std::vector<fs::path> files{path};
  for (const fs::path& file : list.files) {
    if (!fs::equivalent(file, path, error)) files.push_back(file);
  }
  return group(read_headers(files, control), path);
}

}  // namespace tetwarp
