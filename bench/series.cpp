#include "bench/series.h"

#include "deform/errors.h"

namespace tetwarp::bench {

DicomVolume read_series(const std::filesystem::path& folder, int threads) {
  const DicomScan scan = scan_dicom(folder);
  require(scan.series.size() == 1,
          std::to_string(scan.series.size()) + " series in " + folder.string() + "; expected one");
  return load_dicom(scan.series.front(), threads);
}

void write_series(const std::filesystem::path& folder, const DicomVolume& source, const ConstVolumeView& volume,
                  const std::vector<SliceRange>& sampled, int threads) {
  const DicomDerivation derivation{.field_sha256 = std::string(64, '0'),
                                   .parameters =
                                       "interpolation=linear outside=refuse background=-1024.0 "
                                       "direction=forward",
                                   .description = "Deformed by a field of vertices, linear interpolation",
                                   .sampled_slices = sampled};
  write_derived_series(folder, volume, *source.headers, derivation, threads);
}

}  // namespace tetwarp::bench
