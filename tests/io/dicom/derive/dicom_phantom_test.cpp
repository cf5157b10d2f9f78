// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

Volume<std::int16_t> small_volume() {
  Volume<std::int16_t> volume{{{6, 4, 3}, {0.8, 0.8, 2.5}, {-2, -1.2, -2.5}, glm::dmat3(1)}, {}};
  for (int n = 0; n < 72; ++n) volume.voxels.push_back(static_cast<std::int16_t>(n * 20 - 1000));
  return volume;
}

std::filesystem::path written(const Scratch& scratch, const std::string& name, std::uint64_t seed) {
  const std::filesystem::path folder = scratch / name;
  std::filesystem::create_directories(folder);
  const Volume<std::int16_t> volume = small_volume();
  write_phantom_series(folder, view(volume), seed);
  return folder;
}

TEST(PhantomSeries, IsAnOriginalCtOfNobody) {
  const Scratch scratch;
  const auto folder = written(scratch, "a", 7);
  Written file(folder / "IM00002.dcm");
  EXPECT_EQ(file[DCM_ImageType], "ORIGINAL\\PRIMARY\\AXIAL");
  EXPECT_EQ(file[DCM_PatientName], "PHANTOM^TETWARP");
  EXPECT_EQ(file[DCM_PatientID], "TETWARP-PHANTOM");
  EXPECT_EQ(file[DCM_PatientBirthDate], "");
  EXPECT_EQ(file[DCM_SOPClassUID], UID_CTImageStorage);
  EXPECT_EQ(file[DCM_ImagePositionPatient], "-2\\-1.2\\0");
  EXPECT_EQ(file[DCM_PixelSpacing], "0.8\\0.8");
  EXPECT_EQ(file[DCM_PixelPaddingValue], "<missing>");
  const Uint16* words = nullptr;
  ASSERT_TRUE(file.data().findAndGetUint16Array(DCM_PixelData, words).good());
  EXPECT_EQ(static_cast<std::int16_t>(words[0]), 24 * 20 - 1000);
  EXPECT_TRUE(is_tetwarp_dicom(folder / "IM00002.dcm"));
}

TEST(PhantomSeries, IsTheSameForTheSameSeedAndAnotherStudyForAnother) {
  const Scratch scratch;
  const auto first = written(scratch, "a", 7), again = written(scratch, "b", 7), other = written(scratch, "c", 8);
  EXPECT_EQ(file_bytes(first / "IM00001.dcm"), file_bytes(again / "IM00001.dcm"));
  for (const DcmTagKey& tag :
       {DCM_StudyInstanceUID, DCM_SeriesInstanceUID, DCM_FrameOfReferenceUID, DCM_SOPInstanceUID}) {
    EXPECT_NE(Written(first / "IM00001.dcm")[tag], Written(other / "IM00001.dcm")[tag]) << tag.toString();
  }
}

}  // namespace
}  // namespace tetwarp::test
