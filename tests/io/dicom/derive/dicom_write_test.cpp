// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <sys/resource.h>

#include <csignal>
#include <set>

#include "deform/errors.h"
#include "deform/version.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/hash.h"
#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

const char* const kNames[] = {"IM00001.dcm", "IM00002.dcm", "IM00003.dcm"};

TEST(DerivedSeries, StoredValueIsHu) {
  const Scratch scratch;
  DerivedSource source;
  source.volume.voxels[5] = INT16_MIN;
  source.volume.voxels[6] = INT16_MAX;
  source.write(scratch.path());
  for (std::size_t k = 0; k < 3; ++k) {
    Written file(scratch / kNames[k]);
    const Uint16* words = nullptr;
    unsigned long count = 0;
    ASSERT_TRUE(file.data().findAndGetUint16Array(DCM_PixelData, words, &count).good());
    ASSERT_EQ(count, 48U);
    for (unsigned long n = 0; n < count; ++n) {
      ASSERT_EQ(static_cast<std::int16_t>(words[n]), source.volume.voxels[k * 48 + n])
          << "slice " << k << " voxel " << n;
    }
    EXPECT_EQ(file[DCM_RescaleSlope], "1");
    EXPECT_EQ(file[DCM_RescaleIntercept], "0");
    EXPECT_EQ(file[DCM_RescaleType], "HU");
    EXPECT_EQ(file[DCM_PhotometricInterpretation], "MONOCHROME2");
    EXPECT_EQ(file[DCM_PixelRepresentation], "1");
    EXPECT_EQ(file[DCM_BitsAllocated] + file[DCM_BitsStored] + file[DCM_HighBit], "161615");
    EXPECT_EQ(file[DCM_Rows] + "x" + file[DCM_Columns], "6x8");
  }
}

/// The voxels pass by DCMTK when a file is written; the file must be the one that DCMTK would make.
TEST(DerivedSeries, BytesAndInstanceUidAreThoseOfTheDataSetEncodedByDcmtk) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  for (const char* name : kNames) {
    Written file(scratch / name);
    ASSERT_TRUE(file.data().loadAllDataIntoMemory().good());
    const std::vector<std::byte> bytes = encoded(file.data());
    const std::string text = file_bytes(scratch / name);
    const auto whole = std::as_bytes(std::span(text));
    ASSERT_GT(whole.size(), bytes.size());
    EXPECT_TRUE(std::ranges::equal(whole.last(bytes.size()), bytes)) << name;
    const std::string uid = file[DCM_SOPInstanceUID];
    file.data().findAndDeleteElement(DCM_SOPInstanceUID);
    EXPECT_EQ(uid, uid_from_digest(Sha256().add("tetwarp instance").add(encoded(file.data())).digest())) << name;
  }
}

TEST(DerivedSeries, CarriesPatientStudyAndAcquisition) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  Written file(scratch / kNames[1]);
  for (const DcmTagKey& tag : {DCM_SpecificCharacterSet,
                               DCM_PatientName,
                               DCM_PatientID,
                               DCM_PatientBirthDate,
                               DCM_PatientSex,
                               DCM_StudyDate,
                               DCM_SeriesDate,
                               DCM_ContentDate,
                               DCM_StudyTime,
                               DCM_StudyInstanceUID,
                               DCM_StudyID,
                               DCM_ReferringPhysicianName,
                               DCM_Manufacturer,
                               DCM_KVP,
                               DCM_SliceThickness,
                               DCM_TableHeight,
                               DCM_PatientPosition,
                               DCM_WindowCenter,
                               DCM_WindowWidth,
                               DCM_AcquisitionNumber,
                               DCM_InstanceNumber}) {
    EXPECT_EQ(file[tag], get(source[1], tag)) << tag.toString();
  }
  EXPECT_EQ(file[DCM_Modality], "CT");
  EXPECT_EQ(file[DCM_SOPClassUID], UID_CTImageStorage);
}

TEST(DerivedSeries, SaysThatItIsDerivedFromWhatAndByWhat) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  EXPECT_EQ(file[DCM_ImageType], "DERIVED\\SECONDARY\\AXIAL\\CT_SOM5 SPI");
  EXPECT_EQ(file[DCM_SeriesDescription], "deformed: Abdomen 2.5");
  EXPECT_EQ(file[DCM_SeriesNumber], "1004");
  EXPECT_EQ(file[DCM_DerivationDescription], "Deformed by a vertex field");
  EXPECT_EQ(get(item_of(file.data(), DCM_DerivationCodeSequence), DCM_CodeValue), "113085");

  ASSERT_EQ(items_of(file.data(), DCM_SourceImageSequence), 2U);
  DcmItem& image = item_of(file.data(), DCM_SourceImageSequence, 1);
  EXPECT_EQ(get(image, DCM_ReferencedSOPClassUID), UID_CTImageStorage);
  EXPECT_EQ(get(image, DCM_ReferencedSOPInstanceUID), "1.2.3.4.2");
  EXPECT_EQ(get(image, DCM_SpatialLocationsPreserved), "NO");
  EXPECT_EQ(get(item_of(image, DCM_PurposeOfReferenceCodeSequence), DCM_CodeValue), "121322");

  DcmItem& equipment = item_of(file.data(), DCM_ContributingEquipmentSequence);
  EXPECT_EQ(get(equipment, DCM_Manufacturer), "Tetwarp");
  EXPECT_EQ(get(equipment, DCM_SoftwareVersions), std::string(version()) + "\\" + commit());
  EXPECT_EQ(get(item_of(equipment, DCM_PurposeOfReferenceCodeSequence), DCM_CodeValue), "109103");
  const std::string contribution = get(equipment, DCM_ContributionDescription);
  EXPECT_NE(contribution.find(source.derivation.field_sha256), std::string::npos) << contribution;
  EXPECT_NE(contribution.find(source.derivation.parameters), std::string::npos) << contribution;
}

TEST(DerivedSeries, AppendsToTheSourcesEquipmentAndDerivation) {
  const Scratch scratch;
  DerivedSource source;
  for (const auto& slice : source.headers.slices) {
    DcmItem* item = nullptr;
    ASSERT_TRUE(slice->findOrCreateSequenceItem(DCM_ContributingEquipmentSequence, item, -2).good());
    set(*item, DCM_Manufacturer, "EARLIER");
    ASSERT_TRUE(slice->findOrCreateSequenceItem(DCM_DerivationCodeSequence, item, -2).good());
    set(*item, DCM_CodeValue, "113072");
  }
  source.write(scratch.path());
  Written file(scratch / kNames[2]);
  ASSERT_EQ(items_of(file.data(), DCM_ContributingEquipmentSequence), 2U);
  EXPECT_EQ(get(item_of(file.data(), DCM_ContributingEquipmentSequence, 0), DCM_Manufacturer), "EARLIER");
  EXPECT_EQ(get(item_of(file.data(), DCM_ContributingEquipmentSequence, 1), DCM_Manufacturer), "Tetwarp");
  EXPECT_EQ(items_of(file.data(), DCM_DerivationCodeSequence), 2U);
}

TEST(DerivedSeries, DropsWhatIsNotTrueOfIt) {
  const Scratch scratch;
  DerivedSource source;
  const std::vector<DcmTagKey> gone = {
      DCM_InstanceCreationDate,  DcmTagKey(0x0009, 0x0010), DcmTagKey(0x0009, 0x1001), DCM_SmallestImagePixelValue,
      DCM_PixelAspectRatio,      DCM_PresentationLUTShape,  DCM_OverlayRows,           DcmTagKey(0x5000, 0x0005),
      DCM_DataSetTrailingPadding};
  source.set_all(DcmTagKey(0x0009, 0x0010), "VENDOR");
  source.set_all(DCM_PixelAspectRatio, "1\\1");
  source.set_all(DCM_PresentationLUTShape, "IDENTITY");
  for (const auto& slice : source.headers.slices) {
    const Uint8 bytes[2] = {1, 2};
    DcmItem* item = nullptr;
    for (const DcmTagKey& sequence : {DCM_ReferencedImageSequence, DCM_IconImageSequence, DCM_VOILUTSequence,
                                      DCM_ModalityLUTSequence, DCM_RealWorldValueMappingSequence}) {
      ASSERT_TRUE(slice->findOrCreateSequenceItem(sequence, item, -2).good());
    }
    ASSERT_TRUE(slice->putAndInsertUint16(DCM_SmallestImagePixelValue, 3).good());
    ASSERT_TRUE(slice->putAndInsertUint16(DCM_OverlayRows, 6).good());
    ASSERT_TRUE(slice->putAndInsertUint16(DcmTag(0x5000, 0x0005, EVR_US), 2).good());
    ASSERT_TRUE(slice->putAndInsertUint8Array(DCM_DataSetTrailingPadding, bytes, 2).good());
    ASSERT_TRUE(slice->findOrCreateSequenceItem(DCM_RequestAttributesSequence, item, -2).good());
    set(*item, DCM_ScheduledProcedureStepID, "kept");
    ASSERT_TRUE(item->putAndInsertString(DcmTag(0x0009, 0x0010, EVR_LO), "VENDOR").good());
  }
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  for (const DcmTagKey& tag : gone) {
    EXPECT_EQ(file[tag], "<missing>") << tag.toString();
  }
  for (const DcmTagKey& tag : {DCM_ReferencedImageSequence, DCM_IconImageSequence, DCM_VOILUTSequence,
                               DCM_ModalityLUTSequence, DCM_RealWorldValueMappingSequence}) {
    EXPECT_FALSE(file.data().tagExists(tag)) << tag.toString();
  }
  DcmItem& request = item_of(file.data(), DCM_RequestAttributesSequence);
  EXPECT_EQ(get(request, DCM_ScheduledProcedureStepID), "kept");
  EXPECT_FALSE(request.tagExists(DcmTagKey(0x0009, 0x0010)));
}

TEST(DerivedSeries, DropsAcquisitionValuesThatDifferFromSliceToSlice) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  EXPECT_EQ(file[DCM_XRayTubeCurrent], "<missing>");
  EXPECT_EQ(file[DCM_TableHeight], "150");
}

TEST(DerivedSeries, SliceThicknessThatVariesIsLeftToSlicesOfTheSource) {
  const Scratch scratch;
  DerivedSource own;
  set(own[2], DCM_SliceThickness, "5.0");
  own.write(scratch / "own");
  EXPECT_EQ(Written(scratch / "own" / kNames[0])[DCM_SliceThickness], "2.50");
  EXPECT_EQ(Written(scratch / "own" / kNames[2])[DCM_SliceThickness], "5.0");

  // Equal in all slices; in the second case stated by one slice alone.
  for (const std::string thickness : {"2.50", "5.0"}) {
    DerivedSource more(5);
    more.headers.slices.resize(3);
    more.sampled.assign(5, {0, 2});
    set(more[2], DCM_SliceThickness, thickness);
    const DicomWriteReport report = more.write(scratch / thickness);
    const std::string written = Written(scratch / thickness / kNames[0])[DCM_SliceThickness];
    EXPECT_EQ(written, thickness == "2.50" ? "2.50" : "");
    EXPECT_EQ(report.added_empty.empty(), thickness == "2.50");
  }
}

TEST(DerivedSeries, AddsMissingType2AttributesEmptyAndNamesThem) {
  const Scratch scratch;
  DerivedSource source;
  source.remove_all(DCM_PositionReferenceIndicator);
  source[1].findAndDeleteElement(DCM_ReferringPhysicianName);
  const DicomWriteReport report = source.write(scratch.path());
  EXPECT_EQ(report.added_empty,
            (std::vector<std::string>{"(0008,0090) ReferringPhysicianName", "(0020,1040) PositionReferenceIndicator"}));
  Written file(scratch / kNames[1]);
  EXPECT_EQ(file[DCM_ReferringPhysicianName], "");
  EXPECT_EQ(file[DCM_PositionReferenceIndicator], "");
  EXPECT_EQ(Written(scratch / kNames[0])[DCM_ReferringPhysicianName], "REFERRER");
}

TEST(DerivedSeries, KeepsDecimalStringsThatMeanTheSame) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  Written file(scratch / kNames[1]);
  for (const DcmTagKey& tag : {DCM_ImagePositionPatient, DCM_ImageOrientationPatient, DCM_PixelSpacing}) {
    EXPECT_EQ(file[tag], get(source[1], tag)) << tag.toString();
  }
  EXPECT_EQ(file[DCM_SliceLocation], "-4.5");
}

TEST(DerivedSeries, TakesItsGeometryFromTheVolume) {
  const Scratch scratch;
  DerivedSource source;
  Geometry& geometry = source.volume.geometry;
  const double c = 0.8, s = 0.6;
  geometry.direction = glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1);
  geometry.spacing = {1.0 / 3, 0.123456789012345678, 1.0 / 7};
  geometry.origin = {-1234.56789012345678, 1e-7, 5};
  source.set_all(DCM_SpacingBetweenSlices, "2.5");
  source.write(scratch.path());
  Written file(scratch / kNames[2]);
  EXPECT_EQ(file[DCM_ImagePositionPatient], "-1234.5678901235\\1e-07\\5.28571428571429");
  EXPECT_EQ(file[DCM_ImageOrientationPatient], "0.8\\0.6\\0\\-0.6\\0.8\\0");
  EXPECT_EQ(file[DCM_PixelSpacing], "0.12345678901235\\0.33333333333333");
  EXPECT_EQ(file[DCM_SpacingBetweenSlices], "0.14285714285714");
  EXPECT_EQ(file[DCM_SliceLocation], "5.28571428571429");
}

TEST(DerivedSeries, KeepsInstanceNumbersUnlessTheyRepeat) {
  const Scratch scratch;
  DerivedSource source;
  for (std::size_t k = 0; k < 3; ++k) set(source[k], DCM_InstanceNumber, std::to_string(102 - k));
  source.write(scratch / "unique");
  EXPECT_EQ(Written(scratch / "unique" / "IM00102.dcm")[DCM_InstanceNumber], "102");
  EXPECT_EQ(Written(scratch / "unique" / "IM00102.dcm")[DCM_ImagePositionPatient],
            get(source[0], DCM_ImagePositionPatient));
  source.set_all(DCM_InstanceNumber, "5");
  source.write(scratch / "repeated");
  EXPECT_EQ(Written(scratch / "repeated" / "IM00003.dcm")[DCM_InstanceNumber], "3");
}

TEST(DerivedSeries, ReportsInstancesInTheOrderOfTheSlices) {
  const Scratch scratch;
  DerivedSource source;
  for (std::size_t k = 0; k < 3; ++k) set(source[k], DCM_InstanceNumber, std::to_string(102 - k));
  const DicomWriteReport report = source.write(scratch.path());
  ASSERT_EQ(report.sop_instance_uids.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    Written file(scratch / dicom_file_name(static_cast<int>(102 - k)));
    EXPECT_EQ(file[DCM_SOPInstanceUID], report.sop_instance_uids[k]) << k;
  }
}

/// DCMTK's data sets remember where they were read last.
TEST(DerivedSeries, SlicesThatTakeOverOneHeaderHaveTheSameBytesForAnyNumberOfThreads) {
  const Scratch scratch;
  DerivedSource source(2), finer(400);
  finer.volume.geometry.spacing.z = source.volume.geometry.spacing.z / 400;
  const auto write = [&](const fs::path& folder, int threads) {
    fs::create_directories(folder);
    write_derived_series(folder, view(finer.volume), source.headers, source.derivation, {}, threads);
  };
  write(scratch / "alone", 1);
  for (int round = 0; round < 4; ++round) {
    const fs::path folder = scratch / std::to_string(round);
    write(folder, 8);
    for (int n = 1; n <= 400; ++n) {
      const std::string name = dicom_file_name(n);
      ASSERT_EQ(file_bytes(folder / name), file_bytes(scratch / "alone" / name)) << name;
    }
  }
}

TEST(DerivedSeries, CarriesPaddingInHu) {
  const Scratch scratch;
  DerivedSource source;
  for (const auto& slice : source.headers.slices) {
    ASSERT_TRUE(slice->putAndInsertUint16(DCM_PixelRepresentation, 1).good());
    ASSERT_TRUE(slice->putAndInsertUint16(DCM_BitsStored, 16).good());
    ASSERT_TRUE(slice->putAndInsertUint16(DCM_HighBit, 15).good());
    ASSERT_TRUE(
        slice->putAndInsertUint16(DcmTag(DCM_PixelPaddingValue, EVR_US), 64536).good());  // -1000 of signed words
  }
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  Sint16 padding = 0;
  ASSERT_TRUE(file.data().findAndGetSint16(DCM_PixelPaddingValue, padding).good());
  EXPECT_EQ(padding, -1000 * 2 - 1024);
  source[2].findAndDeleteElement(DCM_PixelPaddingValue);
  source.write(scratch / "not all");
  EXPECT_EQ(Written(scratch / "not all" / "IM00001.dcm")[DCM_PixelPaddingValue], "<missing>");
}

TEST(DerivedSeries, KeepsTheMarkOfLossyCompression) {
  const Scratch scratch;
  DerivedSource source;
  source.set_all(DCM_LossyImageCompression, "01");
  source.set_all(DCM_LossyImageCompressionRatio, "8");
  source.set_all(DCM_LossyImageCompressionMethod, "ISO_15444_1");
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  EXPECT_EQ(file[DCM_LossyImageCompression] + file[DCM_LossyImageCompressionRatio], "018");
  EXPECT_EQ(file[DCM_LossyImageCompressionMethod], "ISO_15444_1");
}

TEST(DerivedSeries, MarksPixelsThatOnlyTheirTransferSyntaxCallsLossy) {
  const Scratch scratch;
  DJLSEncoderRegistration::registerCodecs();
  write_stack(scratch / "in", 2, [](int, MadeSlice& slice) {
    slice.encoding = EXS_JPEGLSLossy;
    slice.is_signed = false;
  });
  DJLSEncoderRegistration::cleanup();
  for (const auto& entry : fs::directory_iterator(scratch / "in")) {
    DcmFileFormat format;
    ASSERT_TRUE(format.loadFile(entry.path().c_str()).good());
    ASSERT_TRUE(format.loadAllDataIntoMemory().good());
    format.getDataset()->findAndDeleteElement(DCM_LossyImageCompression);
    ASSERT_TRUE(format.saveFile(entry.path().c_str(), EXS_JPEGLSLossy).good());
  }
  const DicomVolume source = load_dicom(scan_dicom(scratch / "in").series.at(0));
  fs::create_directory(scratch / "out");
  write_derived_series(scratch / "out", view(source.volume), *source.headers, {});
  EXPECT_EQ(Written(scratch / "out" / kNames[0])[DCM_LossyImageCompression], "01");
}

TEST(DerivedSeries, CutsALongDescriptionAt64Characters) {
  const Scratch scratch;
  DerivedSource source;
  source.set_all(DCM_SeriesDescription, std::string(60, 'x') + "1234");
  source.write(scratch / "ascii");
  EXPECT_EQ(Written(scratch / "ascii" / kNames[0])[DCM_SeriesDescription], "deformed: " + std::string(54, 'x'));
  source.set_all(DCM_SpecificCharacterSet, "ISO_IR 192");
  source.set_all(DCM_SeriesDescription, std::string(53, 'x') + "\xc3\xa4\xc3\xb6");
  source.write(scratch / "utf8");
  EXPECT_EQ(Written(scratch / "utf8" / kNames[0])[DCM_SeriesDescription], "deformed");
}

TEST(DerivedSeries, LeavesOutReferencesToImagesWithoutUid) {
  const Scratch scratch;
  DerivedSource source;
  set(source[1], DCM_SOPInstanceUID, "");
  set(source[0], DCM_SOPInstanceUID, "no uid");
  source.sampled[2] = {};
  source.write(scratch.path());
  EXPECT_FALSE(Written(scratch / kNames[0]).data().tagExists(DCM_SourceImageSequence));
  EXPECT_EQ(items_of(Written(scratch / kNames[1]).data(), DCM_SourceImageSequence), 1U);
  EXPECT_FALSE(Written(scratch / kNames[2]).data().tagExists(DCM_SourceImageSequence));
}

TEST(DerivedSeries, SequencesOfUnknownVrDoNotBreakIt) {
  const Scratch scratch;
  DerivedSource source;
  const Uint8 bytes[8] = {0xfe, 0xff, 0x00, 0xe0, 0, 0, 0, 0};  // one empty item
  for (const auto& slice : source.headers.slices) {
    for (const DcmTagKey& tag :
         {DCM_ContributingEquipmentSequence, DCM_DerivationCodeSequence, DCM_ProcedureCodeSequence}) {
      auto* element = new DcmOtherByteOtherWord(DcmTag(tag, EVR_UN));
      ASSERT_TRUE(element->putUint8Array(bytes, 8).good());
      ASSERT_TRUE(slice->insert(element, OFTrue).good());
    }
  }
  source.write(scratch.path());
  Written file(scratch / kNames[0]);
  EXPECT_EQ(items_of(file.data(), DCM_ContributingEquipmentSequence), 1U);
  EXPECT_EQ(items_of(file.data(), DCM_DerivationCodeSequence), 1U);
}

TEST(DerivedSeries, RefusesWhatCannotBeWritten) {
  const Scratch scratch;
  const auto refused = [&](auto change) {
    DerivedSource source;
    change(source);
    EXPECT_THROW(source.write(scratch.path()), InputError);
  };
  refused([](DerivedSource& source) { source.headers.slices.pop_back(); });
  refused([](DerivedSource& source) { source.sampled.pop_back(); });
  refused([](DerivedSource& source) { source.sampled[0] = {0, 3}; });
  refused([](DerivedSource& source) { source.volume.geometry.spacing.x = 0; });
  const DerivedSource source;
  Volume<float> floats{source.volume.geometry, std::vector<float>(source.volume.voxels.size())};
  EXPECT_THROW(write_derived_series(scratch.path(), view(floats), source.headers, source.derivation), InputError);
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST(DerivedSeries, NamesTheFileThatCannotBeWritten) {
  const Scratch scratch;
  const DerivedSource source;
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto with_a_full_disk = [&] {
    const rlimit limit{1000, 1000};
    std::signal(SIGXFSZ, SIG_IGN);
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      source.write(scratch.path());
    } catch (const Error& error) {
      const std::string message = error.what();
      const bool good =
          message.find("IM00001.dcm") != std::string::npos && message.find("File too large") != std::string::npos;
      fs::remove_all(scratch.path());  // _Exit runs no destructors
      std::_Exit(good ? 0 : 1);
    }
    std::_Exit(2);
  };
  EXPECT_EXIT(with_a_full_disk(), testing::ExitedWithCode(0), "");
}

TEST(DerivedSeries, StopsWhenAsked) {
  const Scratch scratch;
  const DerivedSource source;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(write_derived_series(scratch.path(), view(source.volume), source.headers, source.derivation, {}, 0,
                                    {.stop = stop.get_token()}),
               Cancelled);
}

TEST(TetwarpDicom, IsToldFromOthers) {
  const Scratch scratch;
  DerivedSource source;
  source.write(scratch.path());
  EXPECT_TRUE(is_tetwarp_dicom(scratch / kNames[0]));
  write_file(scratch / "text.dcm", "Tetwarp");
  EXPECT_FALSE(is_tetwarp_dicom(scratch / "text.dcm"));
  EXPECT_FALSE(is_tetwarp_dicom(scratch / "missing.dcm"));
  Written file(scratch / kNames[0]);
  DcmItem* later = nullptr;
  ASSERT_TRUE(file.data().findOrCreateSequenceItem(DCM_ContributingEquipmentSequence, later, -2).good());
  set(*later, DCM_Manufacturer, "ANOTHER");
  ASSERT_TRUE(file.format.saveFile((scratch / "changed.dcm").c_str()).good());
  EXPECT_FALSE(is_tetwarp_dicom(scratch / "changed.dcm"));
}

}  // namespace
}  // namespace tetwarp::test
