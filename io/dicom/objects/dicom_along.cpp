// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/dcmdata/dcuid.h>

#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_derive.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/privacy/dicom_deidentify.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

/// Of the derived series, which is of this patient and study.
void put_study(DcmItem& target, DcmDataset& slice, const DicomAlong& along, const WrittenSeries& series) {
  const std::string patient = text_of(target, DCM_PatientID), expected = text_of(slice, DCM_PatientID);
  require(
      patient.empty() || expected.empty() || patient == expected,
      shown(along.source) + " is of another patient than the series, by Patient ID (0010,0020); give one of the same");
  const bool same = text_of(target, DCM_StudyInstanceUID) == series.report.study_uid;
  put(target, DCM_StudyInstanceUID, series.report.study_uid);
  if (same) return;
  for (const DcmTagKey& tag : {DCM_StudyDate, DCM_StudyTime, DCM_StudyID, DCM_AccessionNumber}) {
    drop(target, tag);
    carry_attribute(target, slice, tag);
  }
  drop(target, DCM_StudyDescription);
}

}  // namespace

std::string sop_class_of(const std::filesystem::path& path) {
  std::error_code ignored;  // a name that no file can have
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  prepare_dcmtk();
  DcmFileFormat format;
  if (parse_dicom(format, path, DCM_StudyDate).result.bad()) return {};
  return text_of(*format.getDataset(), DCM_SOPClassUID);
}

DcmDataset& read_source(DcmFileFormat& format, const DicomAlong& along) {
  const OFCondition read = parse_dicom(format, along.source, DCM_PixelData).result;
  require(read.good(), shown(along.source) + " cannot be read as DICOM any more: " + read.text());
  deidentify(*format.getDataset(), along.derivation.form.deidentification, false);
  return *format.getDataset();
}

void put_along(DcmItem& target, DcmDataset& source, const DicomAlong& along, const WrittenSeries& series,
               std::span<const DcmTagKey> type_2) {
  const DicomDerivation& derivation = along.derivation;
  const std::optional<Deidentification>& how = derivation.form.deidentification;
  DcmDataset slice(*series.source.slices.front());
  deidentify(slice, how, true);
  carry_over(target, source, {});
  put_study(target, slice, along, series);
  Sha256 hash;
  hash.add("tetwarp along").add(series.report.series_uid).add(along.source_sha256).add(derivation.parameters);
  const std::string uid = uid_from_digest(hash.digest());
  put(target, DCM_SeriesInstanceUID, how ? Deidentifier(*how, "", "").uid(uid) : uid);
  put(target, DCM_SeriesNumber, derived_number(source));
  put(target, DCM_SeriesDescription, derived_description(source, derivation));
  put(target, DCM_FrameOfReferenceUID, series.report.frame_of_reference_uid);
  if (text_of(target, DCM_InstanceNumber).empty()) put(target, DCM_InstanceNumber, "1");
  put_how_derived(target, derivation);
  put_missing(target, type_2);
}

DcmItem& append_slice_reference(DcmItem& target, const DcmTagKey& sequence, const WrittenSeries& series,
                                std::size_t k) {
  DcmItem& item = append_item(target, sequence);
  put(item, DCM_ReferencedSOPClassUID, UID_CTImageStorage);
  put(item, DCM_ReferencedSOPInstanceUID, series.report.sop_instance_uids.at(k));
  return item;
}

}  // namespace tetwarp
