// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// RT Structure Sets: read, refused, and written beside a derived series.
#include "io/dicom_structures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "deform/errors.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/dicom/structure_maker.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

using namespace test;

MadeStructures two_rois() {
  MadeStructures made;
  made.rois = {{{"CLOSED_PLANAR", {{0, 0, -7}, {2, 0, -7}, {2, 2.25, -7}}}, {"POINT", {{1, 2, 3}}}},
               {{"OPEN_NONPLANAR", {{0, 0, 0}, {1, 1, 1}}}},
               {}};
  return made;
}

DcmItem& contour_of(DcmDataset& data, long roi, long contour) {
  return item_of(item_of(data, DCM_ROIContourSequence, roi), DCM_ContourSequence, contour);
}

TEST(Structures, AreReadAsTheyLieInTheFile) {
  const Scratch scratch;
  write_structures(scratch / "rs.dcm", two_rois());
  ASSERT_TRUE(is_dicom_structure_set(scratch / "rs.dcm"));
  const StructureSet set = read_structure_set(scratch / "rs.dcm");
  ASSERT_EQ(set.structures.size(), 3u);
  EXPECT_EQ(set.structures[1].number, 2);
  EXPECT_EQ(set.structures[1].frame_of_reference_uid, "1.2.4");
  ASSERT_EQ(set.structures[0].contours.size(), 2u);
  EXPECT_EQ(set.structures[0].contours[0].kind, ContourKind::closed);
  EXPECT_EQ(set.structures[0].contours[0].points, (std::vector<glm::dvec3>{{0, 0, -7}, {2, 0, -7}, {2, 2.25, -7}}));
  EXPECT_EQ(set.structures[0].contours[1].kind, ContourKind::point);
  EXPECT_EQ(set.structures[1].contours[0].kind, ContourKind::open_nonplanar);
  EXPECT_TRUE(set.structures[2].contours.empty());
}

TEST(Structures, AClosedContourThatIsThereTwiceIsTakenOnce) {
  const Scratch scratch;
  MadeStructures made = two_rois();
  auto& contours = made.rois[0];
  contours.push_back(contours[0]);
  contours.push_back(contours[1]);  // a point is no area: both stay
  write_structures(scratch / "rs.dcm", made);
  const StructureSet set = read_structure_set(scratch / "rs.dcm");
  EXPECT_EQ(set.structures[0].contours.size(), 3u);
  EXPECT_EQ(set.structures[0].repeated, 1u);
  EXPECT_EQ(set.structures[1].repeated, 0u);
}

TEST(Structures, OtherFilesAreNone) {
  const Scratch scratch;
  MadeStructures made = two_rois();
  made.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_SOPClassUID, UID_RTPlanStorage); };
  write_structures(scratch / "plan.dcm", made);
  write_file(scratch / "text.dcm", "no DICOM");
  for (const char* name : {"plan.dcm", "text.dcm", "absent.dcm", "."})
    EXPECT_FALSE(is_dicom_structure_set(scratch / name)) << name;
}

TEST(Structures, WhatContradictsItselfIsRefusedByName) {
  const Scratch scratch;
  const auto text = [](const DcmTagKey& tag, const std::string& value, long roi = 0, long contour = 0) {
    return [=](DcmDataset& data) { contour_of(data, roi, contour).putAndInsertString(tag, value.c_str()); };
  };
  const struct {
    std::function<void(DcmDataset&)> edit;
    std::vector<std::string> words;
  } kCases[] = {
      {text(DCM_ContourData, "1\\2\\3\\4"), {"4 numbers", "contour 1 of ROI 1"}},
      {text(DCM_ContourData, "1\\2\\three"), {"no number", "contour 1 of ROI 1"}},
      {text(DCM_ContourData, "1\\2\\3\\", 0, 1), {"empty number", "contour 2 of ROI 1"}},
      {text(DCM_ContourData, "1\\2\\1e300", 1, 0), {"1e300", "contour 1 of ROI 2"}},
      {text(DCM_NumberOfContourPoints, "7"), {"says 7", "has 3 points"}},
      {text(DCM_NumberOfContourPoints, "99999999999"), {"99999999999", "has 3 points"}},
      {text(DCM_NumberOfContourPoints, "SECRET"), {"says no number", "has 3 points"}},
      {text(DCM_ContourGeometricType, "ROUND"), {"(3006,0042)", "no known value"}},
      {text(DCM_RETIRED_ContourOffsetVector, "0\\0\\1.5"), {"(3006,0045)"}},
      {[](DcmDataset& data) { data.findAndDeleteElement(DCM_StructureSetROISequence); }, {"(3006,0020)"}},
      {[](DcmDataset& data) { item_of(data, DCM_StructureSetROISequence, 1).putAndInsertString(DCM_ROINumber, "1"); },
       {"ROI 1", "twice"}},
      {[](DcmDataset& data) {
         item_of(data, DCM_ROIContourSequence, 1).putAndInsertString(DCM_ReferencedROINumber, "9");
       },
       {"ROI 9", "does not define"}},
      {[](DcmDataset& data) {
         item_of(data, DCM_ROIContourSequence, 1).putAndInsertString(DCM_ReferencedROINumber, "1");
       },
       {"ROI 1", "two places"}},
      {[](DcmDataset& data) { item_of(data, DCM_StructureSetROISequence).findAndDeleteElement(DCM_ROINumber); },
       {"(3006,0022)"}},
  };
  for (const auto& [edit, words] : kCases) {
    MadeStructures made = two_rois();
    made.edit = edit;
    write_structures(scratch / "rs.dcm", made);
    std::string message;
    try {
      read_structure_set(scratch / "rs.dcm");
    } catch (const InputError& error) {
      message = error.what();
    }
    EXPECT_TRUE(says(message, words));
    EXPECT_TRUE(says(message, {"rs.dcm", ";"}));
    EXPECT_EQ(message.find("SECRET"), std::string::npos);
  }
}

TEST(Structures, CutAnywhereAreRefusedOrWhole) {
  const Scratch scratch;
  write_structures(scratch / "rs.dcm", two_rois());
  const std::string bytes = file_bytes(scratch / "rs.dcm");
  int refused = 0;
  for (std::size_t end = 0; end < bytes.size(); end += 7) {
    write_file(scratch / "cut.dcm", bytes.substr(0, end));
    is_dicom_structure_set(scratch / "cut.dcm");
    try {
      const StructureSet set = read_structure_set(scratch / "cut.dcm");
      ASSERT_EQ(set.structures.size(), 3u) << end;
      ASSERT_EQ(set.structures[1].contours.size(), 1u) << end;
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(Structures, OfARealPatientAreRead) {
  TETWARP_REAL_DATA(folder, "rt-breast");
  EXPECT_TRUE(is_dicom_structure_set(folder / "rtss.dcm"));
  EXPECT_FALSE(is_dicom_structure_set(folder / "rtdose.dcm"));
  EXPECT_FALSE(is_dicom_structure_set(folder / "rtplan.dcm"));
  const StructureSet set = read_structure_set(folder / "rtss.dcm");
  std::map<int, std::pair<std::size_t, std::size_t>> found;  // contours, points; counted with pydicom
  for (const Structure& structure : set.structures) {
    auto& [contours, points] = found[structure.number];
    contours = structure.contours.size();
    for (const Contour& contour : structure.contours) points += contour.points.size();
  }
  EXPECT_EQ(found, (std::map<int, std::pair<std::size_t, std::size_t>>{{1, {141, 51846}},
                                                                       {2, {0, 0}},
                                                                       {3, {2, 88}},
                                                                       {4, {48, 9062}},
                                                                       {5, {33, 4732}},
                                                                       {6, {165, 19956}},
                                                                       {7, {4, 64}},
                                                                       {8, {6, 162}},
                                                                       {9, {18, 616}},
                                                                       {10, {24, 1632}}}));
}

/// A derived series, and a structure set that is written with it.
struct WrittenSet {
  Scratch scratch;
  DerivedSource source;
  DicomWriteReport series;
  StructureSet set;
  std::vector<std::vector<Contour>> moved;

  explicit WrittenSet(const MadeStructures& made = two_rois()) {
    series = source.write(scratch / "series");
    write_structures(scratch / "rs.dcm", made);
    set = read_structure_set(scratch / "rs.dcm");
    for (const Structure& structure : set.structures) moved.push_back(structure.contours);
    if (!moved[0].empty()) moved[0][0].slice = 2;
  }
  StructureWriteReport write(const std::string& name = "out.dcm") {
    return write_structure_set(scratch / name, set, moved, series, source.derivation);
  }
};

TEST(WrittenStructures, ReferToTheDerivedSeries) {
  WrittenSet written;
  const StructureWriteReport report = written.write();
  Written file(written.scratch / "out.dcm");
  EXPECT_EQ(file[DCM_SOPInstanceUID], report.sop_instance_uid);
  EXPECT_EQ(file[DCM_SeriesInstanceUID], report.series_uid);
  EXPECT_EQ(file[DCM_StudyInstanceUID], written.series.study_uid);
  EXPECT_EQ(file[DCM_FrameOfReferenceUID], written.series.frame_of_reference_uid);
  DcmItem& frame = item_of(file.data(), DCM_ReferencedFrameOfReferenceSequence);
  EXPECT_EQ(get(frame, DCM_FrameOfReferenceUID), written.series.frame_of_reference_uid);
  DcmItem& study = item_of(frame, DCM_RTReferencedStudySequence);
  EXPECT_EQ(get(study, DCM_ReferencedSOPInstanceUID), written.series.study_uid);
  DcmItem& images = item_of(study, DCM_RTReferencedSeriesSequence);
  EXPECT_EQ(get(images, DCM_SeriesInstanceUID), written.series.series_uid);
  ASSERT_EQ(items_of(images, DCM_ContourImageSequence), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(get(item_of(images, DCM_ContourImageSequence, k), DCM_ReferencedSOPInstanceUID),
              written.series.sop_instance_uids[static_cast<std::size_t>(k)]);
  }
  for (int n = 0; n < 3; ++n) {
    EXPECT_EQ(get(item_of(file.data(), DCM_StructureSetROISequence, n), DCM_ReferencedFrameOfReferenceUID),
              written.series.frame_of_reference_uid);
  }
  DcmItem& closed = contour_of(file.data(), 0, 0);
  EXPECT_EQ(get(item_of(closed, DCM_ContourImageSequence), DCM_ReferencedSOPInstanceUID),
            written.series.sop_instance_uids[2]);
  EXPECT_FALSE(contour_of(file.data(), 0, 1).tagExists(DCM_ContourImageSequence));
  EXPECT_EQ(get(item_of(file.data(), DCM_PredecessorStructureSetSequence), DCM_ReferencedSOPInstanceUID), "1.2.900.1");
}

TEST(WrittenStructures, KeepWhatStaysTrueAndDropWhatDoesNot) {
  MadeStructures made = two_rois();
  made.edit = [](DcmDataset& data) {
    data.putAndInsertString(DcmTag(0x3007, 0x0010, EVR_LO), "PRIVATE");
    item_of(data, DCM_RTROIObservationsSequence).putAndInsertString(DcmTag(0x3287, 0x0010, EVR_LO), "PRIVATE");
    data.putAndInsertString(DCM_InstanceCreationDate, "20200104");
  };
  WrittenSet written(made);
  written.write();
  EXPECT_EQ(file_bytes(written.scratch / "out.dcm").find("PRIVATE"), std::string::npos);
  EXPECT_EQ(file_bytes(written.scratch / "out.dcm").find("REVIEWER"), std::string::npos);
  Written file(written.scratch / "out.dcm");
  EXPECT_EQ(file[DCM_PatientID], "SECRET-ID");
  EXPECT_EQ(file[DCM_StructureSetLabel], "PLAN");
  EXPECT_EQ(file[DCM_StructureSetDate], "20200102");
  EXPECT_EQ(file[DCM_ApprovalStatus], "UNAPPROVED");
  EXPECT_EQ(file[DCM_ReviewDate], "<missing>");
  EXPECT_EQ(file[DCM_InstanceCreationDate], "<missing>");
  EXPECT_EQ(file[DCM_SeriesDescription], "deformed: Drawn");
  EXPECT_EQ(file[DCM_SeriesNumber], "1007");
  DcmItem& roi = item_of(file.data(), DCM_StructureSetROISequence, 1);
  EXPECT_EQ(get(roi, DCM_ROINumber), "2");
  EXPECT_EQ(get(roi, DCM_ROIName), "organ_2");
  EXPECT_EQ(get(roi, DCM_ROIGenerationAlgorithm), "SEMIAUTOMATIC");
  EXPECT_EQ(get(roi, DCM_ROIVolume), "<missing>");
  EXPECT_EQ(get(item_of(file.data(), DCM_ROIContourSequence, 1), DCM_ROIDisplayColor), "255\\20\\0");
  EXPECT_EQ(get(item_of(file.data(), DCM_RTROIObservationsSequence, 2), DCM_RTROIInterpretedType), "ORGAN");
  EXPECT_EQ(get(contour_of(file.data(), 0, 0), DCM_ContourData), "0\\0\\-7\\2\\0\\-7\\2\\2.25\\-7");
}

TEST(WrittenStructures, AreTheSameBytesEachTimeAndOtherUidsForOtherContours) {
  WrittenSet written;
  const StructureWriteReport first = written.write("a.dcm"), again = written.write("b.dcm");
  EXPECT_EQ(file_bytes(written.scratch / "a.dcm"), file_bytes(written.scratch / "b.dcm"));
  EXPECT_EQ(first.sop_instance_uid, again.sop_instance_uid);
  written.moved[0][0].points[0].x += 0.001;
  EXPECT_NE(written.write("c.dcm").sop_instance_uid, first.sop_instance_uid);
  written.source.derivation.field_sha256 = std::string(64, 'b');
  EXPECT_NE(written.write("d.dcm").series_uid, first.series_uid);
}

/// A decimal string of explicit VR ends at 65534 bytes.
TEST(WrittenStructures, LongContoursAreReadBack) {
  WrittenSet written;
  Contour& contour = written.moved[1].emplace_back();
  for (int n = 0; n < 9000; ++n) contour.points.emplace_back(-100.1234 + 0.01 * n, 200.4321, -123.4567);
  written.write();
  const StructureSet back = read_structure_set(written.scratch / "out.dcm");
  ASSERT_EQ(back.structures[1].contours.size(), 2u);
  ASSERT_EQ(back.structures[1].contours[1].points.size(), 9000u);
  EXPECT_NEAR(back.structures[1].contours[1].points[8999].x, contour.points[8999].x, 1e-9);
  EXPECT_EQ(get(contour_of(Written(written.scratch / "out.dcm").data(), 1, 1), DCM_NumberOfContourPoints), "9000");
}

}  // namespace
}  // namespace tetwarp
