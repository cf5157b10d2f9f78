// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <array>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

/// A contour as a planning system writes it.
struct MadeContour {
  std::string kind = "CLOSED_PLANAR";
  std::vector<std::array<double, 3>> points;
};

/// A structure set as a planning system writes it. A test changes the members that it is about.
struct MadeStructures {
  std::string frame = "1.2.4", study = "1.2", series = "1.2.900", sop_instance = "1.2.900.1";
  std::vector<std::vector<MadeContour>> rois;  ///< contours of ROI 1, 2, ...
  std::function<void(DcmDataset&)> edit;       ///< changes the data set at last, before it is written
};

inline DcmItem& made_item(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem* made = nullptr;
  if (item.findOrCreateSequenceItem(sequence, made, -2).bad()) throw std::runtime_error("no item");
  return *made;
}

inline std::string made_data(const MadeContour& contour) {
  std::string text;
  char number[32];
  for (const auto& point : contour.points) {
    for (const double value : point) {
      std::snprintf(number, sizeof number, "%s%.5g", text.empty() ? "" : "\\", value);
      text += number;
    }
  }
  return text;
}

inline void put_roi(DcmDataset& data, const MadeStructures& made, std::size_t n) {
  const auto text = [](DcmItem& item, const DcmTagKey& tag, const std::string& value) {
    item.putAndInsertString(tag, value.c_str());
  };
  const std::string number = std::to_string(n + 1);
  DcmItem& roi = made_item(data, DCM_StructureSetROISequence);
  text(roi, DCM_ROINumber, number);
  text(roi, DCM_ReferencedFrameOfReferenceUID, made.frame);
  text(roi, DCM_ROIName, "organ_" + number);
  text(roi, DCM_ROIGenerationAlgorithm, "MANUAL");
  text(roi, DCM_ROIVolume, "12.5");
  DcmItem& contours = made_item(data, DCM_ROIContourSequence);
  text(contours, DCM_ReferencedROINumber, number);
  text(contours, DCM_ROIDisplayColor, "255\\" + std::to_string(20 * n) + "\\0");
  for (const MadeContour& contour : made.rois[n]) {
    DcmItem& item = made_item(contours, DCM_ContourSequence);
    DcmItem& image = made_item(item, DCM_ContourImageSequence);
    text(image, DCM_ReferencedSOPClassUID, UID_CTImageStorage);
    text(image, DCM_ReferencedSOPInstanceUID, "1.2.3.1");
    text(item, DCM_ContourGeometricType, contour.kind);
    text(item, DCM_NumberOfContourPoints, std::to_string(contour.points.size()));
    text(item, DCM_ContourData, made_data(contour));
  }
  DcmItem& observation = made_item(data, DCM_RTROIObservationsSequence);
  text(observation, DCM_ObservationNumber, number);
  text(observation, DCM_ReferencedROINumber, number);
  text(observation, DCM_RTROIInterpretedType, "ORGAN");
  text(observation, DCM_ROIInterpreter, "");
}

inline void write_structures(const std::filesystem::path& path, const MadeStructures& made) {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  for (const auto& [tag, value] :
       std::initializer_list<std::pair<DcmTagKey, std::string>>{{DCM_SOPClassUID, UID_RTStructureSetStorage},
                                                                {DCM_SOPInstanceUID, made.sop_instance},
                                                                {DCM_SeriesInstanceUID, made.series},
                                                                {DCM_StudyInstanceUID, made.study},
                                                                {DCM_Modality, "RTSTRUCT"},
                                                                {DCM_Manufacturer, "PLANNERS"},
                                                                {DCM_SeriesDescription, "Drawn"},
                                                                {DCM_SeriesNumber, "7"},
                                                                {DCM_OperatorsName, ""},
                                                                {DCM_PatientName, "SECRET^NAME"},
                                                                {DCM_PatientID, "SECRET-ID"},
                                                                {DCM_StructureSetLabel, "PLAN"},
                                                                {DCM_StructureSetDate, "20200102"},
                                                                {DCM_StructureSetTime, "101112"},
                                                                {DCM_ApprovalStatus, "APPROVED"},
                                                                {DCM_ReviewDate, "20200103"},
                                                                {DCM_ReviewTime, "101112"},
                                                                {DCM_ReviewerName, "REVIEWER"}}) {
    data.putAndInsertString(tag, value.c_str());
  }
  DcmItem& frame = made_item(data, DCM_ReferencedFrameOfReferenceSequence);
  frame.putAndInsertString(DCM_FrameOfReferenceUID, made.frame.c_str());
  for (std::size_t n = 0; n < made.rois.size(); ++n) put_roi(data, made, n);
  if (made.edit) made.edit(data);
  const OFCondition result = format.saveFile(path.c_str(), EXS_LittleEndianImplicit);
  if (result.bad()) throw std::runtime_error(result.text());
}
