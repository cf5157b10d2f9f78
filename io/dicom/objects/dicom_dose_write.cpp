// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_derive.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_dose.h"
#include "io/dicom_text.h"

namespace tetwarp {

namespace {

/// The largest stored value: readers that take the words as signed read the same, and float32 holds less.
constexpr double kLargestWord = 2147483647;

/// Dose Grid Scaling, as text and as it reads back.
struct Scaling {
  std::string text;
  double value;
};

Scaling scaling_for(std::span<const float> doses, DcmDataset& source) {
  float largest = 0;
  for (const float dose : doses) largest = std::max(largest, std::abs(dose));
  std::string text = largest > 0 ? decimal_string(largest / kLargestWord) : text_of(source, DCM_DoseGridScaling);
  const double value = decimal(text).value_or(1);
  return {std::move(text), value};
}

std::vector<std::int32_t> stored_words(std::span<const float> doses, double scaling, bool is_signed) {
  const double smallest = is_signed ? -kLargestWord : 0;
  std::vector<std::int32_t> words(doses.size());
  std::transform(doses.begin(), doses.end(), words.begin(), [&](float dose) {
    return static_cast<std::int32_t>(std::clamp(std::nearbyint(dose / scaling), smallest, kLargestWord));
  });
  return words;
}

/// Frames of a grid, from the first along the normal (PS3.3 C.8.8.3.2).
void put_frames(DcmItem& target, const Geometry& grid) {
  const bool against = glm::dot(glm::cross(grid.direction[0], grid.direction[1]), grid.direction[2]) < 0;
  std::vector<double> offsets;
  for (std::int64_t k = 0; k < grid.size.z; ++k)
    offsets.push_back((against ? -1 : 1) * static_cast<double>(k) * grid.spacing.z);
  put(target, DCM_NumberOfFrames, std::to_string(grid.size.z));
  put_decimals(target, DCM_GridFrameOffsetVector, offsets, 0);
  const DcmTagKey pointed = DCM_GridFrameOffsetVector;
  if (target.putAndInsertTagKey(DCM_FrameIncrementPointer, pointed).bad())
    throw Error("cannot set attribute " + tag_name(DCM_FrameIncrementPointer));
}

/// Puts the attributes of the RT Dose module (PS3.3 C.8.8.3) that stay true, and the transform. Plans and records say
/// how the dose came to be and are kept; structure sets, histograms and the place of normalization are those of the old
/// anatomy.
void put_dose(DcmItem& target, DcmDataset& source, bool deformed) {
  for (const DcmTagKey& tag : {DCM_DoseUnits, DCM_DoseType, DCM_DoseSummationType, DCM_TissueHeterogeneityCorrection,
                               DCM_ReferencedRTPlanSequence, DCM_ReferencedTreatmentRecordSequence, DCM_DoseComment,
                               DCM_SpatialTransformOfDose, DCM_ReferencedSpatialRegistrationSequence})
    carry_attribute(target, source, tag);
  if (!deformed) return;
  put(target, DCM_SpatialTransformOfDose, "NON_RIGID");
  drop(target, DCM_ReferencedSpatialRegistrationSequence);
  put_empty_sequence(target, DCM_ReferencedSpatialRegistrationSequence);  // type 2C: there is no such object
  put(target, DCM_DoseComment, "Deformed with its CT: doses interpolated, energy not kept");
}

void put_references(DcmItem& target, DcmDataset& source, const WrittenSeries& series, bool deformed) {
  for (std::size_t k = 0; k < series.report.sop_instance_uids.size(); ++k)
    append_slice_reference(target, DCM_ReferencedImageSequence, series, k);
  const std::string instance = text_of(source, DCM_SOPInstanceUID);
  if (!is_uid(instance)) return;
  DcmItem& image = append_item(target, DCM_SourceImageSequence);
  put(image, DCM_ReferencedSOPClassUID, UID_RTDoseStorage);
  put(image, DCM_ReferencedSOPInstanceUID, instance);
  append_code(image, DCM_PurposeOfReferenceCodeSequence, "121322", "Source image for image processing operation");
  put(image, DCM_SpatialLocationsPreserved, deformed ? "NO" : "YES");
}

const std::vector<DcmTagKey>& type_2_of_dose() {
  static const std::vector<DcmTagKey> tags = {DCM_StudyDate,
                                              DCM_StudyTime,
                                              DCM_AccessionNumber,
                                              DCM_Manufacturer,
                                              DCM_OperatorsName,
                                              DCM_ReferringPhysicianName,
                                              DCM_PatientName,
                                              DCM_PatientID,
                                              DCM_PatientBirthDate,
                                              DCM_PatientSex,
                                              DCM_SliceThickness,
                                              DCM_StudyID,
                                              DCM_PositionReferenceIndicator};
  return tags;
}

}  // namespace

DoseReport write_derived_dose(const std::filesystem::path& path, const ConstVolumeView& doses, const DicomAlong& along,
                              const WrittenSeries& series) {
  require(doses.voxels && doses.type == VoxelType::f32 && doses.components == 1 &&
              doses.buffered == whole(*doses.geometry) && !is_sheared(*doses.geometry),
          "a DICOM dose needs a whole straight volume of float32; convert it");
  prepare_dcmtk();
  const Geometry& grid = *doses.geometry;
  DcmFileFormat format;
  DcmDataset& source = read_source(format, along);
  const bool is_signed = text_of(source, DCM_PixelRepresentation) == "1";
  DcmDataset target;
  put_along(target, source, along, series, type_2_of_dose());
  put(target, DCM_SOPClassUID, UID_RTDoseStorage);
  put(target, DCM_Modality, "RTDOSE");
  put(target, DCM_ImageType, "DERIVED\\SECONDARY");
  put_references(target, source, series, along.derivation.deformed);
  put_dose(target, source, along.derivation.deformed);
  put_image_plane(target, grid, 0);
  if (!text_of(source, DCM_SliceThickness).empty())
    put_decimals(target, DCM_SliceThickness, std::vector{grid.spacing.z}, 1e-7);
  put_frames(target, grid);
  put_pixel_format(target, grid, 32, is_signed);
  const std::span<const float> values(reinterpret_cast<const float*>(doses.voxels),
                                      static_cast<std::size_t>(voxel_count(grid)));
  const Scaling scaling = scaling_for(values, source);
  put(target, DCM_DoseGridScaling, scaling.text);
  const std::vector<std::int32_t> words = stored_words(values, scaling.value, is_signed);
  const std::string instance = write_dicom_file(path, target, std::as_bytes(std::span(words)), DicomWords::of_16_bits);
  return {{text_of(target, DCM_SeriesInstanceUID), instance}, scaling.value, text_of(target, DCM_DoseUnits)};
}

}  // namespace tetwarp
