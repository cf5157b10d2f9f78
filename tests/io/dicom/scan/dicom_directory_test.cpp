// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A DICOMDIR as input.
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// A DICOMDIR whose IMAGE records name these files; a '!' before a name makes its record one that is not in use.
void write_directory(const fs::path& path, const std::vector<std::string>& file_ids,
                     const std::string& type = "IMAGE") {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  data.putAndInsertString(DCM_SOPClassUID, UID_MediaStorageDirectoryStorage);
  data.putAndInsertString(DCM_SOPInstanceUID, "1.2.3.99");
  data.putAndInsertString(DCM_FileSetID, "TEST");
  for (const std::string& id : file_ids) {
    const bool in_use = !id.starts_with('!');
    DcmItem* record = nullptr;
    data.findOrCreateSequenceItem(DCM_DirectoryRecordSequence, record, -2);
    record->putAndInsertUint16(DCM_RecordInUseFlag, in_use ? 0xffff : 0);
    record->putAndInsertString(DCM_DirectoryRecordType, type.c_str());
    record->putAndInsertString(DCM_ReferencedFileID, id.substr(in_use ? 0 : 1).c_str());
  }
  if (format.saveFile(path.c_str(), EXS_LittleEndianExplicit).bad()) throw std::runtime_error("cannot write DICOMDIR");
}

TEST(DicomDirectory, ItsFilesAreReadAndNoOthers) {
  const Scratch folder;
  write_stack(folder / "IMAGES", 5);
  write_directory(folder / "DICOMDIR", {"IMAGES\\s00.dcm", "IMAGES\\s01.dcm", "IMAGES\\S02.DCM", "!IMAGES\\s03.dcm"});
  const DicomScan scan = scan_dicom(folder / "DICOMDIR");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].refusal, std::nullopt);
  EXPECT_EQ(scan.series[0].slices.size(), 2u) << "names are those of the disk, or in lower case";
  fs::rename(folder / "IMAGES", folder / "images");
  EXPECT_EQ(scan_dicom(folder / "DICOMDIR").series.at(0).slices.size(), 3u);
}

TEST(DicomDirectory, AFolderIsReadWhateverItsDicomdirNames) {
  const Scratch folder;
  write_stack(folder / "images", 5);
  write_directory(folder / "DICOMDIR", {"images\\s00.dcm", "gone"});
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 5u);
  ASSERT_EQ(scan.skipped.size(), 1u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"DICOMDIR: a DICOM directory", "what lies in the folder counts"}));
}

TEST(DicomDirectory, AMissingFileRefusesTheSeriesBesideWhichItWas) {
  const Scratch folder;
  write_stack(folder / "a", 4);
  write_stack(folder / "b", 4, [](int, MadeSlice& slice) { slice.series = "1.9"; });
  std::vector<std::string> ids;
  for (const char* sub : {"a\\", "b\\"}) {
    for (const char* name : {"s00.dcm", "s01.dcm", "s02.dcm", "s03.dcm"}) ids.push_back(std::string(sub) + name);
  }
  fs::remove(folder / "b/s03.dcm");
  write_directory(folder / "DICOMDIR", ids);
  const DicomScan scan = scan_dicom(folder / "DICOMDIR");
  ASSERT_EQ(scan.series.size(), 2u);
  EXPECT_EQ(scan.series[0].refusal, std::nullopt);
  EXPECT_TRUE(
      says(scan.series[1].refusal.value_or("accepted"), {"missing, although a DICOMDIR names it", "b/s03.dcm"}));
  ASSERT_EQ(scan.skipped.size(), 1u);
}

TEST(DicomDirectory, HostileNamesNeverLeaveTheFolder) {
  const Scratch folder;
  write_stack(folder / "outside", 3);
  write_stack(folder / "disk/in", 3, [](int, MadeSlice& slice) { slice.series = "1.9"; });
  const std::string absolute = (folder / "outside/s00.dcm").string();
  std::string parts = absolute;
  std::replace(parts.begin(), parts.end(), '/', '\\');
  write_directory(folder / "disk/DICOMDIR", {"..\\outside\\s00.dcm", "in\\..\\..\\outside\\s01.dcm", absolute, parts,
                                             "../outside/s02.dcm", "in\\.\\s00.dcm", "in\\\\s00.dcm",
                                             "in\\s00.dcm\x1b[31m", "in\\s00.dcm\n", "in\\s00.dcm", "in\\s01.dcm"});
  const DicomScan scan = scan_dicom(folder / "disk/DICOMDIR");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].series_uid, "1.9");
  EXPECT_EQ(scan.series[0].slices.size(), 2u);
  EXPECT_EQ(scan.skipped.size(), 9u);
  for (const LeftOutFile& one : scan.skipped) {
    EXPECT_TRUE(says(one.reason, {"is no name of a file"}));
    EXPECT_EQ(to_string(one).find_first_of("\x1b\n"), std::string::npos);
  }
}

TEST(DicomDirectory, DirectoriesThatNameEachOtherEnd) {
  const Scratch folder;
  write_stack(folder / "images", 3);
  write_directory(folder / "DICOMDIR", {"DICOMDIR", "images\\DIR"});
  write_directory(folder / "images/DIR", {"s00.dcm", "s01.dcm", "s02.dcm", "DIR"});
  const DicomScan scan = scan_dicom(folder / "DICOMDIR");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 3u);
  EXPECT_TRUE(scan.skipped.empty());
}

TEST(DicomDirectory, ADamagedOneIsRefusedByNameAndAnEmptyOneHoldsNothing) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  write_directory(folder / "EMPTY", {});
  EXPECT_TRUE(scan_dicom(folder / "EMPTY").series.empty());
  write_directory(folder / "DICOMDIR", {"s00.dcm", "s01.dcm"});
  fs::resize_file(folder / "DICOMDIR", fs::file_size(folder / "DICOMDIR") - 9);
  try {
    scan_dicom(folder / "DICOMDIR");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"damaged DICOMDIR", "DICOMDIR:", "give its folder"}));
  }
}

TEST(DicomDirectory, ATypeOfRecordThatDcmtkThrowsAtIsDamage) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  write_directory(folder / "DICOMDIR", {"s00.dcm", "s01.dcm"}, "MORE THAN TWICE THE SIXTEEN BYTES OF A TYPE");
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 3u);
  EXPECT_EQ(scan.skipped.size(), 1u);
  try {
    scan_dicom(folder / "DICOMDIR");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"damaged DICOMDIR", "Directory Record Type (0004,1430) of more than 16 bytes",
                                    "give its folder"}));
  }
}

TEST(RealDirectory, NamesOfCopiedMediaAreFoundBelowTheDirectory) {
  TETWARP_REAL_DATA(folder, "head-phantom-multiseries");
  const DicomScan one = scan_dicom(folder / "S21570/S2020/DIRFILE");
  ASSERT_EQ(one.series.size(), 1u);
  EXPECT_EQ(one.series[0].refusal, std::nullopt);
  EXPECT_EQ(one.series[0].slices.size(), 140u);
  EXPECT_TRUE(one.skipped.empty());
}

TEST(RealDirectory, DirectoriesOfAnExamLeadToAllItsSeriesButTheOneThatIsMissing) {
  TETWARP_REAL_DATA(folder, "head-phantom-multiseries");
  const DicomScan exam = scan_dicom(folder / "S21570/DIRFILE");
  ASSERT_EQ(exam.series.size(), 4u);
  EXPECT_EQ(exam.series[1].slices.size(), 28u);
  EXPECT_EQ(exam.series[2].slices.size(), 140u);
  EXPECT_EQ(exam.series[2].refusal, std::nullopt);
  ASSERT_EQ(exam.skipped.size(), 1u);
  EXPECT_TRUE(says(to_string(exam.skipped[0]), {"S2030/DIRFILE: missing"}));
}

}  // namespace
}  // namespace tetwarp
