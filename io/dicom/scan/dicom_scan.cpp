// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <climits>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <tuple>

#include "io/dicom/scan/dicom_assemble.h"
#include "io/dicom/scan/dicom_directory.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"
#include "io/files/folder_files.h"
#include "io/opened_file.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using Headers = std::vector<DicomFileHeader>;

void append(Headers& headers, Headers more) {
  headers.insert(headers.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

Headers read_headers(std::vector<fs::path> files, const Control& control) {
  Headers headers(files.size());
  std::map<std::size_t, Headers> further;  // by file: the headers of its further frames
  std::mutex mutex;
  for_each_index(files.size(), 0, control, [&](std::size_t i) {
    Headers read = read_dicom_headers(files[i]);
    fs::path().swap(files[i]);  // freed here: a path takes 400 bytes, and there may be 100 000
    headers[i] = std::move(read.front());
    if (read.size() == 1) return;
    read.erase(read.begin());
    const std::lock_guard lock(mutex);
    further[i] = std::move(read);
  });
  for (auto& [file, frames] : further) append(headers, std::move(frames));
  return headers;
}

/// How many files the headers are of; the frames of a file count once.
std::size_t files_of(const Headers& headers) {
  const auto is_file = [](const DicomFileHeader& header) { return header.frame.value_or(0) == 0; };
  return static_cast<std::size_t>(std::count_if(headers.begin(), headers.end(), is_file));
}

/// What files of one series have in common: Series Instance UID, or, where it was wiped, study, series number and
/// folder.
using SeriesKey = std::tuple<std::string, std::string, std::optional<int>, fs::path>;

SeriesKey key_of(const DicomFileHeader& header) {
  if (!header.series_uid.empty()) return {header.series_uid, "", std::nullopt, ""};
  return {"", header.study_uid, header.series_number, header.file.parent_path()};
}

/// A refusal that names a broken file that may be a slice of the series: it lies beside the series' files and bears
/// their suffix. Empty: there is none.
std::string lost_slice(const std::vector<DicomFileHeader>& broken, const DicomSeries& series) {
  if (broken.empty()) return {};
  std::set<std::pair<fs::path, fs::path>> places;  // folder and suffix of the slices
  for (const DicomSlice& slice : series.slices) places.emplace(slice.file.parent_path(), slice.file.extension());
  for (const DicomFileHeader& header : broken) {
    const fs::path& file = header.file;
    if (file.filename().native().front() == '.' || !places.contains({file.parent_path(), file.extension()})) continue;
    return header.skip + ", " + shown(file) + "; it may be a slice of this series: mend it, or take it away";
  }
  return {};
}

/// Which headers belong to which series, and which to none.
struct Grouping {
  std::map<SeriesKey, std::vector<std::size_t>> series;
  std::vector<LeftOutFile> skipped;
  Headers broken;
};

Grouping group(const Headers& headers) {
  Grouping groups;
  for (std::size_t n = 0; n < headers.size(); ++n) {
    const DicomFileHeader& header = headers[n];
    if (header.skip.empty()) {
      groups.series[key_of(header)].push_back(n);
    } else {
      groups.skipped.push_back({header.file, header.skip});
      if (header.broken) groups.broken.push_back(header);
    }
  }
  return groups;
}

/// Makes the volumes of a series. Its headers are moved out of `headers`, so that they are never in memory twice.
std::vector<DicomSeries> assemble(Headers& headers, const std::vector<std::size_t>& members, const Headers& broken,
                                  const Control& control) {
  Headers files;
  files.reserve(members.size());
  for (const std::size_t n : members) files.push_back(std::move(headers[n]));
  std::vector<DicomSeries> volumes = assemble_series(std::move(files), control.stop);
  for (DicomSeries& volume : volumes) {
    const std::string lost = lost_slice(broken, volume);
    if (!lost.empty() && !volume.refusal) volume.refusal = lost;
  }
  return volumes;
}

DicomScan scan_of(Headers headers, const Control& control) {
  Grouping groups = group(headers);
  DicomScan scan;
  scan.files = files_of(headers);
  scan.skipped = std::move(groups.skipped);
  std::vector<std::vector<DicomSeries>> all;
  for (const auto& [key, members] : groups.series) all.push_back(assemble(headers, members, groups.broken, control));
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    const int of_a = a.front().series_number.value_or(INT_MAX), of_b = b.front().series_number.value_or(INT_MAX);
    return std::tie(of_a, a.front().series_uid) < std::tie(of_b, b.front().series_uid);
  });
  for (std::vector<DicomSeries>& volumes : all)
    std::move(volumes.begin(), volumes.end(), std::back_inserter(scan.series));
  return scan;
}

/// The series of the first header; all others are left out.
DicomScan scan_of_first(Headers headers, const Control& control) {
  Grouping groups = group(headers);
  DicomScan scan;
  scan.files = files_of(headers);
  if (headers.front().skip.empty())
    scan.series = assemble(headers, groups.series[key_of(headers.front())], groups.broken, control);
  else
    scan.skipped.push_back({headers.front().file, headers.front().skip});
  return scan;
}

DicomScan scan_folder(const fs::path& folder, const Control& control) {
  std::error_code error;
  fs::directory_iterator readable(folder, error);
  require(!error, "the folder cannot be read, " + shown(folder) + ": " + error.message() + "; check its permissions");
  FolderFiles list = list_files(folder, true, control.stop);
  DicomScan scan = scan_of(read_headers(std::move(list.files), control), control);
  scan.skipped.insert(scan.skipped.end(), list.left_out.begin(), list.left_out.end());
  return scan;
}

bool is_directory_file(const DicomFileHeader& header) {
  return header.sop_class_uid == UID_MediaStorageDirectoryStorage;
}

/// Scans the files that a DICOMDIR names. Where one of these is a DICOMDIR, the files that it names are scanned in its
/// place.
DicomScan scan_directory(const fs::path& dicomdir, const Control& control) {
  Headers headers;
  std::set<fs::path> seen{dicomdir}, missing;
  std::vector<LeftOutFile> refused;
  for (std::vector<fs::path> directories{dicomdir}; !directories.empty();) {
    std::vector<fs::path> files;
    for (const fs::path& directory : directories) {
      DirectoryFiles found = read_directory(directory);
      std::copy_if(found.files.begin(), found.files.end(), std::back_inserter(files),
                   [&](const fs::path& file) { return seen.insert(file).second; });
      missing.insert(found.missing.begin(), found.missing.end());
      std::move(found.refused.begin(), found.refused.end(), std::back_inserter(refused));
    }
    Headers found = read_headers(std::move(files), control);
    directories.clear();
    for (const DicomFileHeader& header : found) {
      if (is_directory_file(header)) directories.push_back(header.file);
    }
    std::erase_if(found, is_directory_file);
    append(headers, std::move(found));
  }
  for (const fs::path& file : missing) {
    DicomFileHeader header;
    header.file = file;
    header.skip = "missing, although a DICOMDIR names it";
    header.broken = true;
    headers.push_back(std::move(header));
  }
  DicomScan scan = scan_of(std::move(headers), control);
  scan.skipped.insert(scan.skipped.end(), refused.begin(), refused.end());
  return scan;
}

/// The series of one file: it is looked for among the files beside it.
DicomScan scan_beside(Headers headers, const Control& control) {
  const fs::path path = headers.front().file, folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  const fs::path real = fs::canonical(path, error), real_folder = fs::canonical(folder, error);
  FolderFiles list = list_files(folder, false, control.stop);
  std::erase_if(list.files, [&](const fs::path& file) {
    const fs::path name = file.filename();
    return name == path.filename() || (real.parent_path() == real_folder && name == real.filename());
  });
  append(headers, read_headers(std::move(list.files), control));
  return scan_of_first(std::move(headers), control);
}

}  // namespace

DicomScan scan_dicom(const fs::path& path, bool single, const Control& control) {
  const PathKind kind = kind_at(path);
  require(kind != PathKind::nothing, "no such file or folder, " + shown(path) + "; check the path");
  if (kind == PathKind::folder) return scan_folder(path, control);
  Headers headers = read_dicom_headers(path);
  if (!single && is_directory_file(headers.front())) return scan_directory(path, control);
  return single ? scan_of_first(std::move(headers), control) : scan_beside(std::move(headers), control);
}

}  // namespace tetwarp
