// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What goes along with a de-identified series tells no more than the series does.
#include "tests/apps/deform/along_case.h"
#include "tests/support/dicom/structure_maker.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

/// A series, a dose, a segmentation and a structure set on it that tell whom they show wherever they can.
struct TellingCase : AlongCase {
  TellingCase() {
    dose().write(scratch / "dose.dcm");
    seg().write(scratch / "seg.dcm");
    MadeStructures made;
    made.rois = {{{"CLOSED_PLANAR", {{-8, -18, 35}, {-6, -18, 35}, {-6, -15, 35}, {-8, -15, 35}}}}};
    write_structures(scratch / "rs.dcm", made);
    for (const char* name : {"dose.dcm", "seg.dcm", "rs.dcm"}) tell(scratch / name);
    write_file(scratch / "key", std::string(32, 'k'));
  }

  static void tell(const std::filesystem::path& path) {
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile(path.c_str()).good());
    DcmDataset& data = *file.getDataset();
    for (const auto& [tag, value] :
         std::initializer_list<std::pair<DcmTagKey, const char*>>{{DCM_PatientName, "QNAME^QGIVEN"},
                                                                  {DCM_OtherPatientNames, "QOTHER"},
                                                                  {DCM_InstitutionName, "QHOSPITAL"},
                                                                  {DCM_ReferringPhysicianName, "QREFERRER"},
                                                                  {DCM_OperatorsName, "QOPERATOR"},
                                                                  {DCM_StationName, "QSTATION"},
                                                                  {DCM_StudyDate, "19870605"},
                                                                  {DCM_SeriesDate, "19870606"},
                                                                  {DCM_ContentDate, "19870607"},
                                                                  {DCM_StudyDescription, "QSTUDY"},
                                                                  {DCM_SeriesDescription, "QSERIES"},
                                                                  {DCM_DoseComment, "QDOSE"},
                                                                  {DCM_ContentDescription, "QCONTENT"},
                                                                  {DCM_ContentCreatorName, "QCREATOR"},
                                                                  {DCM_StructureSetLabel, "QLABEL"},
                                                                  {DCM_StructureSetName, "QSETNAME"},
                                                                  {DCM_StructureSetDate, "19870608"}}) {
      ASSERT_TRUE(data.putAndInsertString(tag, value).good());
    }
    for (const auto& [sequence, tag] :
         {std::pair{DCM_StructureSetROISequence, DCM_ROIName},
          std::pair{DCM_StructureSetROISequence, DCM_ROIDescription},
          std::pair{DCM_SegmentSequence, DCM_SegmentDescription}, std::pair{DCM_SegmentSequence, DCM_TrackingID}}) {
      DcmItem* item = nullptr;
      if (data.findAndGetSequenceItem(sequence, item).good()) item->putAndInsertString(tag, "QITEM");
    }
    ASSERT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
  }

  void deform(const std::string& options) const {
    run("deform ct -f twist:angle=10 --outside background -o out --with dose.dcm=d.dcm --with seg.dcm=s.dcm "
        "--with rs.dcm=r.dcm --inverse reg.dcm --overwrite --deidentify-key key --deidentify " +
        options);
  }
};

std::string value_of(const std::filesystem::path& path, const DcmTagKey& tag) {
  DcmFileFormat file;
  EXPECT_TRUE(file.loadFile(path.c_str()).good()) << path;
  OFString text;
  file.getDataset()->findAndGetOFStringArray(tag, text);
  return text.c_str();
}

constexpr const char* kObjects[] = {"d.dcm", "s.dcm", "r.dcm", "reg.dcm"};

TEST(DeidentifiedAlong, TellsNothing) {
  const TellingCase kase;
  kase.deform("basic");
  for (const char* name : {"d.dcm", "s.dcm", "r.dcm", "reg.dcm", "out.json"}) {
    const std::string bytes = read_text(kase.scratch / name);
    // Whole dates: a year alone stands in every hundredth UID or hash by chance.
    for (const char* secret : {"QNAME",    "QGIVEN",   "QOTHER",   "QHOSPITAL", "QREFERRER", "QOPERATOR", "QSTATION",
                               "19870605", "19870606", "19870607", "19870608",  "QSTUDY",    "QSERIES",   "QDOSE",
                               "QCONTENT", "QCREATOR", "QLABEL",   "QSETNAME",  "QITEM",     "SECRET",    "1.2.6",
                               "1.2.7",    "1.2.8.1",  "1.2.8.2",  "1.2.900",   "dose.dcm",  "seg.dcm",   "rs.dcm"})
      EXPECT_EQ(bytes.find(secret), std::string::npos) << name << " holds " << secret;
  }
}

TEST(DeidentifiedAlong, IsOfThePatientStudyAndFrameOfItsSeries) {
  const TellingCase kase;
  kase.deform("shift-dates,retain-device");
  const std::filesystem::path slice = kase.scratch / "out" / "IM00001.dcm";
  for (const char* name : kObjects) {
    const std::filesystem::path path = kase.scratch / name;
    for (const DcmTagKey& tag :
         {DCM_PatientID, DCM_PatientName, DCM_StudyInstanceUID, DCM_FrameOfReferenceUID, DCM_PatientIdentityRemoved}) {
      EXPECT_FALSE(value_of(path, tag).empty()) << name << tag.toString();
      EXPECT_EQ(value_of(path, tag), value_of(slice, tag)) << name << tag.toString();
    }
    EXPECT_EQ(value_of(path, DCM_LongitudinalTemporalInformationModified), "MODIFIED") << name;
  }
  EXPECT_EQ(value_of(kase.scratch / "d.dcm", DCM_StationName), "QSTATION") << "retained";
  EXPECT_EQ(value_of(kase.scratch / "d.dcm", DCM_StudyDate), value_of(kase.scratch / "s.dcm", DCM_StudyDate));
  EXPECT_LT(value_of(kase.scratch / "d.dcm", DCM_StudyDate), "19870605");
}

}  // namespace
