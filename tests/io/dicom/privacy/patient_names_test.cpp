// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Which texts of a header name the patient, whatever their case, marks, alphabet and what they are glued to.
#include "io/dicom/privacy/patient_names.h"

#include <nlohmann/json.hpp>

#include "io/dicom/privacy/comparable_text.h"
#include "io/dicom_bids.h"
#include "io/dicom_series.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

/// A patient of whom a header says no more than this.
struct Patient {
  std::string name, id, character_set = "ISO_IR 192";

  bool is_in(const std::string& text) const {
    DcmDataset data;
    for (const auto& [tag, value] : {std::pair(DCM_SpecificCharacterSet, character_set),
                                     {DCM_PatientName, name},
                                     {DCM_PatientID, id},
                                     {DCM_PatientBirthDate, std::string("19500214")}})
      set(data, tag, value);
    return PatientNames(data).are_in(text);
  }
};

const char kMueller[] = "M\xc3\xbcller^J\xc3\xb6rg";

TEST(PatientNames, NameIsFoundInAnyCaseWithAnyMarks) {
  const Patient patient{kMueller, ""};
  for (const char* text :
       {"M\xc3\x9cLLER", "m\xc3\xbcller", "Mu\xcc\x88ller", "MU\xcc\x88LLER CT", "Muller", "MUELLER", "Abdomen MuEllER",
        "CT j\xc3\x96rg", "JOERG", "\xef\xbc\xad\xc3\xbcller", "M\xc3\xbc\xc2\xadller"})
    EXPECT_TRUE(patient.is_in(text)) << text;
  for (const char* text : {"Abdomen 2.5", "", "M\xc3\xbcll", "B30f", "HFS", "50"})
    EXPECT_FALSE(patient.is_in(text)) << text;
  EXPECT_TRUE((Patient{"MUELLER", ""}).is_in("M\xc3\xbcller"));
  EXPECT_TRUE((Patient{"GROSS^Stra\xc3\x9f", ""}).is_in("STRASS 3"));
  EXPECT_TRUE((Patient{"I\xc5\x9eIK", ""}).is_in("\xc4\xb1\xc5\x9f\xc4\xb1k"));  // dotless i
  EXPECT_TRUE((Patient{"S\xc3\xb8rensen", ""}).is_in("SOERENSEN"));
  EXPECT_TRUE((Patient{"\xce\xa0\xce\xb1\xcf\x82", ""}).is_in("\xce\xa0\xce\x91\xce\xa3"));  // final sigma
}

TEST(PatientNames, NameIsFoundGluedToWhateverAndTakenApart) {
  const Patient patient{"MUELLER^O'Brien Li", ""};
  for (const char* text : {"MUELLERCT", "ctmueller2", "XMUELLERX", "M-U-E-L-L-E-R", "M.ueller", "OBrien", "O Brien",
                           "obrienCT", "LiCT", "CT_LI", "CTLi", "li"})
    EXPECT_TRUE(patient.is_in(text)) << text;
  for (const char* text : {"clinical", "O", "Mue", "Mull"}) EXPECT_FALSE(patient.is_in(text)) << text;
}

TEST(PatientNames, EveryGroupOfANameIsFoundInItsOwnAlphabetAndInLatinLetters) {
  const Patient cyrillic{"\xd0\x98\xd0\xb2\xd0\xb0\xd0\xbd\xd0\xbe\xd0\xb2", ""};  // Ivanov
  EXPECT_TRUE(
      cyrillic.is_in("\xd0\x98\xd0\x92\xd0\x90\xd0\x9d\xd0\x9e\xd0\x92"
                     "CT"));
  EXPECT_TRUE(cyrillic.is_in("IVANOV"));
  EXPECT_TRUE((Patient{"Ivanov", ""}).is_in("\xd0\x98\xd0\xb2\xd0\xb0\xd0\xbd\xd0\xbe\xd0\xb2"));
  // Yamada^Tarou, ideographic and phonetic, PS3.5 H.3.1
  const Patient utf8{
      "Yamada^Tarou=\xe5\xb1\xb1\xe7\x94\xb0^\xe5\xa4\xaa\xe9\x83\x8e=\xe3\x82\x84\xe3\x81\xbe\xe3\x81\xa0", ""};
  EXPECT_TRUE(utf8.is_in("CT\xe5\xb1\xb1\xe7\x94\xb0"));
  EXPECT_TRUE(utf8.is_in("\xe3\x83\xa4\xe3\x83\x9e\xe3\x83\x80"));              // katakana
  EXPECT_TRUE(utf8.is_in("\xef\xbe\x94\xef\xbe\x8f\xef\xbe\x80\xef\xbe\x9e"));  // half-width characters
  EXPECT_TRUE(utf8.is_in("yamada"));
  EXPECT_FALSE(utf8.is_in("\xe8\x85\xb9\xe9\x83\xa8"));  // abdomen
  const Patient escapes{"Yamada^Tarou=\033$B;3ED\033(B^\033$BB@O:\033(B=\033$B$d$^$@\033(B^\033$B$?$m$&\033(B", "",
                        "\\ISO 2022 IR 87"};
  EXPECT_TRUE(escapes.is_in("CT \033$B;3ED\033(B"));
  EXPECT_TRUE(escapes.is_in("\033$B%d%^%@\033(B"));
  EXPECT_FALSE(escapes.is_in("\033$BJ\"It\033(B"));
}

TEST(PatientNames, CharacterSetDecodesBothAndAWrongOneHidesNothing) {
  for (const char* set : {"ISO_IR 100", "", "ISO_IR 192", "NO SUCH SET"}) {
    const Patient patient{"M\xfcller", "", set};
    EXPECT_TRUE(patient.is_in("M\xdcLLER")) << set;
    EXPECT_TRUE(patient.is_in("MUELLER")) << set;
  }
  EXPECT_TRUE((Patient{kMueller, "", "ISO_IR 100"}).is_in("M\xc3\x9cLLER"));
  EXPECT_TRUE((Patient{"\xb8\xd2\xd0\xdd\xde\xd2", "", "ISO_IR 144"}).is_in("\xb8\xb2\xb0\xbd\xbe\xb2"));
}

TEST(PatientNames, IdsOfAnyLengthAreFoundInAnyCase) {
  const auto found = [](const std::string& id, const std::string& text) { return (Patient{"", id}).is_in(text); };
  for (const auto& [id, text] : {std::pair("ab12cd", "scan AB12CDx"),
                                 {"ID17", "id 17"},
                                 {"ID-17", "ID17"},
                                 {"0042", "CT 42"},
                                 {"42", "CT42"},
                                 {"42", "p42a"},
                                 {"7", "no. 7"},
                                 {"A1", "xa1"},
                                 {"X", "series x"},
                                 {"AB", "abdomen"},
                                 {"\xc3\x84"
                                  "9",
                                  "\xc3\xa4"
                                  "9"},
                                 {"\xd9\xa1\xd9\xa2\xd9\xa3\xd9\xa4", "1234"}})
    EXPECT_TRUE(found(id, text)) << id << " in " << text;
  for (const auto& [id, text] : {std::pair("42", "CT 142"), {"42", "421"}, {"7", "70"}, {"X", "xyz"}, {"", "abdomen"}})
    EXPECT_FALSE(found(id, text)) << id << " in " << text;
}

TEST(PatientNames, OtherNamesOtherIdsAndBirthDateAreFound) {
  DcmDataset data;
  set(data, DCM_OtherPatientNames, "FORMER^ANNA\\SECOND");
  set(data, DCM_PatientBirthName, "MAIDEN");
  set(data, DcmTagKey(0x0010, 0x1000), "OLDID\\7788");
  set(data, DCM_PatientBirthDate, "19500214");
  set(data, DCM_ResponsiblePerson, "PARENT");
  DcmItem* other = nullptr;
  ASSERT_TRUE(data.findOrCreateSequenceItem(DCM_OtherPatientIDsSequence, other, 0).good());
  set(*other, DCM_PatientID, "LISTED9");
  const PatientNames patient(data);
  for (const char* text : {"Former", "second", "maidenCT", "oldid", "x7788", "listed9", "born 14.02.1950", "1950-02-14",
                           "14 Feb 1950", "february 14, 1950", "14.2.1950", "500214", "14FEB50", "parent"})
    EXPECT_TRUE(patient.are_in(text)) << text;
  for (const char* text : {"Abdomen 1950", "Feb 1950", "50214"}) EXPECT_FALSE(patient.are_in(text)) << text;
}

TEST(PatientNames, SidecarAndListOfSeriesLeaveSuchTextsOut) {
  DerivedSource source;
  source.set_all(DCM_SpecificCharacterSet, "ISO_IR 192");
  source.set_all(DCM_PatientName, kMueller);
  source.set_all(DCM_PatientID, "42");
  source.set_all(DCM_ProtocolName, "M\xc3\x9cLLERCT");
  source.set_all(DCM_SeriesDescription, "p42");
  source.set_all(DCM_ImageType, "ORIGINAL\\PRIMARY\\AXIAL\\MUELLER");
  const nlohmann::json found =
      nlohmann::json::parse(bids_sidecar(source.headers, source.volume.geometry, source.derivation));
  EXPECT_FALSE(found.contains("ProtocolName"));
  EXPECT_FALSE(found.contains("SeriesDescription"));
  EXPECT_EQ(found["ImageType"], nlohmann::json({"DERIVED", "SECONDARY", "AXIAL"}));
  EXPECT_EQ(found["BodyPartExamined"], "ABDOMEN");
  set(*source.headers.slices.back(), DCM_OtherPatientNames, "ABDOMEN");  // a name that no other slice has
  EXPECT_FALSE(nlohmann::json::parse(bids_sidecar(source.headers, source.volume.geometry, source.derivation))
                   .contains("BodyPartExamined"));

  const Scratch folder;
  for (int n = 0; n < 3; ++n) {
    MadeSlice slice;
    slice.instance_number = n + 1;
    slice.sop_instance = "1.2.3." + std::to_string(n + 1);
    slice.position = "-10\\-20\\" + std::to_string(n);
    slice.edit = [n](DcmDataset& data) {
      data.putAndInsertString(DCM_SpecificCharacterSet, "ISO_IR 192");
      data.putAndInsertString(DCM_PatientName, n == 0 ? "ANON" : kMueller);
      data.putAndInsertString(DCM_SeriesDescription, "CT M\xc3\x9cLLER");
      data.putAndInsertString(DCM_Modality, "MUELLER");
      data.putAndInsertString(DCM_RescaleType, "MUELLER");
      data.putAndInsertString(DCM_KVP, n == 0 ? "120" : "MUELLER");
    };
    write_slice(folder / ("s" + std::to_string(n)), slice);
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  const DicomSeries& series = scan.series.front();
  std::string texts =
      series.description + "|" + series.modality + "|" + series.label + "|" + series.refusal.value_or("");
  for (const std::string& warning : series.warnings) texts += "|" + warning;
  EXPECT_NE(texts.find("KVP"), std::string::npos) << texts;
  EXPECT_NE(texts.find("Rescale Type is no known value"), std::string::npos) << texts;
  for (const char* word : {"M\xc3\x9cLLER", "MUELLER"}) EXPECT_EQ(texts.find(word), std::string::npos) << texts;
}

TEST(PatientNames, ARefusalShowsNoCodeThatTheStandardDoesNotDefine) {
  const auto refusal = [](const std::function<void(DcmDataset&)>& edit) {
    const Scratch folder;
    MadeSlice slice;
    slice.edit = edit;
    write_slice(folder / "slice", slice);
    const DicomScan scan = scan_dicom(folder.path());
    return scan.series.empty() ? std::string() : scan.series.front().refusal.value_or("");
  };
  const std::string colour =
      refusal([](DcmDataset& data) { data.putAndInsertString(DCM_PhotometricInterpretation, "MUELLER"); });
  EXPECT_NE(colour.find("found no known value"), std::string::npos) << colour;
  EXPECT_EQ(colour.find("MUELLER"), std::string::npos) << colour;
  const std::string packed = refusal([](DcmDataset& data) {
    delete data.remove(DCM_PixelData);
    data.putAndInsertString(DcmTag(0x07a1, 0x0010, EVR_LO), "ELSCINT1");
    data.putAndInsertString(DcmTag(0x07a1, 0x1011, EVR_CS), "MUELLER");
  });
  EXPECT_NE(packed.find("private compression no known value"), std::string::npos) << packed;
  EXPECT_EQ(packed.find("MUELLER"), std::string::npos) << packed;
}

}  // namespace
}  // namespace tetwarp::test
