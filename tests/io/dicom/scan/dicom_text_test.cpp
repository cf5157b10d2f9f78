// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Text from files, as messages show it.
#include <gtest/gtest.h>

#include "io/dicom/scan/dicom_charset.h"
#include "io/dicom_series.h"
#include "io/shown_text.h"
#include "tests/support/dicom/dicom_edit.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

TEST(ShownText, KeepsTextAndSpellsOutWhatATerminalWouldObey) {
  EXPECT_EQ(shown("plain \\ text, 5 mm"), "plain \\ text, 5 mm");
  EXPECT_EQ(shown("\xc3\xa4 \xe5\xb1\xb1 \xf0\x9f\xab\x80"), "\xc3\xa4 \xe5\xb1\xb1 \xf0\x9f\xab\x80");
  EXPECT_EQ(shown("a\nb\tc\r\x1b[31m\x7f"), "a\\x0ab\\x09c\\x0d\\x1b[31m\\x7f");
  EXPECT_EQ(shown(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(shown("\xc2\x9b"
                  "31m"),
            "\\xc2\\x9b31m")
      << "C1 control";
  EXPECT_EQ(shown("a\xe2\x80\xae"
                  "b"),
            "a\\xe2\\x80\\xae"
            "b")
      << "right-to-left override";
  EXPECT_EQ(shown("\xe2\x80\xa8"), "\\xe2\\x80\\xa8") << "line separator";
  EXPECT_EQ(shown_lines("a\nb\r"), "a\nb\\x0d");
}

TEST(ShownText, SpellsOutBytesThatAreNoUtf8) {
  EXPECT_EQ(shown("\xff"), "\\xff");
  EXPECT_EQ(shown("M\xfcller"), "M\\xfcller");
  EXPECT_EQ(shown("\xc0\xaf"), "\\xc0\\xaf") << "too long";
  EXPECT_EQ(shown("\xe0\x80\xaf"), "\\xe0\\x80\\xaf") << "too long";
  EXPECT_EQ(shown("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "surrogate";
  EXPECT_EQ(shown("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond Unicode";
  EXPECT_EQ(shown("\xe5\xb1"), "\\xe5\\xb1") << "cut short";
}

TEST(CharacterSets, RealFilesReadAsPydicomReadsThem) {
  TETWARP_REAL_DATA(folder, "odd-files/charset");
  const std::vector<std::pair<std::string, std::string>> names = {
      {"chrArab.dcm", "قباني^لنزار"},
      {"chrFrenMulti.dcm", "Buc^Jérôme"},
      {"chrGerm.dcm", "Äneas^Rüdiger"},
      {"chrGreek.dcm", "Διονυσιος"},
      {"chrH31.dcm", "Yamada^Tarou=山田^太郎=やまだ^たろう"},
      {"chrJapMulti.dcm", "やまだ^たろう"},
      {"chrKoreanMulti.dcm", "김희중"},
      {"chrRuss.dcm", "Люкceмбypг"},
      {"chrX1.dcm", "Wang^XiaoDong=王^小東="},
      {"chrX2.dcm", "Wang^XiaoDong=王^小东="}};
  for (const auto& [name, expected] : names) {
    DcmFileFormat format;
    ASSERT_TRUE(format.loadFile((folder / name).c_str()).good());
    DcmDataset& data = *format.getDataset();
    EXPECT_EQ(shown_text(text_value(data, DCM_PatientName), text_value(data, DCM_SpecificCharacterSet)), expected);
  }
}

TEST(CharacterSets, WhatIsNotInTheSetThatAFileNamesIsSpelledOut) {
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       ""),
            "Sch\\xe4"
            "del");
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       "ISO_IR 100"),
            "Schädel");
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       "ISO_IR 192"),
            "Sch\\xe4"
            "del");
  EXPECT_EQ(shown_text("Sch\xe4"
                       "del",
                       "no such set"),
            "Sch\\xe4"
            "del");
  EXPECT_EQ(shown_text("Sch\xc3\xa4"
                       "del",
                       "ISO_IR 192"),
            "Schädel");
  EXPECT_EQ(shown_text("\x1b$B;3ED\x1b(B", ""), "\\x1b$B;3ED\\x1b(B");
  EXPECT_EQ(shown_text("plain", "no such set"), "plain");
}

/// A stack with this description, as the scan shows it.
std::string description_of(const std::string& bytes, const std::string& character_set) {
  const Scratch folder;
  write_stack(folder.path(), 3, [&](int, MadeSlice& slice) {
    slice.edit = [&](DcmDataset& data) {
      data.putAndInsertString(DCM_SpecificCharacterSet, character_set.c_str());
      data.putAndInsertString(DCM_SeriesDescription, bytes.c_str());
    };
  });
  return scan_dicom(folder.path()).series.at(0).description;
}

TEST(CharacterSets, SeriesDescriptionsAreShownInUtf8) {
  EXPECT_EQ(description_of("Sch\xe4"
                           "del nativ",
                           "ISO_IR 100"),
            "Schädel nativ");
  EXPECT_EQ(description_of("\x1b$B6;It\x1b(B CT", "\\ISO 2022 IR 87"), "胸部 CT");
  EXPECT_EQ(description_of("\xd0\xd8\xb2\xbf", "GB18030"), "胸部");
  EXPECT_EQ(description_of("\xe8\x83\xb8", "ISO_IR 192"), "胸");
  EXPECT_EQ(description_of("\xe8\x83\xb8 \xff", "ISO_IR 999"), "胸 \\xff");
  EXPECT_EQ(description_of("\xb1\xb2 \x1b$B6;\x1b(J", "ISO 2022 IR 13\\ISO 2022 IR 87"), "ｱｲ 胸");
  EXPECT_EQ(description_of("\x1b$(D0!\x1b(B", "\\ISO 2022 IR 159"), "丂");
  EXPECT_EQ(description_of("\x1b$X6;", "\\ISO 2022 IR 87"), "\\x1b$X6;");
}

TEST(CharacterSets, PhasesAreFoundInTextOfSeveralBytesACharacter) {
  const Scratch folder;
  for (const int phase : {0, 50}) {
    write_stack(folder / std::to_string(phase), 4, [phase](int k, MadeSlice& slice) {
      slice.sop_instance = "1.2." + std::to_string(phase) + "." + std::to_string(k);
      slice.edit = [phase](DcmDataset& data) {
        // In the bytes of "コツ" there is "3%".
        const std::string text = "\x1b$B%3%D\x1b(B " + std::to_string(phase) + "%";
        data.putAndInsertString(DCM_SpecificCharacterSet, "\\ISO 2022 IR 87");
        data.putAndInsertString(DCM_SeriesDescription, text.c_str());
      };
    });
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 2u);
  EXPECT_EQ(scan.series[0].label, "phase 0 %");
  EXPECT_EQ(scan.series[1].label, "phase 50 %");
  EXPECT_EQ(scan.series[1].description, "コツ 50%");
}

}  // namespace
}  // namespace tetwarp
