// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>

#include "deform/version.h"
#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"
#include "io/hash.h"
#include "io/parallel.h"

namespace tetwarp {

namespace {

/// Date and time of every phantom: constants, since it was never scanned and no clock is read.
constexpr char kDate[] = "20000101", kTime[] = "000000";

struct PhantomUids {
  std::string study, series, frame_of_reference;
};

/// UIDs of a phantom, a hash of its whole content: another size, spacing or seed gives another study.
PhantomUids phantom_uids(const ConstVolumeView& volume, std::uint64_t seed) {
  Sha256 hash;
  hash.add("tetwarp phantom").add(std::to_string(seed)).add(version()).add(commit());
  const std::size_t bytes = static_cast<std::size_t>(voxel_count(*volume.geometry)) * sizeof(std::int16_t);
  hash.add(to_string(volume.geometry->size)).add({volume.voxels, bytes});
  const glm::dvec3 spacing = volume.geometry->spacing;
  for (const double s : {spacing.x, spacing.y, spacing.z}) hash.add(decimal_string(s));
  const auto uid = [&](const char* what) { return uid_from_digest(Sha256().add(hash.hex()).add(what).digest()); };
  return {uid("study"), uid("series"), uid("frame of reference")};
}

void put_patient_and_study(DcmItem& item, const PhantomUids& uids) {
  put(item, DCM_PatientName, "PHANTOM^TETWARP");
  put(item, DCM_PatientID, "TETWARP-PHANTOM");
  put(item, DCM_StudyInstanceUID, uids.study);
  put(item, DCM_StudyDate, kDate);
  put(item, DCM_StudyTime, kTime);
  put(item, DCM_StudyID, "1");
  put(item, DCM_StudyDescription, "Phantom");
}

void put_series_and_equipment(DcmItem& item, const PhantomUids& uids, std::uint64_t seed) {
  put(item, DCM_Modality, "CT");
  put(item, DCM_SeriesInstanceUID, uids.series);
  put(item, DCM_SeriesNumber, "1");
  put(item, DCM_SeriesDescription, "phantom, seed " + std::to_string(seed));
  put(item, DCM_BodyPartExamined, "CHEST");
  put(item, DCM_PatientPosition, "HFS");
  put(item, DCM_FrameOfReferenceUID, uids.frame_of_reference);
  put_tetwarp(item, "tetwarp phantom");
}

void put_image(DcmItem& item, const Geometry& geometry, std::size_t k) {
  put(item, DCM_SOPClassUID, UID_CTImageStorage);
  put(item, DCM_ImageType, "ORIGINAL\\PRIMARY\\AXIAL");
  put(item, DCM_InstanceNumber, std::to_string(k + 1));
  put(item, DCM_AcquisitionNumber, "1");
  put(item, DCM_ContentDate, kDate);
  put(item, DCM_ContentTime, kTime);
  put(item, DCM_QualityControlImage, "YES");  // an image of a phantom
  put(item, DCM_BurnedInAnnotation, "NO");
  put(item, DCM_LossyImageCompression, "00");
  put(item, DCM_WindowCenter, "40");
  put(item, DCM_WindowWidth, "400");
  put(item, DCM_SliceThickness, decimal_string(geometry.spacing.z));
  put_image_plane(item, geometry, static_cast<std::int64_t>(k));
}

}  // namespace

void write_phantom_series(const std::filesystem::path& folder, const ConstVolumeView& volume, std::uint64_t seed,
                          const Control& control) {
  prepare_dcmtk();
  const Geometry& geometry = require_hu_volume(volume);
  const PhantomUids uids = phantom_uids(volume, seed);
  for_each_index(static_cast<std::size_t>(geometry.size.z), 0, control, [&](std::size_t k) {
    DcmDataset slice;
    put_patient_and_study(slice, uids);
    put_series_and_equipment(slice, uids, seed);
    put_image(slice, geometry, k);
    put_missing(slice, type_2_attributes());
    put_hu_format(slice, geometry);
    write_dicom_file(folder / dicom_file_name(static_cast<int>(k + 1)), slice, slice_of(volume, k));
  });
}

}  // namespace tetwarp
