// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What may be chosen of a derived series: its transfer syntax, frame of reference, number and description.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include <set>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_compress.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/other_readers.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

constexpr DicomEncoding kEncodings[] = {DicomEncoding::uncompressed, DicomEncoding::deflated, DicomEncoding::rle,
                                        DicomEncoding::jpeg_ls};

DerivedSource source_in(DicomEncoding encoding) {
  DerivedSource source;
  source.volume.voxels[5] = INT16_MIN;
  source.volume.voxels[6] = INT16_MAX;
  source.derivation.form.encoding = encoding;
  return source;
}

class EncodedSeries : public testing::TestWithParam<DicomEncoding> {
 protected:
  const Scratch scratch_;
};

TEST_P(EncodedSeries, HoldsTheVoxelsForUsAndForDcmtksDecoders) {
  const DerivedSource source = source_in(GetParam());
  source.write(scratch_ / "out");
  const DicomScan scan = scan_dicom(scratch_ / "out");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices[0].transfer_syntax_uid, uid_of(GetParam()));
  EXPECT_EQ(load_dicom(scan.series[0]).volume.voxels, source.volume.voxels);
  DcmRLEDecoderRegistration::registerCodecs();
  DJLSDecoderRegistration::registerCodecs();
  for (int k = 0; k < 3; ++k) {
    Written file(scratch_ / "out" / ("IM0000" + std::to_string(k + 1) + ".dcm"));
    EXPECT_EQ(get(*file.format.getMetaInfo(), DCM_TransferSyntaxUID), uid_of(GetParam()));
    ASSERT_TRUE(file.data().chooseRepresentation(EXS_LittleEndianExplicit, nullptr).good());
    const Uint16* words = nullptr;
    unsigned long count = 0;
    ASSERT_TRUE(file.data().findAndGetUint16Array(DCM_PixelData, words, &count).good());
    ASSERT_GE(count, 48u);
    for (int n = 0; n < 48; ++n)
      ASSERT_EQ(static_cast<std::int16_t>(words[n]), source.volume.voxels[k * 48 + n])
          << "slice " << k << " voxel " << n;
  }
}

TEST_P(EncodedSeries, IsTheSameBytesForAnyNumberOfThreadsAndFilesHaveEvenLengths) {
  const DerivedSource source = source_in(GetParam());
  source.write(scratch_ / "one", 1);
  source.write(scratch_ / "many", 4);
  for (const auto& entry : fs::directory_iterator(scratch_ / "one")) {
    EXPECT_EQ(file_bytes(entry.path()), file_bytes(scratch_ / "many" / entry.path().filename()));
    EXPECT_EQ(entry.file_size() % 2, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EncodedSeries, testing::ValuesIn(kEncodings), [](const auto& encoding) {
  std::string name = name_of(encoding.param);
  std::erase(name, '-');
  return name;
});

TEST(RleFrame, EveryRunEndsWithItsRow) {
  constexpr std::size_t kRows = 5, kColumns = 300;
  const std::vector<std::int16_t> flat(kRows * kColumns, 7);  // one run, if rows did not end it
  const std::vector<std::byte> frame = compressed_frame(flat, kRows, kColumns, DicomEncoding::rle);
  const auto word = [&](std::size_t n) {
    std::uint32_t value = 0;
    std::memcpy(&value, frame.data() + 4 * n, 4);
    return value;
  };
  ASSERT_EQ(word(0), 2u);
  ASSERT_EQ(word(1), 64u);
  std::size_t done = 0;
  for (std::size_t at = 64; at < word(2) && done < flat.size();) {
    const auto control = std::to_integer<unsigned>(frame[at]);
    const std::size_t run = control < 128 ? control + 1 : 257 - control;
    EXPECT_LE(done % kColumns + run, kColumns) << "PS3.5 G.3.1";
    at += control < 128 ? run + 1 : 2;
    done += run;
  }
  EXPECT_EQ(done, flat.size());
}

TEST(DerivedForm, EveryChoiceMakesAnotherSeriesAndOtherInstances) {
  const Scratch scratch;
  std::vector<DicomForm> forms;
  for (const DicomEncoding encoding : kEncodings) forms.push_back({.encoding = encoding});
  forms.push_back({.keep_frame_of_reference = true});
  forms.push_back({.series_number = 17});
  forms.push_back({.series_description = "mine"});
  std::set<std::string> series, instances;
  for (const DicomForm& form : forms) {
    DerivedSource source;
    source.derivation.form = form;
    const fs::path folder = scratch / std::to_string(series.size());
    source.write(folder);
    Written file(folder / "IM00001.dcm");
    series.insert(file[DCM_SeriesInstanceUID]);
    instances.insert(file[DCM_SOPInstanceUID]);
  }
  EXPECT_EQ(series.size(), forms.size());
  EXPECT_EQ(instances.size(), forms.size());
}

TEST(DerivedForm, IsWhatWasAskedFor) {
  const Scratch scratch;
  DerivedSource source;
  source.derivation.form = {.keep_frame_of_reference = true,
                            .series_number = 17,
                            .series_description =
                                "Gr\xc3\xb6\xc3\x9f"
                                "e"};
  source.write(scratch / "out");
  Written file(scratch / "out" / "IM00002.dcm");
  EXPECT_EQ(file[DCM_FrameOfReferenceUID], "1.2.3.3");
  EXPECT_EQ(file[DCM_SeriesNumber], "17");
  EXPECT_EQ(file[DCM_SeriesDescription],
            "Gr\xf6\xdf"
            "e")
      << "in the character set of the source, ISO_IR 100";
}

TEST(DerivedForm, ADescriptionThatDicomCannotHoldIsRefused) {
  const Scratch scratch;
  const auto refusal = [&](const std::string& description) -> std::string {
    DerivedSource source;
    source.derivation.form.series_description = description;
    try {
      source.write(scratch / "out");
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(refusal(std::string(64, 'x')), "no error");
  EXPECT_TRUE(says(refusal(std::string(65, 'x')), {"65 characters", "at most 64"}));
  EXPECT_TRUE(says(refusal("two\\values"), {"backslash"}));
  EXPECT_TRUE(says(refusal("bell\a"), {"control character", "bell\\x07"}));
  EXPECT_TRUE(says(refusal("\xe5\xbf\x83"), {"character set", "ISO_IR 100"}));
}

/// Slices of a real series, in every encoding, as other programs read them.
class RealEncoded : public testing::TestWithParam<DicomEncoding> {};

TEST_P(RealEncoded, IsReadAlikeByOthersAndIsSmaller) {
  TETWARP_REAL_DATA(folder, "overlap-kits-and-topogram/kits-00072");
  const DicomSeries series = scan_dicom(folder).series.at(0);
  const DicomVolume source = load_dicom(series);
  const Scratch scratch;
  const auto write = [&](DicomEncoding encoding, const fs::path& output) {
    fs::create_directory(output);
    DicomDerivation derivation;
    derivation.form.encoding = encoding;
    write_derived_series(output, view(source.volume), *source.headers, derivation);
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(output)) bytes += entry.file_size();
    return bytes;
  };
  const std::uintmax_t bytes = write(GetParam(), scratch / "out");
  EXPECT_LT(bytes, 0.8 * static_cast<double>(write(DicomEncoding::uncompressed, scratch / "plain")));
  RecordProperty("bytes", std::to_string(bytes));
  EXPECT_EQ(load_dicom(scan_dicom(scratch / "out").series.at(0)).volume.voxels, source.volume.voxels);
  check_with("pydicom", scratch / "out", source.volume, scratch / "expected.json");
  if (GetParam() == DicomEncoding::rle)  // the others dcm2niix of Debian 12 does not read
    check_with("dcm2niix", scratch / "out", source.volume, scratch / "expected.json");
}

INSTANTIATE_TEST_SUITE_P(All, RealEncoded,
                         testing::Values(DicomEncoding::deflated, DicomEncoding::rle, DicomEncoding::jpeg_ls),
                         [](const auto& encoding) {
                           std::string name = name_of(encoding.param);
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace tetwarp::test
