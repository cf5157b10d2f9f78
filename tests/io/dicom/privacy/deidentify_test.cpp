// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What de-identification does beyond the table of the standard, and its options and key.
#include "io/dicom/privacy/dicom_deidentify.h"

#include <chrono>

#include "deform/errors.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/hash.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::test {
namespace {

using enum ConfidentialityOption;

Deidentification keyed(int key, std::set<ConfidentialityOption> options = {}) {
  return {.key = std::vector<std::byte>(32, static_cast<std::byte>(key)), .options = std::move(options)};
}

/// A data set with one attribute, afterwards.
std::string after(const DcmTagKey& tag, const std::string& value, const Deidentification& how = keyed(1),
                  const std::string& patient = "ID17") {
  DcmDataset dataset;
  set(dataset, tag, value);
  Deidentifier(how, patient, "1.2.3").apply(dataset, true);
  return get(dataset, tag);
}

TEST(Deidentify, UidsArePseudonymsOfTheKey) {
  const Deidentifier one(keyed(1), "ID17", "1.2.3"), again(keyed(1), "other", "1.2.9"),
      other(keyed(2), "ID17", "1.2.3");
  EXPECT_EQ(one.uid("1.2.3.4"), again.uid("1.2.3.4"));
  EXPECT_NE(one.uid("1.2.3.4"), one.uid("1.2.3.5"));
  EXPECT_NE(one.uid("1.2.3.4"), other.uid("1.2.3.4"));
  EXPECT_TRUE(one.uid("1.2.3.4").starts_with("2.25."));
  EXPECT_EQ(one.uid(""), "");
  EXPECT_EQ(one.uid("1.2.840.10008.1.2.1"), "1.2.840.10008.1.2.1");
  EXPECT_EQ(after(DCM_Manufacturer, "SCANNERS"), "SCANNERS");
  EXPECT_EQ(after(DCM_TargetFrameOfReferenceUID, "1.2.3.4"), one.uid("1.2.3.4")) << "not in the table";
  EXPECT_EQ(after(DCM_TargetFrameOfReferenceUID, "1.2.3.4", keyed(1, {retain_uids})), "1.2.3.4");
}

TEST(Deidentify, APatientKeepsOnePseudonymAsNameAndId) {
  DcmDataset dataset;
  set(dataset, DCM_PatientName, "NAME^GIVEN");
  set(dataset, DCM_PatientID, "ID17");
  Deidentifier(keyed(1), "ID17", "1.2.3").apply(dataset, true);
  const std::string pseudonym = get(dataset, DCM_PatientID);
  EXPECT_EQ(pseudonym.size(), 18U);
  EXPECT_TRUE(pseudonym.starts_with("TW"));
  EXPECT_EQ(get(dataset, DCM_PatientName), pseudonym);
  EXPECT_EQ(Deidentifier(keyed(1), "", "1.2.4").patient("ID17"), pseudonym);
  EXPECT_NE(Deidentifier(keyed(2), "ID17", "1.2.3").patient("ID17"), pseudonym);
  EXPECT_NE(Deidentifier(keyed(1), "ID18", "1.2.3").patient("ID18"), pseudonym);
}

TEST(Deidentify, DatesOfAPatientGoBackByTheSameDays) {
  const Deidentification how = keyed(3, {shift_dates});
  DcmDataset dataset;
  set(dataset, DCM_StudyDate, "20240301");
  set(dataset, DCM_SeriesDate, "20240229");
  set(dataset, DCM_AcquisitionDateTime, "20240302235959.123456+0100");
  set(dataset, DCM_StudyTime, "101112");
  set(dataset, DCM_PatientBirthDate, "19500101");
  Deidentifier(how, "ID17", "1.2.3").apply(dataset, true);
  const auto day = [](const std::string& text) {
    const std::chrono::year_month_day date{std::chrono::year(std::stoi(text.substr(0, 4))),
                                           std::chrono::month(static_cast<unsigned>(std::stoi(text.substr(4, 2)))),
                                           std::chrono::day(static_cast<unsigned>(std::stoi(text.substr(6, 2))))};
    return std::chrono::sys_days(date);
  };
  const auto study = day(get(dataset, DCM_StudyDate)), series = day(get(dataset, DCM_SeriesDate)),
             acquisition = day(get(dataset, DCM_AcquisitionDateTime));
  EXPECT_EQ((study - series).count(), 1);
  EXPECT_EQ((acquisition - study).count(), 1);
  const auto back = (day("20240301") - study).count();
  EXPECT_GE(back, 1);
  EXPECT_LE(back, 3650);
  EXPECT_EQ(get(dataset, DCM_AcquisitionDateTime).substr(8), "235959.123456+0100");
  EXPECT_EQ(get(dataset, DCM_StudyTime), "101112");
  EXPECT_EQ(get(dataset, DCM_PatientBirthDate), "") << "no option keeps it";
  EXPECT_EQ(get(dataset, DCM_LongitudinalTemporalInformationModified), "MODIFIED");
  EXPECT_NE(after(DCM_StudyDate, "20240301", how, "ID17"), after(DCM_StudyDate, "20240301", how, "ID18"));
  EXPECT_NE(after(DCM_StudyDate, "20240301", how), after(DCM_StudyDate, "20240301", keyed(4, {shift_dates})));
}

TEST(Deidentify, ADateThatIsNoneIsTreatedAsByTheBasicProfile) {
  const Deidentification how = keyed(3, {shift_dates});
  for (const char* wrong : {"2024", "2024.03.01", "20240231", "2024030x", "today", "20240301-20240302"})
    EXPECT_EQ(after(DCM_StudyDate, wrong, how), "") << wrong;
  EXPECT_EQ(after(DCM_AcquisitionDateTime, "202403", how), "<missing>");
}

TEST(Deidentify, WhatTheTableLeavesOutAndMayTellGoesToo) {
  EXPECT_EQ(after(DCM_PatientSpeciesDescription, "text"), "<missing>") << "a text about the patient";
  EXPECT_EQ(after(DCM_DetectorDescription, "free text"), "<missing>") << "free text";
  EXPECT_EQ(after(DCM_RetrieveURL, "http://host/path"), "<missing>");
  EXPECT_EQ(after(DcmTagKey(0x0040, 0x1006), "order"), "<missing>") << "a number of the order";
  EXPECT_EQ(after(DCM_DeviceID, "device"), "<missing>");
  EXPECT_EQ(after(DCM_DeviceID, "device", keyed(1, {retain_device})), "device");
  EXPECT_EQ(after(DCM_ConvolutionKernel, "B30f"), "B30f");
  EXPECT_EQ(after(DCM_KVP, "120"), "120");
}

TEST(Deidentify, WhatNobodyCanLookIntoGoes) {
  DcmDataset dataset;
  const auto insert = [&](const DcmTagKey& tag) {
    auto* element = new DcmOtherByteOtherWord(DcmTag(tag, EVR_UN));
    ASSERT_TRUE(element->putUint8Array(reinterpret_cast<const Uint8*>("SECRET"), 6).good());
    ASSERT_TRUE(dataset.insert(element, OFTrue).good());
  };
  insert(DCM_ConvolutionKernel);  // an attribute that is kept otherwise
  insert(DcmTagKey(0x0018, 0xfff0));
  insert(DcmTagKey(0x0019, 0x1001));
  dataset.insert(new DcmLongString(DcmTag(DcmTagKey(0x0018, 0xfff2), EVR_LO)), OFTrue);
  ASSERT_EQ(dataset.card(), 4U);
  Deidentifier(keyed(1, {retain_device}), "ID17", "1.2.3").apply(dataset, true);
  for (unsigned long n = 0; n < dataset.card(); ++n) {
    const Uint16 group = dataset.getElement(n)->getTag().getGroup();
    EXPECT_TRUE(group == 0x0012 || group == 0x0028) << dataset.getElement(n)->getTag().toString();
  }
}

TEST(Deidentify, SaysWhatWasDoneInCodesOfTheStandard) {
  DcmDataset dataset;
  Deidentifier(keyed(1, {retain_dates, retain_device}), "ID17", "1.2.3").apply(dataset, true);
  EXPECT_EQ(get(dataset, DCM_PatientIdentityRemoved), "YES");
  EXPECT_TRUE(
      says(get(dataset, DCM_DeidentificationMethod), {"Tetwarp ", "PS3.15 2026d Basic Profile", "retain-dates"}));
  ASSERT_EQ(items_of(dataset, DCM_DeidentificationMethodCodeSequence), 3U);
  const char* const codes[] = {"113100", "113106", "113109"};
  for (int n = 0; n < 3; ++n) {
    DcmItem& code = item_of(dataset, DCM_DeidentificationMethodCodeSequence, n);
    EXPECT_EQ(get(code, DCM_CodeValue), codes[n]);
    EXPECT_EQ(get(code, DCM_CodingSchemeDesignator), "DCM");
  }
  EXPECT_EQ(get(dataset, DCM_LongitudinalTemporalInformationModified), "UNMODIFIED");
  Deidentifier(keyed(1, {retain_device}), "ID17", "1.2.3").apply(dataset, true);  // a second time
  ASSERT_EQ(items_of(dataset, DCM_DeidentificationMethodCodeSequence), 2U) << "no code twice, and no dates";
  EXPECT_EQ(get(item_of(dataset, DCM_DeidentificationMethodCodeSequence, 1), DCM_CodeValue), "113109");
  EXPECT_EQ(get(dataset, DCM_LongitudinalTemporalInformationModified), "REMOVED");
}

std::string refusal_of(const std::string& options) {
  try {
    confidentiality_options(options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(DeidentifyOptions, AreWordsSeparatedByCommas) {
  EXPECT_EQ(confidentiality_options("basic"), std::set<ConfidentialityOption>());
  EXPECT_EQ(confidentiality_options("retain-device,shift-dates"), (std::set{retain_device, shift_dates}));
  for (const ConfidentialityOption option : kConfidentialityOptions)
    EXPECT_EQ(confidentiality_options(name_of(option)), std::set{option});
  EXPECT_TRUE(says(refusal_of("retain-everything"), {"unknown option", "retain-everything", "retain-dates"}));
  EXPECT_TRUE(says(refusal_of(""), {"unknown option"}));
  EXPECT_TRUE(says(refusal_of("basic,"), {"unknown option"}));
  EXPECT_TRUE(says(refusal_of("clean-descriptors"), {"clean-descriptors", "somebody who looks"}));
  EXPECT_TRUE(says(refusal_of("retain-safe-private"), {"private attributes are never carried"}));
  EXPECT_TRUE(says(refusal_of("retain-dates,shift-dates"), {"both"}));
}

TEST(DeidentifyKey, IsTheFileWithoutItsLastLineEnd) {
  const Scratch scratch;
  write_file(scratch / "key", "0123456789abcdef\n");
  EXPECT_EQ(read_deidentification_key(scratch / "key").size(), 16U);
  const auto refusal = [&](const std::string& text) -> std::string {
    write_file(scratch / "key", text);
    try {
      read_deidentification_key(scratch / "key");
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_TRUE(says(refusal("0123456789abcde\n\n"), {"15 bytes", "16 to 4096"}));
  EXPECT_TRUE(says(refusal(std::string(5000, 'x')), {"4096"}));
  EXPECT_THROW(read_deidentification_key(scratch / "none"), InputError);
  EXPECT_THROW(read_deidentification_key(scratch.path()), InputError);
}

TEST(KeyedDigest, IsHmacOfRfc4231) {
  const std::string key(20, '\x0b');  // test case 1
  const Sha256::Digest digest = keyed_digest(std::as_bytes(std::span(key)), "Hi There");
  EXPECT_EQ(std::to_integer<int>(digest[0]), 0xb0);
  EXPECT_EQ(std::to_integer<int>(digest[1]), 0x34);
  EXPECT_EQ(std::to_integer<int>(digest[31]), 0xf7);
}

}  // namespace
}  // namespace tetwarp::test
