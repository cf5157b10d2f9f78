// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>

#include "deform/version.h"
#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_derive.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_structures_header.h"
#include "io/dicom/privacy/dicom_deidentify.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

constexpr double kPlaces = 1e4;                            // a coordinate is written to 1 / kPlaces mm
constexpr char kStudyClass[] = "1.2.840.10008.3.1.2.3.1";  // Detached Study Management (retired): what names a study

void append_instance(DcmItem& target, const DcmTagKey& sequence, const char* sop_class, const std::string& instance) {
  DcmItem& item = append_item(target, sequence);
  put(item, DCM_ReferencedSOPClassUID, sop_class);
  put(item, DCM_ReferencedSOPInstanceUID, instance);
}

/// Referenced Frame of Reference Sequence (PS3.3 C.8.8.5): the derived series, all of its slices.
void put_frame_of_reference(DcmItem& target, const DicomWriteReport& series) {
  DcmItem& frame = append_item(target, DCM_ReferencedFrameOfReferenceSequence);
  put(frame, DCM_FrameOfReferenceUID, series.frame_of_reference_uid);
  append_instance(frame, DCM_RTReferencedStudySequence, kStudyClass, series.study_uid);
  DcmItem* study = nullptr;
  frame.findAndGetSequenceItem(DCM_RTReferencedStudySequence, study);
  DcmItem& images = append_item(*study, DCM_RTReferencedSeriesSequence);
  put(images, DCM_SeriesInstanceUID, series.series_uid);
  for (const std::string& instance : series.sop_instance_uids)
    append_instance(images, DCM_ContourImageSequence, UID_CTImageStorage, instance);
}

/// What was drawn by hand is no longer only that.
std::string algorithm_of(DcmItem& roi) {
  const std::string algorithm = text_of(roi, DCM_ROIGenerationAlgorithm);
  return algorithm == "MANUAL" ? "SEMIAUTOMATIC" : algorithm;
}

void append_roi(DcmItem& target, DcmItem& source, const std::string& frame_of_reference) {
  static const std::vector<DcmTagKey> kKept = {DCM_ROINumber, DCM_ROIName, DCM_ROIDescription,
                                               DCM_ROIGenerationDescription};
  DcmItem& roi = append_item(target, DCM_StructureSetROISequence);
  copy_over(roi, source, kKept);
  put(roi, DCM_ReferencedFrameOfReferenceUID, frame_of_reference);
  put(roi, DCM_ROIGenerationAlgorithm, algorithm_of(source));
}

std::string data_of(const std::vector<glm::dvec3>& points) {
  std::string text;
  for (const glm::dvec3& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!text.empty()) text += '\\';
      text += decimal_string(std::round(point[axis] * kPlaces) / kPlaces);
    }
  }
  return text;
}

void append_contour(DcmItem& target, const Contour& contour, const DicomWriteReport& series) {
  DcmItem& item = append_item(target, DCM_ContourSequence);
  if (contour.slice) {
    append_instance(item, DCM_ContourImageSequence, UID_CTImageStorage,
                    series.sop_instance_uids.at(static_cast<std::size_t>(*contour.slice)));
  }
  const auto kind = std::find_if(kContourKinds.begin(), kContourKinds.end(),
                                 [&](const auto& entry) { return entry.first == contour.kind; });
  put(item, DCM_ContourGeometricType, kind->second);
  put(item, DCM_NumberOfContourPoints, std::to_string(contour.points.size()));
  put(item, DCM_ContourData, data_of(contour.points));
}

void append_contours(DcmItem& target, DcmItem* source, int number, const std::vector<Contour>& contours,
                     const DicomWriteReport& series) {
  static const std::vector<DcmTagKey> kKept = {DCM_ROIDisplayColor, DCM_RecommendedDisplayGrayscaleValue,
                                               DCM_RecommendedDisplayCIELabValue};
  if (!source && contours.empty()) return;
  DcmItem& roi = append_item(target, DCM_ROIContourSequence);
  if (source) copy_over(roi, *source, kKept);
  put(roi, DCM_ReferencedROINumber, std::to_string(number));
  for (const Contour& contour : contours) append_contour(roi, contour, series);
}

void append_observation(DcmItem& target, DcmItem& source) {
  std::vector<DcmTagKey> tags;
  for (unsigned long n = 0; n < source.card(); ++n) {
    const DcmTagKey tag = source.getElement(n)->getTag().getXTag();
    if (tag.getGroup() % 2 == 0 && tag.getElement() != 0) tags.push_back(tag);
  }
  copy_over(append_item(target, DCM_RTROIObservationsSequence), source, tags);
}

/// Structure Set (PS3.3 C.8.8.5) but for its sequences, and Approval (C.8.8.16): nobody approved what was moved.
void put_structure_set(DcmItem& target, DcmItem& source) {
  static const std::vector<DcmTagKey> kKept = {DCM_StructureSetLabel, DCM_StructureSetName, DCM_StructureSetDescription,
                                               DCM_StructureSetDate, DCM_StructureSetTime};
  copy_over(target, source, kKept);
  if (text_of(target, DCM_StructureSetLabel).empty()) put(target, DCM_StructureSetLabel, "deformed");
  put(target, DCM_ApprovalStatus, "UNAPPROVED");
  const std::string instance = text_of(source, DCM_SOPInstanceUID);
  if (!instance.empty())
    append_instance(target, DCM_PredecessorStructureSetSequence, UID_RTStructureSetStorage, instance);
}

std::string series_uid(DcmDataset& source, const DicomWriteReport& series, const DicomDerivation& derivation) {
  Sha256 hash;
  DcmDataset copy(source);  // encoding takes group lengths away
  hash.add("tetwarp derived structure set").add(encoded(copy)).add(series.series_uid);
  for (const std::string& instance : series.sop_instance_uids) hash.add(instance);
  hash.add(derivation.field_sha256).add(derivation.parameters).add(version()).add(commit());
  return uid_from_digest(hash.digest());
}

std::vector<std::unique_ptr<DcmItem>> copies(const std::vector<std::unique_ptr<DcmItem>>& items) {
  std::vector<std::unique_ptr<DcmItem>> copied;
  for (const auto& item : items) copied.push_back(item ? std::make_unique<DcmItem>(*item) : nullptr);
  return copied;
}

/// A copy, de-identified if that is asked for.
StructureSetHeader deidentified(const StructureSetHeader& header, const std::optional<Deidentification>& how) {
  StructureSetHeader copy{std::make_unique<DcmDataset>(*header.data), copies(header.roi), copies(header.contour),
                          copies(header.observations)};
  if (!how) return copy;
  const Deidentifier deidentifier(*how, text_of(*copy.data, DCM_PatientID), text_of(*copy.data, DCM_StudyInstanceUID));
  deidentifier.apply(*copy.data, false);
  for (const auto* items : {&copy.roi, &copy.contour, &copy.observations}) {
    for (const auto& item : *items) {
      if (item) deidentifier.apply(*item);
    }
  }
  return copy;
}

}  // namespace

StructureWriteReport write_structure_set(const std::filesystem::path& path, const StructureSet& source,
                                         const std::vector<std::vector<Contour>>& moved, const DicomWriteReport& series,
                                         const DicomDerivation& derivation) {
  prepare_dcmtk();
  const StructureSetHeader header = deidentified(*source.header, derivation.form.deidentification);
  DcmDataset& from = *header.data;
  DcmDataset data;
  carry_over(data, from, {});
  put(data, DCM_SOPClassUID, UID_RTStructureSetStorage);
  put(data, DCM_Modality, "RTSTRUCT");
  put(data, DCM_StudyInstanceUID, series.study_uid);
  put(data, DCM_SeriesInstanceUID, series_uid(from, series, derivation));
  put(data, DCM_SeriesNumber, derived_number(from));
  put(data, DCM_SeriesDescription, derived_description(from, derivation));
  put(data, DCM_FrameOfReferenceUID, series.frame_of_reference_uid);
  put_equipment(data, "109103", "Modifying Equipment", derivation);
  put_structure_set(data, from);
  put_frame_of_reference(data, series);
  for (std::size_t n = 0; n < source.structures.size(); ++n) {
    append_roi(data, *header.roi[n], series.frame_of_reference_uid);
    append_contours(data, header.contour[n].get(), source.structures[n].number, moved.at(n), series);
  }
  for (const auto& observation : header.observations) append_observation(data, *observation);
  static const std::vector<DcmTagKey> kType2 = {DCM_StudyDate,
                                                DCM_StudyTime,
                                                DCM_AccessionNumber,
                                                DCM_Manufacturer,
                                                DCM_ReferringPhysicianName,
                                                DCM_OperatorsName,
                                                DCM_PatientName,
                                                DCM_PatientID,
                                                DCM_PatientBirthDate,
                                                DCM_PatientSex,
                                                DCM_StudyID,
                                                DCM_PositionReferenceIndicator,
                                                DCM_StructureSetDate,
                                                DCM_StructureSetTime};
  put_missing(data, kType2);
  const std::string instance = write_dicom_file(path, data);
  return {text_of(data, DCM_SeriesInstanceUID), instance};
}

}  // namespace tetwarp
