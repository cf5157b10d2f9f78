// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_bids.h"
#include "io/dicom_dose.h"
#include "io/dicom_segmentation.h"
#include "io/dicom_series.h"
#include "io/dicom_structures.h"
#include "io/image_file.h"

namespace tetwarp {
namespace {

[[noreturn]] void refuse() {
  throw NotCompiled("DICOM is not in this build of Tetwarp; build it with TETWARP_WITH_DCMTK=ON, or convert to NIfTI");
}

}  // namespace

void set_dicom_dictionary(const std::filesystem::path&) {}

DicomScan scan_dicom(const std::filesystem::path&, bool, const Control&) { refuse(); }

DicomVolume load_dicom(const DicomSeries&, int, const Control&, FileHash) { refuse(); }

std::shared_ptr<const DicomHeaders> copy_headers(const DicomHeaders&) { refuse(); }

std::string hash_files(const DicomSeries&, int, const Control&) { refuse(); }

struct DerivedSeriesWriter::State {};

DerivedSeriesWriter::DerivedSeriesWriter(std::filesystem::path, const Geometry&, const DicomHeaders&, DicomDerivation) {
  refuse();
}
DerivedSeriesWriter::~DerivedSeriesWriter() = default;
void DerivedSeriesWriter::write(const ConstVolumeView&, std::int64_t, std::int64_t, std::span<const SliceRange>, int,
                                const Control&) {
  refuse();
}
DicomWriteReport DerivedSeriesWriter::report() const { refuse(); }
std::unique_ptr<ImageWriter> DerivedSeriesWriter::create_registration(const std::filesystem::path&) const { refuse(); }
void require_registration_fits(const Geometry&) { refuse(); }

DicomWriteReport write_derived_series(const std::filesystem::path&, const ConstVolumeView&, const DicomHeaders&,
                                      const DicomDerivation&, std::span<const SliceRange>, int, const Control&) {
  refuse();
}

void write_phantom_series(const std::filesystem::path&, const ConstVolumeView&, std::uint64_t, const Control&) {
  refuse();
}

std::string bids_sidecar(const DicomHeaders&, const Geometry&, const DicomDerivation&) { refuse(); }

bool is_dicom_dose(const std::filesystem::path&) { return false; }

DicomDose read_dose_header(const std::filesystem::path&) { refuse(); }

AnyVolume read_dose(const std::filesystem::path&) { refuse(); }

bool is_dicom_structure_set(const std::filesystem::path&) { return false; }

StructureSet read_structure_set(const std::filesystem::path&) { refuse(); }

StructureWriteReport write_structure_set(const std::filesystem::path&, const StructureSet&,
                                         const std::vector<std::vector<Contour>>&, const DicomWriteReport&,
                                         const DicomDerivation&) {
  refuse();
}

DoseReport write_derived_dose(const std::filesystem::path&, const ConstVolumeView&, const DicomAlong&,
                              const WrittenSeries&) {
  refuse();
}

bool is_dicom_segmentation(const std::filesystem::path&) { return false; }

DicomSegmentation read_segmentation_header(const std::filesystem::path&, double, const Geometry*) { refuse(); }

std::vector<AnyVolume> read_segments(const std::filesystem::path&, const DicomSegmentation&) { refuse(); }

SegmentationReport write_derived_segmentation(const std::filesystem::path&, const std::vector<ConstVolumeView>&,
                                              const DicomSegmentation&, const DicomAlong&, const WrittenSeries&) {
  refuse();
}

bool is_tetwarp_dicom(const std::filesystem::path&) { refuse(); }

}  // namespace tetwarp
