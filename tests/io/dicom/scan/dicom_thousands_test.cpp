// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Folders of many files: each is opened once, of no image more than its beginning is read.
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <map>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// Counts how often the files of a folder are opened, as the system sees it.
class OpenCount {
 public:
  explicit OpenCount(const fs::path& folder)
      : queue_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)),
        watch_(::inotify_add_watch(queue_, folder.c_str(), IN_OPEN)) {}
  ~OpenCount() { ::close(queue_); }
  OpenCount(const OpenCount&) = delete;
  OpenCount& operator=(const OpenCount&) = delete;

  bool works() const { return queue_ >= 0 && watch_ >= 0; }
  std::map<std::string, int> opened() {
    std::map<std::string, int> opened;
    alignas(inotify_event) std::array<char, 1 << 16> buffer;
    for (ssize_t bytes; (bytes = ::read(queue_, buffer.data(), buffer.size())) > 0;) {
      for (const char* at = buffer.data(); at < buffer.data() + bytes;) {
        const auto* event = reinterpret_cast<const inotify_event*>(at);
        if ((event->mask & IN_Q_OVERFLOW) != 0) ++opened["overflow"];
        if (event->len > 0) ++opened[event->name];
        at += sizeof(inotify_event) + event->len;
      }
    }
    return opened;
  }

 private:
  int queue_, watch_;
};

/// Bytes that this process has read from files so far.
std::uint64_t bytes_read() {
  std::ifstream io("/proc/self/io");
  std::string key;
  std::uint64_t value = 0;
  while (io >> key >> value) {
    if (key == "rchar:") return value;
  }
  return 0;
}

TEST(ManyFiles, EachIsOpenedOnceWhateverItIs) {
  constexpr int kSlices = 2000, kJunk = 50;
  const Scratch folder;
  MadeSlice slice;
  for (int k = 0; k < kSlices; ++k) {
    slice.series = "1.2.3." + std::to_string(k % 20);
    slice.position = position_text(-10, -20, k / 20);
    slice.sop_instance = "1.2.4." + std::to_string(k);
    write_slice(folder / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  for (int k = 0; k < kJunk; ++k) write_file(folder / ("junk" + std::to_string(k)), std::string(100, 'x'));
  OpenCount count(folder.path());
  if (!count.works()) GTEST_SKIP() << "no inotify on this system";
  const DicomScan scan = scan_dicom(folder.path());
  const std::map<std::string, int> opened = count.opened();
  EXPECT_EQ(scan.files, std::size_t{kSlices + kJunk});
  ASSERT_EQ(scan.series.size(), 20u);
  for (const DicomSeries& series : scan.series) EXPECT_EQ(series.slices.size(), 100u);
  EXPECT_EQ(opened.size(), std::size_t{kSlices + kJunk});
  for (const auto& [name, times] : opened) EXPECT_EQ(times, 1) << name;
}

TEST(ManyFiles, OfALargeFileThatIsNoImageTheBeginningAloneIsRead) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  for (const char* name : {"scan.nii", "backup.zip", "film.dcm"}) {
    write_file(folder / name, "no DICOM");
    fs::resize_file(folder / name, std::uint64_t{1} << 30);
  }
  if (bytes_read() == 0) GTEST_SKIP() << "no /proc/self/io on this system";
  const std::uint64_t before = bytes_read();
  const DicomScan scan = scan_dicom(folder.path());
  EXPECT_LT(bytes_read() - before, std::uint64_t{1} << 17);
  EXPECT_EQ(scan.skipped.size(), 3u);
}

TEST(ManyFiles, OfASliceItsHeaderAloneIsRead) {
  const Scratch folder;
  write_stack(folder.path(), 4, [](int, MadeSlice& slice) { slice.rows = slice.columns = 1024; });
  if (bytes_read() == 0) GTEST_SKIP() << "no /proc/self/io on this system";
  const std::uint64_t before = bytes_read();
  EXPECT_EQ(scan_dicom(folder.path()).series.at(0).refusal, std::nullopt);
  EXPECT_LT(bytes_read() - before, std::uint64_t{1} << 17) << "4 slices of 2 MiB";
}

#ifndef __SANITIZE_ADDRESS__  // which holds on to memory that was given back
TEST(ManyScans, TakeNoMoreMemoryThanTheFirstOnes) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  const auto resident_kib = [] {
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return pages * (::sysconf(_SC_PAGESIZE) / 1024);
  };
  constexpr int kFirst = 50, kScans = 500;
  long before = 0;
  for (int n = 0; n < kFirst + kScans; ++n) {
    if (n == kFirst) before = resident_kib();
    ASSERT_EQ(scan_dicom(folder.path()).series.size(), 1u);
  }
  EXPECT_LT(resident_kib() - before, kScans) << "KiB; a scan may leave less than one";
}
#endif

}  // namespace
}  // namespace tetwarp
