// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "io/dicom/scan/dicom_headers.h"

namespace tetwarp::test {

inline void set(DcmItem& item, const DcmTagKey& tag, const std::string& value) {
  ASSERT_TRUE(item.putAndInsertString(tag, value.c_str()).good()) << value;
}

/// All components of an attribute; "<missing>" where it is not there.
inline std::string get(DcmItem& item, const DcmTagKey& tag) {
  OFString value;
  return item.findAndGetOFStringArray(tag, value).good() ? std::string(value.c_str()) : "<missing>";
}

/// The n-th item of a sequence (-1: the last); an empty one and a failed test where there is none.
inline DcmItem& item_of(DcmItem& item, const DcmTagKey& sequence, long n = 0) {
  static DcmItem none;
  DcmItem* found = nullptr;
  if (item.findAndGetSequenceItem(sequence, found, n).good()) return *found;
  ADD_FAILURE() << "no item " << n << " of " << sequence.toString();
  return none;
}

inline unsigned long items_of(DcmItem& item, const DcmTagKey& sequence) {
  DcmSequenceOfItems* found = nullptr;
  return item.findAndGetSequence(sequence, found).good() ? found->card() : 0;
}

/// A CT volume of made-up HU, and for each slice a header as a scanner writes it.
struct DerivedSource {
  Volume<std::int16_t> volume;
  DicomHeaders headers;
  DicomDerivation derivation;
  std::vector<SliceRange> sampled;

  explicit DerivedSource(std::int64_t slices = 3) {
    volume.geometry = {{8, 6, slices}, {0.75, 0.5, 2.5}, {-10.5, 20.25, -7}, glm::dmat3(1)};
    for (std::int64_t n = 0; n < voxel_count(volume.geometry); ++n) {
      volume.voxels.push_back(static_cast<std::int16_t>(n * 37 % 3000 - 1024));
    }
    for (std::int64_t k = 0; k < slices; ++k) headers.slices.push_back(header(k));
    derivation.field_sha256 = std::string(64, 'a');
    derivation.parameters = "interpolation=linear outside=refuse";
    derivation.description = "Deformed by a vertex field";
    for (std::int64_t k = 0; k < slices; ++k) sampled.push_back({k, std::min(k + 1, slices - 1)});
  }

  DcmDataset& operator[](std::size_t k) { return *headers.slices[k]; }
  void set_all(const DcmTagKey& tag, const std::string& value) {
    for (const auto& slice : headers.slices) set(*slice, tag, value);
  }
  void remove_all(const DcmTagKey& tag) {
    for (const auto& slice : headers.slices) slice->findAndDeleteElement(tag);
  }

  DicomWriteReport write(const std::filesystem::path& folder, int threads = 0) const {
    std::filesystem::create_directories(folder);
    return write_derived_series(folder, view(volume), headers, derivation, sampled, threads);
  }

 private:
  static std::unique_ptr<DcmDataset> header(std::int64_t k) {
    auto slice = std::make_unique<DcmDataset>();
    const std::string number = std::to_string(k + 1);
    for (const auto& [tag, value] : std::initializer_list<std::pair<DcmTagKey, std::string>>{
             {DCM_SpecificCharacterSet, "ISO_IR 100"},
             {DCM_ImageType, "ORIGINAL\\PRIMARY\\AXIAL\\CT_SOM5 SPI"},
             {DCM_InstanceCreationDate, "20200102"},
             {DCM_SOPClassUID, UID_CTImageStorage},
             {DCM_SOPInstanceUID, "1.2.3.4." + number},
             {DCM_StudyDate, "20200102"},
             {DCM_SeriesDate, "20200103"},
             {DCM_ContentDate, "20200104"},
             {DCM_StudyTime, "101112"},
             {DCM_AccessionNumber, ""},
             {DCM_Modality, "CT"},
             {DCM_Manufacturer, "SCANNERS"},
             {DCM_ReferringPhysicianName, "REFERRER"},
             {DCM_SeriesDescription, "Abdomen 2.5"},
             {DCM_PatientName, "NAME^GIVEN"},
             {DCM_PatientID, "ID17"},
             {DCM_PatientBirthDate, "19500101"},
             {DCM_PatientSex, "F"},
             {DCM_BodyPartExamined, "ABDOMEN"},
             {DCM_SliceThickness, "2.50"},
             {DCM_KVP, "120"},
             {DCM_XRayTubeCurrent, std::to_string(100 + k)},
             {DCM_TableHeight, "150"},
             {DCM_PatientPosition, "HFS"},
             {DCM_StudyInstanceUID, "1.2.3.1"},
             {DCM_SeriesInstanceUID, "1.2.3.2"},
             {DCM_StudyID, "S1"},
             {DCM_SeriesNumber, "4"},
             {DCM_AcquisitionNumber, "1"},
             {DCM_InstanceNumber, number},
             {DCM_ImagePositionPatient, "-10.500\\20.250\\" + std::to_string(-7 + 2.5 * static_cast<double>(k))},
             {DCM_ImageOrientationPatient, "1.00\\0.00\\0.00\\0.00\\1.00\\0.00"},
             {DCM_FrameOfReferenceUID, "1.2.3.3"},
             {DCM_PositionReferenceIndicator, ""},
             {DCM_SliceLocation, "7.0"},
             {DCM_PhotometricInterpretation, "MONOCHROME1"},
             {DCM_PixelSpacing, "0.500\\0.750"},
             {DCM_WindowCenter, "40"},
             {DCM_WindowWidth, "400"},
             {DCM_RescaleIntercept, "-1024"},
             {DCM_RescaleSlope, "2"},
         }) {
      set(*slice, tag, value);
    }
    for (const auto& [tag, value] : std::initializer_list<std::pair<DcmTagKey, Uint16>>{{DCM_SamplesPerPixel, 1},
                                                                                        {DCM_Rows, 6},
                                                                                        {DCM_Columns, 8},
                                                                                        {DCM_BitsAllocated, 16},
                                                                                        {DCM_BitsStored, 12},
                                                                                        {DCM_HighBit, 11},
                                                                                        {DCM_PixelRepresentation, 0}}) {
      EXPECT_TRUE(slice->putAndInsertUint16(tag, value).good());
    }
    return slice;
  }
};

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A written file, read with DCMTK.
struct Written {
  DcmFileFormat format;

  explicit Written(const std::filesystem::path& path) { EXPECT_TRUE(format.loadFile(path.c_str()).good()) << path; }
  DcmDataset& data() { return *format.getDataset(); }
  std::string operator[](const DcmTagKey& tag) { return get(data(), tag); }
};

}  // namespace tetwarp::test
