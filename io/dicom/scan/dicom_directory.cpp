// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_directory.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// A Referenced File ID (0004,1500) as a relative path; none if a part is no plain name: "..", "/etc", control
/// characters.
std::optional<fs::path> relative_path(const std::string& file_id) {
  fs::path path;
  for (std::size_t begin = 0; begin <= file_id.size();) {
    const std::size_t end = std::min(file_id.find('\\', begin), file_id.size());
    std::string part = file_id.substr(begin, end - begin);
    part.erase(part.find_last_not_of(' ') + 1);
    const bool plain = std::none_of(part.begin(), part.end(), [](unsigned char c) { return c < ' ' || c == '/'; });
    if (!plain || part.empty() || part == "." || part == "..") return std::nullopt;
    path /= part;
    begin = end + 1;
  }
  return path;
}

/// Removes from `path` the first parts that are also the last folders of `folder`: "S1/S20/I10" becomes "I10" in
/// ".../S1/S20".
fs::path below(const fs::path& folder, const fs::path& path) {
  const std::vector<fs::path> above(folder.begin(), folder.end()), parts(path.begin(), path.end());
  auto count = std::min(std::ssize(above), std::ssize(parts) - 1);
  while (count > 0 && !std::equal(parts.begin(), parts.begin() + count, above.end() - count)) --count;
  fs::path rest;
  for (auto part = parts.begin() + count; part != parts.end(); ++part) rest /= *part;
  return rest;
}

/// The file that a relative path names below a folder; none if there is none.
std::optional<fs::path> find(const fs::path& folder, const fs::path& real_folder, const fs::path& name) {
  const fs::path shorter = below(real_folder, name);
  for (const fs::path& one : {name, shorter, fs::path(lower(name)), fs::path(lower(shorter))}) {
    std::error_code error;
    if (fs::is_regular_file(folder / one, error)) return folder / one;
  }
  return std::nullopt;
}

}  // namespace

DirectoryFiles read_directory(const fs::path& dicomdir) {
  prepare_dcmtk();
  DcmFileFormat format;
  const OFCondition read = parse_dicom(format, dicomdir, DCM_UndefinedTagKey).result;
  require(read.good(),
          "damaged DICOMDIR, " + shown(dicomdir) + ": " + read.text() + "; give its folder to read what is there");
  DirectoryFiles found;
  DcmSequenceOfItems* records = nullptr;
  if (format.getDataset()->findAndGetSequence(DCM_DirectoryRecordSequence, records).bad()) return found;
  const fs::path folder = dicomdir.has_parent_path() ? dicomdir.parent_path() : fs::path(".");
  std::error_code error;
  const fs::path real_folder = fs::canonical(folder, error);
  require(!error, "the folder cannot be read, " + shown(folder) + ": " + error.message() + "; check its permissions");
  std::set<fs::path> files, missing;
  for (DcmObject* record = records->nextInContainer(nullptr); record; record = records->nextInContainer(record)) {
    auto* item = dynamic_cast<DcmItem*>(record);
    Uint16 in_use = 0xffff;
    if (!item) continue;
    const std::string file_id = text_of(*item, DCM_ReferencedFileID);
    if (file_id.empty() || (item->findAndGetUint16(DCM_RecordInUseFlag, in_use).good() && in_use == 0)) continue;
    const std::optional<fs::path> name = relative_path(file_id);
    if (!name)
      found.refused.push_back(
          {dicomdir, "Referenced File ID \"" + shown(file_id) + "\" is no name of a file, not read"});
    else if (const auto file = find(folder, real_folder, *name))
      files.insert(*file);
    else
      missing.insert(folder / below(real_folder, *name));
  }
  found.files.assign(files.begin(), files.end());
  found.missing.assign(missing.begin(), missing.end());
  return found;
}

}  // namespace tetwarp
