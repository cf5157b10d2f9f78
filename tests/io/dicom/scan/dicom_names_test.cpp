// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Folders and headers as an enemy would make them.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

bool is_printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= ' ' && c != 0x7f; });
}

/// Every text of a scan that a program may print.
std::vector<std::string> texts_of(const DicomScan& scan) {
  std::vector<std::string> texts;
  for (const LeftOutFile& one : scan.skipped) texts.push_back(to_string(one));
  for (const DicomSeries& series : scan.series) {
    texts.insert(texts.end(), {series.refusal.value_or(""), series.label, series.split_by, series.description});
    texts.insert(texts.end(), series.warnings.begin(), series.warnings.end());
    for (const LeftOutFile& one : series.set_aside) texts.push_back(to_string(one));
  }
  return texts;
}

TEST(HostileFolder, PipesSocketsAndDevicesAreNamedAndNeverOpened) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  ASSERT_EQ(mkfifo((folder / "pipe.dcm").c_str(), 0600), 0);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());  // the name of a socket has 107 characters at most
  std::snprintf(address.sun_path, sizeof address.sun_path, "socket.dcm");
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  fs::current_path(before);
  fs::create_symlink("/dev/zero", folder / "zero.dcm");
  fs::create_symlink("me", folder / "me");
  const DicomScan scan = scan_dicom(folder.path());
  ::close(socket);
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].refusal, std::nullopt);
  ASSERT_EQ(scan.skipped.size(), 4u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"me: cannot be read: "}));
  for (int n = 1; n < 4; ++n) EXPECT_TRUE(says(scan.skipped[n].reason, {"not a regular file"}));
  EXPECT_THROW(scan_dicom(folder / "pipe.dcm"), InputError);
}

TEST(HostileFolder, AFolderThatCannotBeReadIsNamed) {
  if (::geteuid() == 0) GTEST_SKIP() << "nothing is unreadable for root";
  const Scratch folder;
  write_stack(folder.path(), 3);
  fs::create_directory(folder / "closed");
  fs::permissions(folder / "closed", fs::perms::none);
  const DicomScan scan = scan_dicom(folder.path());
  fs::permissions(folder / "closed", fs::perms::owner_all);
  ASSERT_EQ(scan.skipped.size(), 1u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"closed: cannot be read: "}));
  EXPECT_EQ(scan.series.at(0).refusal, std::nullopt);
}

TEST(HostileFolder, NamesOfAnyBytesAreReadAndShownSpelledOut) {
  const Scratch folder;
  const std::string odd = "l1\nl2 \xff\x1b[2J\xe2\x80\xae";
  write_stack(folder / odd, 4);
  write_file(folder / (odd + "/junk\n"), "not an image at all");
  fs::copy_file(folder / odd / "s01.dcm", folder / odd / "s01\t.dcm");
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 4u);
  for (const std::string& text : texts_of(scan)) EXPECT_TRUE(is_printable(text)) << text;
  EXPECT_TRUE(says(to_string(scan.skipped.at(0)), {"l1\\x0al2 \\xff\\x1b[2J\\xe2\\x80\\xae/junk\\x0a: not DICOM"}));
  EXPECT_NO_THROW(load_dicom(scan.series[0]));
  fs::remove(folder / odd / "s02.dcm");
  const DicomScan uneven = scan_dicom(folder / odd / "s01.dcm");
  EXPECT_TRUE(is_printable(uneven.series.at(0).uneven.value_or("\n")));
}

TEST(HostileHeader, UidsOfAnyKindAreTextAndNothingElse) {
  const Scratch folder;
  const std::vector<std::string> uids = {
      "../../x", "a/b", "\x1b[31mred", "1.2\n3", std::string(10000, '7'), std::string(9999, '7') + "8"};
  for (std::size_t n = 0; n < uids.size(); ++n) {
    write_stack(folder / std::to_string(n), 4, [&](int k, MadeSlice& slice) {
      slice.series = slice.study = slice.frame = uids[n];
      slice.sop_instance = uids[n] + std::to_string(k);
      slice.image_type = "ORIGINAL\\" + uids[n].substr(0, 16);
      slice.position = position_text(k == 1 ? 99 : -10, -20, k);  // refused, so that names and values are told
    });
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), uids.size()) << "long ones are told apart";
  for (const DicomSeries& series : scan.series) {
    EXPECT_TRUE(series.refusal);
    EXPECT_LT(series.series_uid.size(), 200u);
  }
  for (const std::string& text : texts_of(scan)) EXPECT_TRUE(is_printable(text)) << text;
}

TEST(HostileHeader, ALongUidLoadsAndWritesUnderInstanceNumbersAlone) {
  const Scratch folder;
  write_stack(folder / "in", 4, [](int k, MadeSlice& slice) {
    slice.series = slice.study = "../../" + std::string(1000, 'x');
    slice.sop_instance = "../" + std::string(1000, 'y') + std::to_string(k);
  });
  const DicomVolume loaded = load_dicom(scan_dicom(folder / "in").series.at(0));
  fs::create_directory(folder / "out");
  DicomDerivation derivation;
  derivation.field_sha256 = std::string(64, '0');
  write_derived_series(folder / "out", view(loaded.volume), *loaded.headers, derivation);
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    if (entry.path().parent_path() != folder / "in") names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"IM00001.dcm", "IM00002.dcm", "IM00003.dcm", "IM00004.dcm", "in", "out"}));
}

TEST(HostileHeader, ValuesOfAnyLengthTakeBoundedMemory) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int, MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) {
      const std::string text(600000, 'w');
      for (const DcmTagKey& tag : {DCM_SeriesDescription, DCM_ImageComments, DCM_ConvolutionKernel, DCM_ImageType})
        data.putAndInsertString(tag, text.c_str());
    };
  });
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_LE(scan.series[0].description.size(), 256u);
}

TEST(HostileSeries, ManyOrientationsEndSoon) {
  const Scratch folder;
  fs::create_directories(folder.path());
  for (int k = 0; k < 300; ++k) {
    MadeSlice slice;
    const double angle = 0.01 * k;
    slice.orientation =
        position_text(std::cos(angle), std::sin(angle), 0) + "\\" + position_text(-std::sin(angle), std::cos(angle), 0);
    slice.sop_instance = "1.2.3." + std::to_string(k);
    write_slice(folder / (std::to_string(k) + ".dcm"), slice);
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_TRUE(says(scan.series[0].refusal.value_or("accepted"), {"mixed orientations"}));
}

}  // namespace
}  // namespace tetwarp
