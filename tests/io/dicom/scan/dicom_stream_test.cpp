// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Where DCMTK finds the values of a file: in it, in memory, in what was deflated.
#include <gtest/gtest.h>

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcxfer.h>

#include "io/dicom/scan/dicom_headers.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

class DicomStream : public testing::TestWithParam<E_TransferSyntax> {};

/// Longer than what DCMTK reads at once, and another one in each slice.
std::string long_text(int k) {
  std::string text = "0";
  while (text.size() < 10000) text += " " + std::to_string(text.size() * 31 + k);
  return text;
}

TEST_P(DicomStream, LongValuesAreThoseOfTheirOwnSliceEvenWhenTheFilesAreGone) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    slice.encoding = GetParam();
    slice.edit = [k](DcmDataset& data) { data.putAndInsertString(DCM_TextValue, long_text(k).c_str()); };
  });
  const DicomVolume loaded = load_dicom(scan_dicom(folder.path()).series.front(), 1);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) std::filesystem::remove(entry);
  ASSERT_EQ(loaded.headers->slices.size(), 5U);
  for (int k = 0; k < 5; ++k) {
    OFString text;
    ASSERT_TRUE(loaded.headers->slices[k]->findAndGetOFStringArray(DCM_TextValue, text).good()) << k;
    EXPECT_TRUE(text == long_text(k).c_str()) << k << " has " << text.size() << " characters";
  }
}

TEST_P(DicomStream, FileCutAnywhereIsNotRead) {
  const Scratch folder;
  MadeSlice slice;
  slice.encoding = GetParam();
  write_slice(folder / "whole.dcm", slice);
  const std::string bytes = read_bytes(folder / "whole.dcm");
  std::filesystem::remove(folder / "whole.dcm");
  for (std::size_t size = 0; size + 2 <= bytes.size(); size += 3) {
    write_file(folder / "slice.dcm", bytes.substr(0, size));
    const DicomScan scan = scan_dicom(folder.path());
    if (scan.series.empty()) continue;
    EXPECT_THROW(load_dicom(scan.series.front(), 1), InputError) << size << " bytes of " << bytes.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Syntax, DicomStream,
                         testing::Values(EXS_LittleEndianImplicit, EXS_LittleEndianExplicit, EXS_BigEndianExplicit,
                                         EXS_DeflatedLittleEndianExplicit));

}  // namespace
}  // namespace tetwarp
