#include "io/dicom_series.h"

namespace tetwarp {
namespace {

[[noreturn]] void refuse() {
  throw NotCompiled("DICOM is not in this build of Tetwarp; build it with TETWARP_WITH_DCMTK=ON, or convert to NIfTI");
}

}  // namespace

DicomScan scan_dicom(const std::filesystem::path&, bool, const Control&) { refuse(); }

DicomVolume load_dicom(const DicomSeries&, int, const Control&) { refuse(); }

DicomWriteReport write_derived_series(const std::filesystem::path&, const ConstVolumeView&, const DicomHeaders&,
                                      const DicomDerivation&, int, const Control&) {
  refuse();
}

void write_phantom_series(const std::filesystem::path&, const ConstVolumeView&, std::uint64_t, const Control&) {
  refuse();
}

bool is_tetwarp_dicom(const std::filesystem::path&) { refuse(); }

}  // namespace tetwarp
