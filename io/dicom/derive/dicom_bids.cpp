// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_bids.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "deform/errors.h"
#include "deform/version.h"
#include "io/dicom/derive/dicom_derive.h"
#include "io/dicom/privacy/patient_names.h"
#include "io/dicom/scan/dicom_charset.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_text.h"

namespace tetwarp {

namespace {

using nlohmann::json;

struct Name {
  const char* key;
  DcmTagKey tag;
  double unit = 1;  ///< the attribute's unit in DICOM, measured in that of BIDS
};

const Name kTexts[] = {
    {"Manufacturer", DCM_Manufacturer},          {"ManufacturersModelName", DCM_ManufacturerModelName},
    {"SoftwareVersions", DCM_SoftwareVersions},  {"BodyPartExamined", DCM_BodyPartExamined},
    {"PatientPosition", DCM_PatientPosition},    {"SeriesDescription", DCM_SeriesDescription},
    {"ProtocolName", DCM_ProtocolName},          {"ScanOptions", DCM_ScanOptions},
    {"ConvolutionKernel", DCM_ConvolutionKernel}};

const Name kNumbers[] = {{"SliceThickness", DCM_SliceThickness},     // mm
                         {"KVP", DCM_KVP},                           // kV
                         {"XRayTubeCurrent", DCM_XRayTubeCurrent},   // mA
                         {"XRayExposure", DCM_Exposure},             // mAs
                         {"ExposureTime", DCM_ExposureTime, 1e-3}};  // DICOM: ms, BIDS: s

/// The value of an attribute that all slices share; empty if they differ.
std::string common_value(const DicomHeaders& source, const DcmTagKey& tag) {
  const std::string first = text_of(*source.slices.front(), tag);
  const bool common = std::all_of(source.slices.begin(), source.slices.end(),
                                  [&](const auto& slice) { return text_of(*slice, tag) == first; });
  return common ? first : std::string();
}

/// The single values of an attribute that has several.
std::vector<std::string> values_of(const std::string& text) {
  std::vector<std::string> values;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\\', begin), text.size());
    values.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return values;
}

/// Several values as one text, for BIDS allows no list for most keys.
std::string joined(const std::vector<std::string>& values) {
  std::string text;
  for (const std::string& value : values) text += (text.empty() ? "" : ", ") + value;
  return text;
}

}  // namespace

std::string bids_sidecar(const DicomHeaders& source, const Geometry& output, const DicomDerivation& derivation) {
  require(!source.slices.empty(), "the source series has no slices; a sidecar needs their headers");
  DcmDataset& first = *source.slices.front();
  const auto names_patient = [&](const std::string& text) {
    return std::any_of(source.slices.begin(), source.slices.end(),
                       [&](const auto& slice) { return PatientNames(*slice).are_in(text); });
  };
  std::vector<std::string> image_type = values_of(derived_image_type(first));
  std::erase_if(image_type, [&](const std::string& value) { return value != "AXIAL" && names_patient(value); });
  const std::string set = text_of(first, DCM_SpecificCharacterSet);
  json document = {{"Modality", "CT"},
                   {"ImageType", std::move(image_type)},
                   {"RawImage", false},
                   {"Description", derivation.description},
                   {"ConversionSoftware", "tetwarp"},
                   {"ConversionSoftwareVersion", std::string(version()) + " (" + commit() + ")"}};
  for (const Name& name : kTexts) {
    const std::string text = common_value(source, name.tag);
    if (!text.empty() && !names_patient(text)) document[name.key] = shown_text(joined(values_of(text)), set);
  }
  for (const Name& name : kNumbers) {
    const std::optional<double> value = decimal(common_value(source, name.tag));
    if (value && *value > 0) document[name.key] = *value * name.unit;
  }
  for (const glm::dvec3& axis : {output.direction[0], output.direction[1]})
    for (const double part : {axis.x, axis.y, axis.z}) document["ImageOrientationPatientDICOM"].push_back(part);
  return document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace tetwarp
