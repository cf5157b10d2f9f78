// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Deformable Spatial Registration objects beside a derived series, value by value.
#include <cmath>
#include <cstring>
#include <limits>

#include "deform/errors.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Made-up vectors for the grid of a source; the last has none.
std::vector<glm::vec3> vectors_for(const DerivedSource& source) {
  std::vector<glm::vec3> vectors;
  for (std::int64_t n = 0; n < voxel_count(source.volume.geometry); ++n) {
    const auto value = static_cast<float>(n);
    vectors.emplace_back(0.1F * value, -value / 3, 1e-3F + value);
  }
  vectors.back() = glm::vec3(kNan);
  return vectors;
}

/// Some slices of vectors, as MapStream hands them over.
ConstVolumeView slices_of(const Geometry& grid, const std::vector<glm::vec3>& vectors, std::int64_t begin,
                          std::int64_t end) {
  Region slices = whole(grid);
  slices.begin.z = begin;
  slices.end.z = end;
  return {&grid, slices, VoxelType::f32, 3,
          reinterpret_cast<const std::byte*>(vectors.data() + begin * grid.size.x * grid.size.y)};
}

/// Writes the series into `folder`/out and the object beside it, slab by slab.
DicomWriteReport write_both(const DerivedSource& source, const fs::path& folder, std::int64_t slab = 2,
                            bool with_slices = true) {
  fs::create_directories(folder / "out");
  const Geometry& grid = source.volume.geometry;
  const std::vector<glm::vec3> vectors = vectors_for(source);
  DerivedSeriesWriter writer(folder / "out", grid, source.headers, source.derivation);
  const auto registration = writer.create_registration(folder / "reg.dcm");
  for (std::int64_t k = 0; k < grid.size.z; k += slab)
    registration->write(slices_of(grid, vectors, k, std::min(k + slab, grid.size.z)));
  if (with_slices) writer.write(view(source.volume), 0, grid.size.z, source.sampled);
  registration->finish();
  return writer.report();
}

/// The items of the registration: of the derived series, and of the source.
DcmItem& derived_item(Written& file) { return item_of(file.data(), DCM_DeformableRegistrationSequence, 0); }
DcmItem& source_item(Written& file) { return item_of(file.data(), DCM_DeformableRegistrationSequence, -1); }

std::vector<std::string> images_of(DcmItem& item, const DcmTagKey& sequence = DCM_ReferencedImageSequence) {
  std::vector<std::string> uids;
  for (unsigned long n = 0; n < items_of(item, sequence); ++n)
    uids.push_back(get(item_of(item, sequence, static_cast<long>(n)), DCM_ReferencedSOPInstanceUID));
  return uids;
}

TEST(Registration, VectorsAndGridComeBackAsTheyWere) {
  const Scratch scratch;
  const DerivedSource source;
  write_both(source, scratch.path());
  EXPECT_EQ(read_field_header(scratch / "reg.dcm").direction, Direction::pull);
  const PullField field = read_pull_field(scratch / "reg.dcm");
  EXPECT_EQ(field.grid, source.volume.geometry);
  const std::vector<glm::vec3> expected = vectors_for(source);
  ASSERT_EQ(field.displacement.size(), expected.size());
  EXPECT_EQ(std::memcmp(field.displacement.data(), expected.data(), expected.size() * sizeof(glm::vec3)), 0);
}

TEST(Registration, GoesFromTheDerivedFrameOfReferenceToTheSources) {
  const Scratch scratch;
  DerivedSource source;
  const DicomWriteReport series = write_both(source, scratch.path());
  Written file(scratch / "reg.dcm");
  EXPECT_EQ(file[DCM_FrameOfReferenceUID], series.frame_of_reference_uid);
  EXPECT_EQ(file[DCM_StudyInstanceUID], "1.2.3.1");
  EXPECT_EQ(get(derived_item(file), DCM_SourceFrameOfReferenceUID), series.frame_of_reference_uid);
  EXPECT_EQ(get(source_item(file), DCM_SourceFrameOfReferenceUID), "1.2.3.3");
  EXPECT_EQ(items_of(derived_item(file), DCM_DeformableRegistrationGridSequence), 0U);
  EXPECT_EQ(items_of(source_item(file), DCM_DeformableRegistrationGridSequence), 1U);
}

TEST(Registration, NamesEachImageOfBothSeries) {
  const Scratch scratch;
  const DerivedSource source;
  const DicomWriteReport series = write_both(source, scratch.path());
  const std::vector<std::string> of_source = {"1.2.3.4.1", "1.2.3.4.2", "1.2.3.4.3"};
  Written file(scratch / "reg.dcm");
  ASSERT_EQ(series.sop_instance_uids.size(), 3U);
  EXPECT_EQ(images_of(source_item(file)), of_source);
  EXPECT_EQ(images_of(derived_item(file)), series.sop_instance_uids);
  ASSERT_EQ(items_of(file.data(), DCM_ReferencedSeriesSequence), 2U);
  DcmItem& first = item_of(file.data(), DCM_ReferencedSeriesSequence, 0);
  EXPECT_EQ(get(first, DCM_SeriesInstanceUID), "1.2.3.2");
  EXPECT_EQ(images_of(first, DCM_ReferencedInstanceSequence), of_source);
  DcmItem& second = item_of(file.data(), DCM_ReferencedSeriesSequence, 1);
  EXPECT_EQ(get(second, DCM_SeriesInstanceUID), series.series_uid);
  EXPECT_EQ(images_of(second, DCM_ReferencedInstanceSequence), series.sop_instance_uids);
}

TEST(Registration, InOneFrameOfReferenceTheImagesTellTheItemsApart) {
  const Scratch scratch;
  DerivedSource source;
  source.derivation.form.keep_frame_of_reference = true;
  const DicomWriteReport series = write_both(source, scratch.path());
  Written file(scratch / "reg.dcm");
  EXPECT_EQ(file[DCM_FrameOfReferenceUID], "1.2.3.3");
  EXPECT_EQ(get(derived_item(file), DCM_SourceFrameOfReferenceUID), "1.2.3.3");
  EXPECT_EQ(get(source_item(file), DCM_SourceFrameOfReferenceUID), "1.2.3.3");
  EXPECT_EQ(images_of(derived_item(file)), series.sop_instance_uids);
  EXPECT_EQ(images_of(source_item(file)).front(), "1.2.3.4.1");
}

TEST(Registration, OfASeriesThatIsNotWrittenNamesTheSourceAlone) {
  const Scratch scratch;
  const DerivedSource source;
  const DicomWriteReport series = write_both(source, scratch.path(), 2, false);
  Written file(scratch / "reg.dcm");
  EXPECT_EQ(file[DCM_FrameOfReferenceUID], series.frame_of_reference_uid);
  EXPECT_EQ(items_of(file.data(), DCM_DeformableRegistrationSequence), 1U);
  EXPECT_EQ(items_of(file.data(), DCM_ReferencedSeriesSequence), 1U);
  EXPECT_EQ(images_of(source_item(file)).size(), 3U);
}

TEST(Registration, NamesFramesOfOneFileOnce) {
  const Scratch scratch;
  DerivedSource source;
  source.set_all(DCM_SOPClassUID, UID_EnhancedCTImageStorage);
  source.set_all(DCM_SOPInstanceUID, "1.2.3.9");
  source.headers.frames = {3, 1, 2};
  write_both(source, scratch.path());
  Written file(scratch / "reg.dcm");
  ASSERT_EQ(items_of(source_item(file), DCM_ReferencedImageSequence), 1U);
  DcmItem& image = item_of(source_item(file), DCM_ReferencedImageSequence);
  EXPECT_EQ(get(image, DCM_ReferencedSOPClassUID), UID_EnhancedCTImageStorage);
  EXPECT_EQ(get(image, DCM_ReferencedFrameNumber), "3\\1\\2");
}

TEST(Registration, LeavesOutImagesWithoutUid) {
  const Scratch scratch;
  DerivedSource source;
  set(source[0], DCM_SOPInstanceUID, "no uid");
  source.remove_all(DCM_SeriesInstanceUID);
  source.remove_all(DCM_FrameOfReferenceUID);
  write_both(source, scratch.path());
  Written file(scratch / "reg.dcm");
  EXPECT_EQ(images_of(source_item(file)), (std::vector<std::string>{"1.2.3.4.2", "1.2.3.4.3"}));
  EXPECT_EQ(items_of(file.data(), DCM_ReferencedSeriesSequence), 1U);
  EXPECT_TRUE(get(source_item(file), DCM_SourceFrameOfReferenceUID).starts_with("2.25."));
}

TEST(Registration, KeepsPatientAndStudyAndDropsTheScan) {
  const Scratch scratch;
  DerivedSource source;
  set(source[0], DCM_StudyDescription, "a study");
  source[0].putAndInsertString(DcmTag(0x0009, 0x0010, EVR_LO), "A VENDOR");
  write_both(source, scratch.path());
  Written file(scratch / "reg.dcm");
  EXPECT_EQ(file[DCM_PatientName], "NAME^GIVEN");
  EXPECT_EQ(file[DCM_PatientID], "ID17");
  EXPECT_EQ(file[DCM_StudyDescription], "a study");
  EXPECT_EQ(file[DCM_SpecificCharacterSet], "ISO_IR 100");
  EXPECT_EQ(file[DCM_Modality], "REG");
  EXPECT_EQ(file[DCM_Manufacturer], "Tetwarp");
  EXPECT_EQ(file[DCM_SeriesNumber], "2004");
  EXPECT_EQ(file[DCM_SeriesDescription], "Deformation field of series 4");
  EXPECT_NE(file[DCM_SeriesInstanceUID], "1.2.3.2");
  for (const DcmTagKey& tag : {DcmTagKey(0x0009, 0x0010), DCM_KVP, DCM_SliceThickness, DCM_WindowCenter, DCM_Rows,
                               DCM_PatientPosition, DCM_ImagePositionPatient, DCM_InstanceCreationDate})
    EXPECT_FALSE(file.data().tagExists(tag)) << tag.toString();
  DcmItem& equipment = item_of(file.data(), DCM_ContributingEquipmentSequence);
  EXPECT_TRUE(says(get(equipment, DCM_ContributionDescription), {std::string(64, 'a'), "interpolation=linear"}));
}

TEST(Registration, IsDeidentifiedWithItsSeries) {
  const Scratch scratch;
  DerivedSource source;
  source.derivation.form.deidentification.emplace(Deidentification{.key = std::vector<std::byte>(32, std::byte{7})});
  const DicomWriteReport series = write_both(source, scratch.path());
  const std::string bytes = file_bytes(scratch / "reg.dcm");
  for (const char* word : {"NAME", "GIVEN", "ID17", "1.2.3.", "20200102", "20200104", "19500101", "REFERRER"})
    EXPECT_EQ(bytes.find(word), std::string::npos) << word;
  Written file(scratch / "reg.dcm"), slice(scratch / "out" / "IM00001.dcm");
  EXPECT_EQ(file[DCM_PatientIdentityRemoved], "YES");
  for (const DcmTagKey& tag : {DCM_PatientName, DCM_PatientID, DCM_StudyInstanceUID, DCM_FrameOfReferenceUID}) {
    EXPECT_FALSE(file[tag].empty()) << tag.toString();
    EXPECT_EQ(file[tag], slice[tag]) << tag.toString();
  }
  EXPECT_EQ(images_of(derived_item(file)), series.sop_instance_uids);
  EXPECT_EQ(images_of(source_item(file)).at(0),
            get(item_of(slice.data(), DCM_SourceImageSequence), DCM_ReferencedSOPInstanceUID));
  EXPECT_FALSE(file[DCM_ContentDate].empty());
  EXPECT_EQ(items_of(file.data(), DCM_ReferencedSeriesSequence), 2U);
}

TEST(Registration, TakesItsDateFromTheSource) {
  const Scratch scratch;
  DerivedSource source;
  const auto date_of = [&](const char* folder) {
    write_both(source, scratch / folder);
    Written file(scratch / folder / "reg.dcm");
    return file[DCM_ContentDate] + " " + file[DCM_ContentTime];
  };
  EXPECT_EQ(date_of("content"), "20200104 000000");
  source.remove_all(DCM_ContentDate);
  source.remove_all(DCM_SeriesDate);
  EXPECT_EQ(date_of("study"), "20200102 101112");
  source.set_all(DCM_StudyDate, "");
  EXPECT_EQ(date_of("none"), "19000101 000000");
}

TEST(Registration, HasTheSameBytesHoweverItIsSplit) {
  const Scratch scratch;
  const DerivedSource source(5);
  write_both(source, scratch / "a", 1);
  write_both(source, scratch / "b", 4);
  const std::string bytes = file_bytes(scratch / "a" / "reg.dcm");
  EXPECT_GT(bytes.size(), 12U * 8 * 6 * 5);
  EXPECT_TRUE(bytes == file_bytes(scratch / "b" / "reg.dcm"));
}

TEST(Registration, AnotherVectorIsAnotherInstance) {
  const Scratch scratch;
  const DerivedSource source;
  std::vector<glm::vec3> vectors = vectors_for(source);
  const Geometry& grid = source.volume.geometry;
  const DerivedSeriesWriter writer(scratch.path(), grid, source.headers, source.derivation);
  const auto uid_with = [&](float value) {
    vectors[17].y = value;
    const auto registration = writer.create_registration(scratch / "reg.dcm");
    registration->write(slices_of(grid, vectors, 0, grid.size.z));
    registration->finish();
    return Written(scratch / "reg.dcm")[DCM_SOPInstanceUID];
  };
  const std::string uid = uid_with(1);
  EXPECT_EQ(uid_with(1), uid);
  EXPECT_NE(uid_with(std::nextafter(1.0F, 2.0F)), uid);
}

TEST(Registration, MoreThanAnAttributeHoldsIsRefused) {
  Geometry grid;
  grid.size = {512, 512, 1365};
  EXPECT_NO_THROW(require_registration_fits(grid));
  grid.size.z = 1366;
  try {
    require_registration_fits(grid);
    FAIL() << "4297064448 bytes";
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"512 x 512 x 1366", "4297064448", "4294967294", ".mha"}));
  }
}

}  // namespace
}  // namespace tetwarp::test
