// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// DICOM files as a folder is listed, by their headers: "IM1", "IM2" and so on, whose bytes are separated by kNextFile.
// The first also alone, and as what may be a DICOMDIR that names the others.
#include <algorithm>

#include "io/dicom_series.h"
#include "tests/fuzz/input_file.h"

namespace {

constexpr int kMostFiles = 12;

void write_files(const std::filesystem::path& folder, std::string_view bytes) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  for (int n = 1; n <= kMostFiles; ++n) {
    const std::size_t length = bytes.find(kNextFile);
    std::ofstream stream(folder / ("IM" + std::to_string(n)), std::ios::binary);
    stream << bytes.substr(0, length);
    stream.close();
    if (!stream) throw std::runtime_error("cannot write into " + folder.string());
    if (length == std::string_view::npos) return;
    bytes.remove_prefix(length + kNextFile.size());
  }
}

/// Whether it holds a volume.
bool is_taken(const tetwarp::DicomScan& scan) {
  return std::any_of(scan.series.begin(), scan.series.end(), [](const auto& series) { return !series.refusal; });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile place("");
  const std::filesystem::path &folder = place.written(), first = folder / "IM1";
  write_files(folder, {reinterpret_cast<const char*>(data), size});
  if (is_taken(tetwarp::scan_dicom(folder))) ++accepted_reads();
  asked([&] { tetwarp::scan_dicom(first); });
  asked([&] { tetwarp::scan_dicom(first, true); });
  return 0;
}
