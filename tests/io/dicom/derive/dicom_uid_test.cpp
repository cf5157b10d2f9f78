// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/hash.h"

#include <functional>
#include <set>

#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

/// What identifies the first file of a series, and the file itself.
struct Identity {
  std::string study, series, frame, instance, bytes;
};

Identity identity_of(const DerivedSource& source, const std::filesystem::path& folder, int threads = 0) {
  std::filesystem::remove_all(folder);
  source.write(folder, threads);
  Written file(folder / "IM00001.dcm");
  return {file[DCM_StudyInstanceUID], file[DCM_SeriesInstanceUID], file[DCM_FrameOfReferenceUID],
          file[DCM_SOPInstanceUID], file_bytes(folder / "IM00001.dcm")};
}

/// The identity after a change of the usual source.
Identity changed(const std::filesystem::path& folder, const std::function<void(DerivedSource&)>& change) {
  DerivedSource source;
  change(source);
  return identity_of(source, folder);
}

TEST(DerivedUids, SameInputGivesSameBytesForAnyNumberOfThreads) {
  const Scratch scratch;
  const DerivedSource source(17);
  source.write(scratch / "one", 1);
  source.write(scratch / "many", 4);
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scratch / "one")) {
    names.insert(entry.path().filename().string());
    EXPECT_EQ(file_bytes(entry.path()), file_bytes(scratch / "many" / entry.path().filename())) << entry.path();
  }
  EXPECT_EQ(names.size(), 17U);
}

TEST(DerivedUids, AreHashesAndDiffer) {
  const Scratch scratch;
  const Identity written = identity_of(DerivedSource(), scratch / "a");
  EXPECT_EQ(written.study, "1.2.3.1");
  const std::set<std::string> uids = {written.series, written.frame, written.instance,
                                      Written(scratch / "a" / "IM00002.dcm")[DCM_SOPInstanceUID]};
  EXPECT_EQ(uids.size(), 4U);
  for (const std::string& uid : uids) EXPECT_TRUE(uid.starts_with("2.25.") && uid.size() <= 44) << uid;
}

TEST(DerivedUids, MetaHeaderNamesTheInstanceAndUs) {
  const Scratch scratch;
  const Identity written = identity_of(DerivedSource(), scratch / "a");
  Written file(scratch / "a" / "IM00001.dcm");
  DcmMetaInfo& meta = *file.format.getMetaInfo();
  EXPECT_EQ(get(meta, DCM_MediaStorageSOPInstanceUID), written.instance);
  EXPECT_EQ(get(meta, DCM_MediaStorageSOPClassUID), UID_CTImageStorage);
  EXPECT_EQ(get(meta, DCM_TransferSyntaxUID), UID_LittleEndianExplicitTransferSyntax);
  EXPECT_TRUE(get(meta, DCM_ImplementationVersionName).starts_with("TETWARP_0."));
}

TEST(DerivedUids, OneVoxelChangesItsInstanceAndNoOther) {
  const Scratch scratch;
  const Identity before = identity_of(DerivedSource(), scratch / "a");
  const Identity after = changed(scratch / "b", [](DerivedSource& source) { ++source.volume.voxels[7]; });
  EXPECT_NE(after.instance, before.instance);
  EXPECT_EQ(after.series, before.series);
  EXPECT_EQ(file_bytes(scratch / "a" / "IM00002.dcm"), file_bytes(scratch / "b" / "IM00002.dcm"));
}

TEST(DerivedUids, OneAttributeChangesTheInstance) {
  const Scratch scratch;
  const Identity before = identity_of(DerivedSource(), scratch / "a");
  EXPECT_NE(changed(scratch / "b", [](DerivedSource& source) { source.set_all(DCM_PatientSex, "M"); }).instance,
            before.instance);
}

TEST(DerivedUids, FieldAndParametersChangeTheSeries) {
  const Scratch scratch;
  const Identity before = identity_of(DerivedSource(), scratch / "a");
  const Identity field = changed(scratch / "b", [](DerivedSource& s) { s.derivation.field_sha256[0] = 'b'; });
  EXPECT_NE(field.series, before.series);
  EXPECT_NE(field.frame, before.frame);
  const Identity options = changed(scratch / "b", [](DerivedSource& s) { s.derivation.parameters += " x"; });
  EXPECT_NE(options.series, before.series);
  EXPECT_EQ(options.frame, before.frame);
}

TEST(DerivedUids, OneFieldGivesAllVolumesOfAFrameTheSameFrameOfReference) {
  const Scratch scratch;
  const Identity before = identity_of(DerivedSource(), scratch / "a");
  const Identity other_series = changed(scratch / "b", [](DerivedSource& source) {
    source.set_all(DCM_SeriesInstanceUID, "1.2.3.9");
    source.volume.voxels[0] = 99;
    source.derivation.parameters = "others";
  });
  EXPECT_NE(other_series.series, before.series);
  EXPECT_EQ(other_series.frame, before.frame);
  const Identity other_frame =
      changed(scratch / "b", [](DerivedSource& source) { source.set_all(DCM_FrameOfReferenceUID, "1.2.3.8"); });
  EXPECT_NE(other_frame.frame, before.frame);
}

TEST(DerivedUids, FrameOfReferenceIsKeptWhereNothingMoved) {
  const Scratch scratch;
  const Identity written = changed(scratch / "a", [](DerivedSource& source) { source.derivation.deformed = false; });
  EXPECT_EQ(written.frame, "1.2.3.3");
  EXPECT_NE(written.series, identity_of(DerivedSource(), scratch / "b").series) << "one series in two frames";
  Written file(scratch / "a" / "IM00001.dcm");
  EXPECT_EQ(file[DCM_SeriesDescription], "resampled: Abdomen 2.5");
  EXPECT_EQ(get(item_of(file.data(), DCM_SourceImageSequence), DCM_SpatialLocationsPreserved), "YES");
}

TEST(DerivedUids, MissingSourceUidsAreMadeUpFromTheHeaders) {
  const Scratch scratch;
  const auto without = [](DerivedSource& source) {
    for (const DcmTagKey& tag :
         {DCM_StudyInstanceUID, DCM_SeriesInstanceUID, DCM_FrameOfReferenceUID, DCM_SOPClassUID}) {
      source.remove_all(tag);
    }
  };
  const Identity one = changed(scratch / "a", without);
  EXPECT_TRUE(one.study.starts_with("2.25.") && one.frame.starts_with("2.25."));
  EXPECT_EQ(Written(scratch / "a" / "IM00001.dcm")[DCM_SOPClassUID], UID_CTImageStorage);
  EXPECT_EQ(Written(scratch / "a" / "IM00002.dcm")[DCM_StudyInstanceUID], one.study);
  EXPECT_EQ(changed(scratch / "b", without).bytes, one.bytes);
  const Identity other = changed(scratch / "b", [&](DerivedSource& source) {
    without(source);
    source.set_all(DCM_StudyDate, "20200202");
  });
  EXPECT_NE(other.study, one.study);
  EXPECT_NE(other.frame, one.frame);
}

TEST(DerivedUids, InstanceUidIsAHashOfEverythingElseInTheFile) {
  const Scratch scratch;
  const Identity written = identity_of(DerivedSource(), scratch / "a");
  // The file from the data set on, without the element (0008,0018): 8 bytes of tag, VR and length, and its value.
  const std::string tag("\x08\x00\x18\x00UI", 6);
  const std::size_t start = written.bytes.find(std::string("\x08\x00\x05\x00", 4)),
                    element = written.bytes.find(tag, start);
  ASSERT_NE(element, std::string::npos);
  const std::size_t length = 8 + static_cast<unsigned char>(written.bytes[element + 6]);
  const std::string rest = written.bytes.substr(start, element - start) + written.bytes.substr(element + length);
  EXPECT_EQ(written.instance,
            uid_from_digest(Sha256().add("tetwarp instance").add(std::as_bytes(std::span(rest))).digest()));
}

}  // namespace
}  // namespace tetwarp::test
