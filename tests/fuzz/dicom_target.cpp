// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// One DICOM file: as a dose, a segmentation, a structure set, as a series of one slice, and the series derived from it,
// with the patient and without.
#include "io/dicom_dose.h"
#include "io/dicom_segmentation.h"
#include "io/dicom_series.h"
#include "io/dicom_structures.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

namespace {

void derive(const tetwarp::DicomVolume& ct, bool deidentify) {
  static const InputFile folder(".derived");
  std::filesystem::remove_all(folder.written());
  std::filesystem::create_directories(folder.written());
  tetwarp::DicomDerivation derivation;
  derivation.field_sha256 = std::string(64, '0');
  derivation.parameters = "identity";
  derivation.description = "Deformed by nothing";
  if (deidentify)
    derivation.form.deidentification = {.key = std::vector<std::byte>(16),
                                        .options = {tetwarp::ConfidentialityOption::shift_dates}};
  accepted([&] { tetwarp::write_derived_series(folder.written(), view(ct.volume), *ct.headers, derivation, {}, 1); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  if (tetwarp::is_dicom_dose(file.path())) accepted([] { tetwarp::read_dose(file.path()); });
  if (tetwarp::is_dicom_segmentation(file.path()))
    accepted([] { tetwarp::read_segments(file.path(), tetwarp::read_segmentation_header(file.path())); });
  if (tetwarp::is_dicom_structure_set(file.path())) accepted([] { tetwarp::read_structure_set(file.path()); });
  for (const auto& series : tetwarp::scan_dicom(file.path(), true).series) {
    accepted([&] {
      const tetwarp::DicomVolume ct = tetwarp::load_dicom(series, 1);
      for (const bool deidentify : {false, true}) derive(ct, deidentify);
    });
  }
  tetwarp::is_tetwarp_dicom(file.path());
  return 0;
}
