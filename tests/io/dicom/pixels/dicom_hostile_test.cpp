// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Files that ask for more than there is: depth, memory, sizes.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include "deform/errors.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom_series.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

std::string load_error(const std::filesystem::path& file) {
  const DicomScan scan = scan_dicom(file, true);
  if (scan.series.empty()) return to_string(scan.skipped.at(0));
  try {
    load_dicom(scan.series.front(), 1);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// A sequence whose items hold one sequence each, and so on. @param is_defined  whether it gives the length of each
std::string nested(std::size_t depth, const std::string& vr, bool is_defined) {
  const std::string inner_vr = vr == "SQ" ? vr : "";  // what is UN is implicit inside (PS3.5 6.2.2)
  const std::size_t level = (inner_vr.empty() ? 8 : 12) + 8;
  std::string bytes;
  for (std::size_t n = 0; n < depth; ++n) {
    const auto rest = static_cast<std::uint32_t>((depth - n - 1) * level);
    append_element(bytes, 0x0008, 0x1140, n == 0 ? vr : inner_vr, is_defined ? rest + 8 : 0xffffffff);
    append_element(bytes, 0xfffe, 0xe000, "", is_defined ? rest : 0xffffffff);
  }
  for (std::size_t n = 0; !is_defined && n < depth; ++n) {
    append_element(bytes, 0xfffe, 0xe00d, "", 0);
    append_element(bytes, 0xfffe, 0xe0dd, "", 0);
  }
  return bytes;
}

/// A whole slice behind the sequences; implicit where these have no VR.
void write_nested(const std::filesystem::path& file, std::size_t depth, const std::string& vr, bool is_defined) {
  MadeSlice slice;
  if (vr.empty()) slice.encoding = EXS_LittleEndianImplicit;
  write_slice(file, slice);
  DcmFileFormat format;
  format.loadFile(file.c_str());
  std::string bytes = read_bytes(file);
  // Before Study Instance UID, behind all of group 0008 that the slice has.
  const std::string study = vr.empty() ? std::string("\x20\0\x0d\0\4\0\0\0", 8) : std::string("\x20\0\x0d\0UI", 6);
  const std::size_t at = bytes.find(study);
  ASSERT_NE(at, std::string::npos);
  write_file(file, bytes.insert(at, nested(depth, vr, is_defined)));
}

TEST(HostileDicom, SequencesAreReadDownToAStatedDepth) {
  const Scratch folder;
  const std::filesystem::path file = folder / "slice.dcm";
  for (const std::string vr : {"SQ", "UN", ""}) {
    for (const bool is_defined : {false, true}) {
      SCOPED_TRACE(vr + (is_defined ? ", lengths given" : ", lengths not given"));
      write_nested(file, kDeepestSequence, vr, is_defined);
      EXPECT_EQ(load_error(file), "no error");
      for (const std::size_t depth : {kDeepestSequence + 1, std::size_t{1000}, std::size_t{200000}}) {
        write_nested(file, depth, vr, is_defined);
        EXPECT_TRUE(says(load_error(file), {"slice.dcm", "sequences in sequences, more than 100 deep"})) << depth;
      }
    }
  }
}

/// Deflates parts one after the other; a part is repeated.
std::string deflated(const std::vector<std::pair<std::string, std::size_t>>& parts) {
  z_stream stream{};
  deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string packed;
  std::vector<Bytef> piece(1 << 16);
  const auto run = [&](int flush) {
    do {
      stream.next_out = piece.data();
      stream.avail_out = static_cast<uInt>(piece.size());
      deflate(&stream, flush);
      packed.append(reinterpret_cast<const char*>(piece.data()), piece.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  };
  for (const auto& [bytes, count] : parts) {
    for (std::size_t n = 0; n < count; ++n) {
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      stream.avail_in = static_cast<uInt>(bytes.size());
      run(Z_NO_FLUSH);
    }
  }
  run(Z_FINISH);
  deflateEnd(&stream);
  return packed;
}

long peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

/// Adds what a slice needs behind `start`, and Pixel Data of so many bytes.
std::string deflated_slice(const std::string& start, std::size_t start_mib, std::uint32_t pixel_bytes,
                           std::size_t pixel_mib) {
  std::string pixels;
  append_element(pixels, 0x7fe0, 0x10, "OW", pixel_bytes);
  const std::string mib(1 << 20, '\0');
  return file_start(UID_DeflatedExplicitVRLittleEndianTransferSyntax) +
         deflated({{start, 1},
                   {mib, start_mib},
                   {attributes_of(MadeSlice()), 1},
                   {pixels, 1},
                   {mib, pixel_mib},
                   {std::string(48, '\0'), pixel_mib > 0 ? 0 : 1}});
}

TEST(HostileDicom, DeflatedDataSetsAreInflatedNoFurtherThanTheImageNeeds) {
  constexpr std::uint32_t kMib = 400, kBytes = kMib << 20;
  const Scratch folder;
  const std::filesystem::path file = folder / "slice.dcm";
  write_file(file, deflated_slice("", 0, 48, 0));
  ASSERT_EQ(load_error(file), "no error");
  const long before = peak_mib();
  std::string before_pixels, within_header;
  append_element(within_header, 0x0002, 0x0100, "OB", kBytes);  // any attribute before the others
  write_file(file, deflated_slice(within_header, kMib, 48, 0));
  EXPECT_LT(std::filesystem::file_size(file), 4u << 20);
  EXPECT_TRUE(says(load_error(file), {"inflates to more than 64 MiB"}));
  write_file(file, deflated_slice("", 0, kBytes, kMib));
  EXPECT_TRUE(says(load_error(file), {"slice.dcm", "inflates to more than 64 MiB"}));
  EXPECT_LT(peak_mib() - before, 300);
}

TEST(HostileDicom, AbsurdSizesAreRefusedBeforeAnythingIsAllocated) {
  register_encoders();
  const Scratch folder;
  const std::filesystem::path file = folder / "slice.dcm";
  std::vector<Coding> all = codings();
  all.push_back({"Native", UID_LittleEndianExplicitTransferSyntax});
  all.push_back({"Big", UID_BigEndianExplicitTransferSyntax});
  for (const Coding& coding : all) {
    SCOPED_TRACE(coding.name);
    const std::string frame = coding.name == "Native" || coding.name == "Big" ? "" : coding.frame(folder.path());
    const auto error_of = [&](const std::function<void(MadeSlice&)>& change) {
      MadeSlice slice = coding.slice();
      change(slice);
      if (frame.empty()) {
        slice.encoding = coding.name == "Big" ? EXS_BigEndianExplicit : EXS_LittleEndianExplicit;
        slice.words = {1, 2};
        const auto rows = slice.rows, columns = slice.columns;
        const auto edit = slice.edit;
        slice.rows = 1;
        slice.columns = 2;
        slice.edit = [=](DcmDataset& data) {
          data.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(rows));
          data.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(columns));
          if (edit) edit(data);
        };
        write_slice(file, slice);
      } else {
        write_encapsulated(file, slice, coding.uid, {frame});
      }
      return load_error(file);
    };
    const auto with_sides = [&](int rows, int columns) {
      return error_of([=](MadeSlice& slice) {
        slice.rows = rows;
        slice.columns = columns;
      });
    };
    const auto with_text = [&](const DcmTagKey& tag, const char* text) {
      return error_of(
          [=](MadeSlice& slice) { slice.edit = [=](DcmDataset& data) { data.putAndInsertString(tag, text); }; });
    };
    EXPECT_TRUE(says(with_sides(65535, 65535), {"slice.dcm", "Rows x Columns", "65535 x 65535"}));
    EXPECT_TRUE(says(with_sides(0, 12), {"slice.dcm"}));
    EXPECT_TRUE(says(with_sides(16384, 16384), {"slice.dcm", "16384 x 16384"}) ||
                says(with_sides(16384, 16384), {"slice.dcm", "truncated"}));
    EXPECT_TRUE(says(with_text(DCM_NumberOfFrames, "1000000000"), {"slice.dcm", "Number of Frames", "1000000000"}));
    EXPECT_TRUE(says(with_text(DCM_NumberOfFrames, "99999999999999"), {"slice.dcm", "Number of Frames", "no number"}));
    EXPECT_TRUE(says(error_of([](MadeSlice& slice) { slice.bits_allocated = 32; }),
                     {"slice.dcm", "Bits Allocated (0028,0100)", "expected 8 or 16, found 32"}));
    for (const int bits : {0, 1, 12, 64, 65535})
      EXPECT_TRUE(says(error_of([=](MadeSlice& slice) { slice.bits_allocated = bits; }), {"Bits Allocated"})) << bits;
  }
  EXPECT_LT(peak_mib(), 1000);
}

TEST(HostileDicom, JpegWithMoreComponentsOrScansThanASliceNeedsIsRefused) {
  register_encoders();
  const Scratch folder;
  const std::filesystem::path file = folder / "slice.dcm";
  const std::string frame = encoded_frame(folder.path(), busy_slice(), EXS_JPEGProcess14SV1);
  std::string three = frame;
  three[three.find("\xff\xc3") + 9] = 3;
  write_encapsulated(file, busy_slice(), UID_JPEGProcess14SV1TransferSyntax, {three});
  EXPECT_TRUE(says(load_error(file), {"expected 1 component, found 3"}));
  std::string scans = frame.substr(0, frame.size() - 2);
  for (int n = 0; n < 200; ++n) scans += frame.substr(frame.find("\xff\xda"), 10);
  write_encapsulated(file, busy_slice(), UID_JPEGProcess14SV1TransferSyntax, {scans + "\xff\xd9"});
  EXPECT_TRUE(says(load_error(file), {"expected at most 100 scans, found 201"}));
}

TEST(HostileDicom, FragmentsAndOffsetTablesLongerThanTheFileAreRefused) {
  register_encoders();
  const Scratch folder;
  const std::filesystem::path file = folder / "slice.dcm";
  const std::string frame = encoded_frame(folder.path(), busy_slice(), EXS_JPEGProcess14SV1);
  write_encapsulated(file, busy_slice(), UID_JPEGProcess14SV1TransferSyntax, {frame});
  const std::string whole = read_bytes(file), item("\xfe\xff\0\xe0", 4);
  const std::size_t table = whole.rfind(item, whole.rfind(item) - 1), fragment = whole.rfind(item);
  for (const std::size_t at : {table, fragment}) {
    for (const std::uint32_t length : {0xfffffffeu, 0xfffffff0u, 0x80000000u, 0x7ffffffeu, 100000u}) {
      std::string bytes;
      append_value(bytes, length);
      write_file(file, std::string(whole).replace(at + 4, 4, bytes));
      EXPECT_TRUE(says(load_error(file), {"slice.dcm"})) << length;
    }
  }
  write_file(file, whole.substr(0, whole.size() - 8));  // without the end of the sequence
  EXPECT_TRUE(says(load_error(file), {"slice.dcm", "truncated or damaged"}));
}

}  // namespace
}  // namespace tetwarp
