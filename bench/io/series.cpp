// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/io/series.h"

#include "deform/errors.h"

namespace tetwarp::bench {

DicomVolume read_series(const std::filesystem::path& folder, int threads, FileHash hash) {
  const DicomScan scan = scan_dicom(folder);
  require(scan.series.size() == 1,
          std::to_string(scan.series.size()) + " series in " + folder.string() + "; expected one");
  return load_dicom(scan.series.front(), threads, {}, hash);
}

DicomDerivation made_up_derivation() {
  return {.field_sha256 = std::string(64, '0'),
          .parameters = "interpolation=linear outside=refuse background=-1024.0 direction=forward",
          .description = "Deformed by a field of vertices, linear interpolation"};
}

void write_series(const std::filesystem::path& folder, const DicomVolume& source, const ConstVolumeView& volume,
                  const std::vector<SliceRange>& sampled, int threads) {
  write_derived_series(folder, volume, *source.headers, made_up_derivation(), sampled, threads);
}

}  // namespace tetwarp::bench
