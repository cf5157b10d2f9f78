// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a BIDS sidecar says of the headers of a series.
#include "io/dicom_bids.h"

#include <nlohmann/json.hpp>

#include "tests/io/dicom/derive/derived_source.h"

namespace tetwarp::test {
namespace {

using nlohmann::json;

json sidecar_of(const DerivedSource& source) {
  return json::parse(bids_sidecar(source.headers, source.volume.geometry, source.derivation));
}

TEST(BidsSidecar, HasTheValuesThatAllSlicesShareInUnitsOfBids) {
  DerivedSource source;
  source.set_all(DCM_ExposureTime, "500");
  source.set_all(DCM_Exposure, "120");
  source.set_all(DCM_ConvolutionKernel, "B30f");
  source.set_all(DCM_ManufacturerModelName, "Scan 4");
  const json found = sidecar_of(source);
  EXPECT_EQ(found["Modality"], "CT");
  EXPECT_EQ(found["Manufacturer"], "SCANNERS");
  EXPECT_EQ(found["ManufacturersModelName"], "Scan 4");
  EXPECT_EQ(found["BodyPartExamined"], "ABDOMEN");
  EXPECT_EQ(found["PatientPosition"], "HFS");
  EXPECT_EQ(found["SeriesDescription"], "Abdomen 2.5");
  EXPECT_EQ(found["ConvolutionKernel"], "B30f");
  EXPECT_EQ(found["SliceThickness"], 2.5);
  EXPECT_EQ(found["KVP"], 120);
  EXPECT_EQ(found["ExposureTime"], 0.5);
  EXPECT_EQ(found["XRayExposure"], 120);
  EXPECT_EQ(found["Description"], "Deformed by a vertex field");
  EXPECT_EQ(found["ImageType"], json({"DERIVED", "SECONDARY", "AXIAL", "CT_SOM5 SPI"}));
  EXPECT_EQ(found["RawImage"], false);
  EXPECT_FALSE(found.contains("XRayTubeCurrent")) << "100, 101, 102 mA";
}

TEST(BidsSidecar, LeavesOutWhatSaysNothing) {
  DerivedSource source;
  source.set_all(DCM_KVP, "0");
  source.set_all(DCM_SliceThickness, "thin");
  source.set_all(DCM_Exposure, "1\\2");
  source.set_all(DCM_PatientPosition, "");
  source.remove_all(DCM_Manufacturer);
  const json found = sidecar_of(source);
  for (const char* key : {"KVP", "SliceThickness", "XRayExposure", "PatientPosition", "Manufacturer", "ProtocolName"})
    EXPECT_FALSE(found.contains(key)) << key;
}

TEST(BidsSidecar, SaysNothingOfWhoWhereAndWhen) {
  DerivedSource source;
  source.set_all(DCM_InstitutionName, "ST ELSEWHERE");
  source.set_all(DCM_InstitutionAddress, "A STREET");
  source.set_all(DCM_StationName, "ROOM5");
  source.set_all(DCM_DeviceSerialNumber, "998877");
  source.set_all(DCM_OperatorsName, "OPERATOR");
  source.set_all(DCM_ImageComments, "a remark");
  source.set_all(DCM_ProtocolName, "scan of Given");      // a word of the name
  source.set_all(DCM_SeriesDescription, "patient ID17");  // the ID
  source.set_all(DCM_ScanOptions, "HELICAL\\NAME");
  json found = sidecar_of(source);
  found.erase("ConversionSoftwareVersion");  // a commit may have any digits
  const std::string text = found.dump();
  for (const char* word : {"NAME", "GIVEN", "Given", "ID17", "1950", "2020", "1011", "ELSEWHERE", "STREET", "ROOM5",
                           "998877", "OPERATOR", "REFERRER", "remark", "1.2.3"})
    EXPECT_EQ(text.find(word), std::string::npos) << word << " in " << text;
}

TEST(BidsSidecar, HasOtherAlphabetsInUtf8AndSeveralValuesInOne) {
  DerivedSource source;
  source.set_all(DCM_ProtocolName,
                 "Sch\xe4"
                 "del");  // ISO_IR 100
  source.set_all(DCM_SoftwareVersions, "a 1\\b 2");
  const json found = sidecar_of(source);
  EXPECT_EQ(found["ProtocolName"],
            "Sch\xc3\xa4"
            "del");
  EXPECT_EQ(found["SoftwareVersions"], "a 1, b 2");
}

TEST(BidsSidecar, OrientationIsThatOfTheOutput) {
  DerivedSource source;
  source.volume.geometry.direction = glm::dmat3(0, 1, 0, 0, 0, -1, -1, 0, 0);
  EXPECT_EQ(sidecar_of(source)["ImageOrientationPatientDICOM"], json({0, 1, 0, 0, 0, -1}));
}

}  // namespace
}  // namespace tetwarp::test
