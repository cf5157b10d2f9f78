// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `--with IN=OUT.dcm`: what is refused, and what the objects say of themselves.
#include <algorithm>

#include "tests/apps/deform/along_case.h"
#include "tests/support/says.h"

namespace {

using namespace tetwarp;

bool nothing_written(const AlongCase& kase) {
  return !std::filesystem::exists(kase.scratch / "out") && !std::filesystem::exists(kase.scratch / "x.dcm") &&
         !std::filesystem::exists(kase.scratch / "out.json");
}

TEST(Along, AWrongCommandLineIsRefusedBeforeAnyWork) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    EXPECT_TRUE(says(kase.said("deform ct -f identity " + arguments, 2), words)) << arguments;
    EXPECT_TRUE(nothing_written(kase)) << arguments;
  };
  refused("-o out.nii --with dose.dcm=x.dcm", {"x.dcm", "refers to a DICOM series"});
  refused("-o out --with ct/s00.dcm=x.dcm", {"only an RTDOSE or a SEG", "ct/s00.dcm"});
  refused("-o out --with seg.dcm=x.nii", {"comes out as a SEG", "seg.dcm"});
  refused("-o out --with seg.dcm=x.dcm:background=1", {"background= is not for a SEG"});
  refused("-o out --with dose.dcm=x.dicom", {"x.dicom"});
  refused("-o out --with dose.dcm=dose.dcm", {"dose.dcm", "the input"});
}

TEST(Along, WhatLiesInAnotherSpaceIsRefusedWithBothUids) {
  const AlongCase kase;
  MadeDose dose = AlongCase::dose();
  dose.frame = "1.2.99";
  dose.write(kase.scratch / "dose.dcm");
  MadeSeg seg = AlongCase::seg();
  seg.frame = "";
  seg.write(kase.scratch / "seg.dcm");
  EXPECT_TRUE(
      says(kase.said("deform ct -f identity -o out --with dose.dcm=x.dcm", 4), {"dose.dcm", "1.2.99", "1.2.4"}));
  EXPECT_TRUE(says(kase.said("deform ct -f identity -o out --with seg.dcm=x.dcm", 4), {"seg.dcm", "(none)", "1.2.4"}));
  EXPECT_TRUE(nothing_written(kase));
  kase.run("deform ct -f identity -o out --with dose.dcm=x.nii");  // an image has no frame of reference
}

TEST(Along, ASeriesWithoutAFrameOfReferenceGetsANote) {
  const AlongCase kase;
  kase.write_ct([](MadeSlice& slice) { slice.frame = ""; });
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  const std::string said = kase.said("deform ct -f identity -o out --with dose.dcm=x.dcm", 0);
  EXPECT_TRUE(says(said, {"tetwarp: note: INPUT has no Frame of Reference UID", "dose.dcm"}));
}

TEST(Along, WhatIsOfAnotherPatientIsRefusedWithoutNamingOne) {
  const AlongCase kase;
  MadeDose dose = AlongCase::dose();
  dose.patient = "OTHER-ID";
  dose.write(kase.scratch / "dose.dcm");
  const std::string said = kase.said("deform ct -f identity -o out --with dose.dcm=x.dcm", 4);
  EXPECT_TRUE(says(said, {"another patient", "(0010,0020)", "dose.dcm"}));
  EXPECT_EQ(said.find("OTHER"), std::string::npos);
  EXPECT_EQ(said.find("SECRET"), std::string::npos);
  EXPECT_TRUE(nothing_written(kase));
}

TEST(Along, WhatIsCutShortIsRefused) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  for (const std::string name : {"dose.dcm", "seg.dcm"}) {
    const std::uintmax_t size = std::filesystem::file_size(kase.scratch / name);
    for (const std::uintmax_t cut : {std::uintmax_t{2}, size / 4, size / 2}) {
      std::filesystem::copy_file(kase.scratch / name, kase.scratch / "cut.dcm",
                                 std::filesystem::copy_options::overwrite_existing);
      std::filesystem::resize_file(kase.scratch / "cut.dcm", size - cut);
      EXPECT_TRUE(says(kase.said("deform ct -f identity -o out --with cut.dcm=x.dcm", 4), {"cut.dcm"})) << name << cut;
      EXPECT_TRUE(nothing_written(kase));
    }
  }
}

std::string attribute(const std::filesystem::path& path, const DcmTagKey& tag) {
  DcmFileFormat format;
  OFString value;
  EXPECT_TRUE(format.loadFile(path.c_str()).good()) << path;
  format.getDataset()->findAndGetOFStringArray(tag, value);
  return value.c_str();
}

TEST(Along, TheSameRunMakesTheSameBytesAndOtherOptionsMakeOtherUids) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  const auto run = [&](const std::string& folder, const std::string& options, const std::string& rest) {
    std::filesystem::create_directories(kase.scratch / folder);
    kase.run("deform ct -f twist:angle=20 --outside background -o " + folder + "/out --with dose.dcm=" + folder +
             "/dose.dcm" + options + " --with seg.dcm=" + folder + "/seg.dcm" + options + rest);
  };
  run("a", "", " --threads 1");
  run("b", "", " --threads 3");
  run("nearest", ":nearest", "");
  run("own", ":own", "");
  for (const std::string name : {"dose.dcm", "seg.dcm"}) {
    EXPECT_EQ(read_text(kase.scratch / "a" / name), read_text(kase.scratch / "b" / name)) << name;
    for (const DcmTagKey& tag : {DCM_SeriesInstanceUID, DCM_SOPInstanceUID}) {
      std::vector<std::string> uids;
      for (const std::string folder : {"a", "nearest", "own"})
        uids.push_back(attribute(kase.scratch / folder / name, tag));
      std::sort(uids.begin(), uids.end());
      EXPECT_EQ(std::unique(uids.begin(), uids.end()), uids.end()) << name;
    }
    EXPECT_EQ(attribute(kase.scratch / "a" / name, DCM_StudyDate), "20200102");
    EXPECT_TRUE(attribute(kase.scratch / "a" / name, DCM_SeriesDescription).starts_with("deformed: ")) << name;
    EXPECT_TRUE(is_tetwarp_dicom(kase.scratch / "a" / name));
  }
  EXPECT_EQ(attribute(kase.scratch / "a" / "dose.dcm", DCM_SeriesNumber), "1014");
  EXPECT_EQ(attribute(kase.scratch / "a" / "dose.dcm", DCM_SpatialTransformOfDose), "NON_RIGID");
}

TEST(Along, OfAnotherStudyTheObjectGoesIntoTheStudyOfTheSeries) {
  const AlongCase kase;
  kase.write_ct([](MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_StudyDate, "20210304"); };
  });
  MadeSeg seg = AlongCase::seg();
  seg.study = "1.2.77";
  seg.write(kase.scratch / "seg.dcm");
  kase.run("deform ct -f identity -o out --with seg.dcm=x.dcm");
  EXPECT_EQ(attribute(kase.scratch / "x.dcm", DCM_StudyInstanceUID), "1.2");
  EXPECT_EQ(attribute(kase.scratch / "x.dcm", DCM_StudyDate), "20210304");
  EXPECT_EQ(attribute(kase.scratch / "x.dcm", DCM_StudyID), "");
}

TEST(Along, NothingThatIsPrintedOrWrittenBesideNamesThePatient) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  const std::string said = kase.said(
      "deform ct -f identity -o out --with dose.dcm=x.dcm --with seg.dcm=y.dcm --report report.json --verbose", 0);
  for (const std::string& text : {said, read_text(kase.scratch / "out.json"), read_text(kase.scratch / "report.json")})
    EXPECT_EQ(text.find("SECRET"), std::string::npos) << text;
  EXPECT_EQ(attribute(kase.scratch / "x.dcm", DCM_PatientID), "SECRET-ID");
}

}  // namespace
