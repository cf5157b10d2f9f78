// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/apps/deform/good_inputs.h"

namespace tetwarp::test {

namespace {

// What dcm2niix 1.0.20220720 of Debian does (docs/reference/dicom-cases.md, "Difficult cases"):
constexpr const char* kNone = "dcm2niix made 0 volumes";  ///< deflated, JPEG-LS, JPEG of 12 bits: not supported
constexpr const char* kTwo = "dcm2niix made 2 volumes";   ///< tilt, uneven: the slices as they come, and resampled
constexpr const char* kOther = "voxels differ";           ///< JPEG of 8 bits: other values than other decoders

}  // namespace

std::vector<GoodInput> good_series() {
  return {
      {.name = "Abdomen", .at = "abdomen-acrin-flt", .thinned = true},
      {.name = "AbdomenJpeg2000", .at = "abdomen-j2k-20"},
      {.name = "Chest", .at = "chest-cmb-crc"},
      {.name = "HeadThick", .at = "head-phantom-multiseries", .number = 2, .thinned = true},
      {.name = "HeadThin", .at = "head-phantom-multiseries", .number = 3, .thinned = true},
      {.name = "Enhanced", .at = "odd-files", .number = 20},
      {.name = "Overlapping", .at = "overlap-kits-and-topogram"},
      {.name = "Sagittal", .at = "sagittal-with-scout"},
      {.name = "SliceMissing", .at = "slice-errors", .dcm2niix = kTwo},
      {.name = "TiltEven", .at = "tilt-uniform-philips", .dcm2niix = kTwo, .thinned = true},
      {.name = "TiltUneven", .at = "tilt-variable-spacing-ge", .dcm2niix = kTwo, .thinned = true},
  };
}

std::vector<GoodInput> good_slices() {
  return {
      {.name = "Plain", .at = "ct-transfer-syntaxes/CTImage.dcm"},
      {.name = "BigEndianExplicit",
       .at = "ct-transfer-syntaxes/CTImage.dcm_BigEndianExplicitTransferSyntax_1.2.840.10008.1.2.2.dcm",
       .alike = true},
      {.name = "DeflatedExplicitVRLittleEndian",
       .at = "ct-transfer-syntaxes/CTImage.dcm_DeflatedExplicitVRLittleEndianTransferSyntax_1.2.840.10008.1.2.1.99.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "JPEG2000LosslessOnly",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEG2000LosslessOnlyTransferSyntax_1.2.840.10008.1.2.4.90.dcm",
       .alike = true},
      {.name = "JPEG2000",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEG2000TransferSyntax_1.2.840.10008.1.2.4.91.dcm",
       .alike = true},
      {.name = "JPEGLSLossless",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGLSLosslessTransferSyntax_1.2.840.10008.1.2.4.80.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "JPEGLSLossy",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGLSLossyTransferSyntax_1.2.840.10008.1.2.4.81.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "JPEGProcess10And12",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess10_12TransferSyntax_1.2.840.10008.1.2.4.55.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "JPEGProcess14SV1",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess14SV1TransferSyntax_1.2.840.10008.1.2.4.70.dcm",
       .alike = true},
      {.name = "JPEGProcess14",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess14TransferSyntax_1.2.840.10008.1.2.4.57.dcm",
       .alike = true},
      {.name = "JPEGProcess1",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess1TransferSyntax_1.2.840.10008.1.2.4.50.dcm",
       .dcm2niix = kOther},
      {.name = "JPEGProcess2And4",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess2_4TransferSyntax_1.2.840.10008.1.2.4.51.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "JPEGProcess6And8",
       .at = "ct-transfer-syntaxes/CTImage.dcm_JPEGProcess6_8TransferSyntax_1.2.840.10008.1.2.4.53.dcm",
       .dcm2niix = kNone,
       .alike = true},
      {.name = "LittleEndianExplicit",
       .at = "ct-transfer-syntaxes/CTImage.dcm_LittleEndianExplicitTransferSyntax_1.2.840.10008.1.2.1.dcm",
       .alike = true},
      {.name = "LittleEndianImplicit",
       .at = "ct-transfer-syntaxes/CTImage.dcm_LittleEndianImplicitTransferSyntax_1.2.840.10008.1.2.dcm",
       .alike = true},
      {.name = "RLELossless",
       .at = "ct-transfer-syntaxes/CTImage.dcm_RLELosslessTransferSyntax_1.2.840.10008.1.2.5.dcm",
       .alike = true},
      {.name = "BigEndianUndefinedLength",
       .at = "odd-files/compressed/GH177_D_CLUNIE_CT1_IVRLE_BigEndian_ELE_undefinded_length.dcm"},
      {.name = "BrokenPrivateSequence", .at = "odd-files/compressed/bad_sequence.dcm"},
      {.name = "NeitherPreambleNorMetaHeader", .at = "odd-files/headers/dicom-sc_cs-1.dcm"},
      {.name = "Small", .at = "odd-files/headers/CT_small.dcm"},
      {.name = "RoundedOrientation", .at = "odd-files/orientation/OrthogonalDirectionsTest.dcm"},
      {.name = "UnknownVr", .at = "odd-files/orientation/explicit_VR-UN.dcm"},
      {.name = "SamePosition1", .at = "slice-errors/same-position/001.dcm"},
      {.name = "SamePosition2", .at = "slice-errors/same-position/002.dcm", .alike = true},
      {.name = "SamePosition3", .at = "slice-errors/same-position/003.dcm", .alike = true},
      {.name = "SamePosition4", .at = "slice-errors/same-position/004.dcm", .alike = true},
      {.name = "RadiotherapyPlanning", .at = "rt-breast/ct.0.dcm"},
      {.name = "Scout", .at = "sagittal-with-scout/1-001.dcm"},
  };
}

std::vector<GoodInput> good_files() {
  return {
      {.name = "LungExhaled", .at = "lung-4dct-t0-t5/t5.mha"},
      {.name = "LungInhaled", .at = "lung-4dct-t0-t5/t0.mha"},
      {.name = "AbdomenInt32", .at = "nifti-abdomen-3mm/example_ct.nii.gz"},
      {.name = "AbdomenInt16", .at = "nifti-abdomen-3mm/example_ct_sm.nii.gz"},
  };
}

std::filesystem::path test_data() {
  const char* folder = std::getenv("TETWARP_TEST_DATA");
  return folder ? std::filesystem::path(folder) : std::filesystem::path();
}

}  // namespace tetwarp::test
