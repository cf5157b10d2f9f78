// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_dose.h"

#include <gtest/gtest.h>

#include "tests/support/dicom/dose_maker.h"
#include "tests/support/dicom/encapsulated.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

TEST(Dose, IsStoredValuesTimesTheScalingOnTheGridThatTheHeaderGives) {
  const Scratch scratch;
  for (const int bits : {16, 32}) {
    MadeDose{.bits = bits}.write(scratch / "dose");
    ASSERT_TRUE(is_dicom_dose(scratch / "dose"));
    EXPECT_EQ(read_dose_header(scratch / "dose").units, "GY");
    const AnyVolume dose = read_dose(scratch / "dose");
    EXPECT_EQ(dose.geometry(), (Geometry{{4, 2, 3}, {3, 2, 2.5}, {-10, 20, 7}, glm::dmat3(1)}));
    for (std::size_t n = 0; n < 24; ++n) {
      EXPECT_FLOAT_EQ(dose.as<float>()[n], (bits == 32 ? 5.0F : 0.5F) * static_cast<float>(n));
    }
  }
}

TEST(Dose, EveryCodingThatCompressesNoPixelsGivesTheSameValues) {
  const Scratch scratch;
  for (const E_TransferSyntax encoding :
       {EXS_LittleEndianImplicit, EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit}) {
    for (const int bits : {16, 32}) {
      MadeDose{.bits = bits, .encoding = encoding}.write(scratch / "dose");
      const AnyVolume dose = read_dose(scratch / "dose");
      for (std::size_t n = 0; n < 24; ++n) {
        EXPECT_FLOAT_EQ(dose.as<float>()[n], (bits == 32 ? 5.0F : 0.5F) * static_cast<float>(n)) << encoding;
      }
    }
  }
}

TEST(Dose, CompressedPixelsAreRefusedByTheirName) {
  const Scratch scratch;
  for (const auto& [uid, name] : {std::pair{UID_RLELosslessTransferSyntax, "RLE Lossless"},
                                  std::pair{UID_JPEGLSLosslessTransferSyntax, "JPEG-LS"}}) {
    std::string attributes;
    MadeDose{.edit = [&](DcmDataset& data) { attributes = attributes_of(data); }}.write(scratch / "dose");
    write_file(scratch / "dose", file_start(uid) + attributes + encapsulated({std::string(64, '\0')}));
    try {
      read_dose(scratch / "dose");
      FAIL() << name;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {"has compressed pixels", name, "a dose must have plain ones", "decompress"}));
    }
  }
}

TEST(Dose, OnlyTheStoredBitsCountWithTheirSign) {
  const Scratch scratch;
  for (const int bits : {16, 32}) {
    for (const bool is_signed : {false, true}) {
      MadeDose dose{.bits = bits};
      dose.stored = [](unsigned n) { return (n * 91 & 0xfff) << 1 | 0xffffe001; };  // 12 bits to bit 12, others set
      dose.edit = [=](DcmDataset& data) {
        data.putAndInsertUint16(DCM_BitsStored, 12);
        data.putAndInsertUint16(DCM_HighBit, 12);
        data.putAndInsertUint16(DCM_PixelRepresentation, is_signed);
      };
      dose.write(scratch / "dose");
      const AnyVolume read = read_dose(scratch / "dose");
      for (int n = 0; n < 24; ++n) {
        const int value = n * 91, stored = is_signed && value > 2047 ? value - 4096 : value;
        EXPECT_FLOAT_EQ(read.as<float>()[static_cast<std::size_t>(n)], 0.0005F * static_cast<float>(stored)) << n;
      }
    }
  }
}

TEST(Dose, UnitsThatTheStandardDoesNotDefineAreNotShown) {
  const Scratch scratch;
  MadeDose{.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_DoseUnits, "SECRET"); }}.write(scratch / "dose");
  EXPECT_EQ(read_dose_header(scratch / "dose").units, "no known value");
}

TEST(Dose, FramesMayLieAtPatientCoordinatesOrAgainstTheNormal) {
  const Scratch scratch;
  MadeDose{.offsets = "7\\10\\13"}.write(scratch / "absolute");
  EXPECT_EQ(read_dose_header(scratch / "absolute").geometry,
            (Geometry{{4, 2, 3}, {3, 2, 3}, {-10, 20, 7}, glm::dmat3(1)}));
  MadeDose{.offsets = "0\\-2\\-4"}.write(scratch / "down");
  const Geometry down = read_dose_header(scratch / "down").geometry;
  EXPECT_EQ(down.spacing.z, 2);
  EXPECT_EQ(down.direction[2], glm::dvec3(0, 0, -1));
  MadeDose{.offsets = "7\\10\\13", .orientation = "1\\0\\0\\0\\-1\\0"}.write(scratch / "turned");  // normal: -z
  const Geometry turned = read_dose_header(scratch / "turned").geometry;
  EXPECT_EQ(turned.direction[2], glm::dvec3(0, 0, 1));
  EXPECT_EQ(turned.spacing.z, 3);
}

TEST(Dose, WhatIsNoEvenGridOrCutShortIsRefused) {
  const Scratch scratch;
  const auto refused = [&](const MadeDose& dose, const char* names) {
    dose.write(scratch / "dose");
    try {
      read_dose(scratch / "dose");
      FAIL() << names;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(names), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("dose"), std::string::npos) << error.what();
    }
  };
  refused({.offsets = "0\\2.5\\6"}, "uneven");
  refused({.offsets = "0\\2.5"}, "GridFrameOffsetVector");
  refused({.offsets = "8\\10\\12"}, "Image Position");
  refused({.position = "1\\2"}, "ImagePositionPatient");
  refused({.orientation = "1\\0\\0\\0\\0.9\\0"},
          "no rotation: expected lengths 1, 1 and product 0, found 1, 0.9 and 0");
  refused({.frames = "1", .offsets = "0", .count = 8}, "one frame");
  refused({.missing_words = 2}, "cut short");
  refused({.frames = "2", .offsets = "0\\2.5"}, "96 bytes of Pixel Data (7FE0,0010), expected 64");
  for (const char* scaling : {"0", "-0.0005"}) {
    MadeDose dose;
    dose.edit = [=](DcmDataset& data) { data.putAndInsertString(DCM_DoseGridScaling, scaling); };
    refused(dose, "expected more than 0");
  }
  const auto with = [](const DcmTagKey& tag, int value) {
    MadeDose dose;
    dose.edit = [=](DcmDataset& data) { data.putAndInsertUint16(tag, static_cast<Uint16>(value)); };
    return dose;
  };
  refused(with(DCM_BitsAllocated, 8), "Bits Allocated (0028,0100) 8, expected 16 or 32");
  refused(with(DCM_BitsStored, 33), "Bits Stored (0028,0101), expected 1 to 32, found 33");
  refused(with(DCM_BitsStored, 0), "Bits Stored (0028,0101), expected 1 to 32, found 0");
  refused(with(DCM_HighBit, 32), "High Bit (0028,0102), expected 31, found 32");
  refused(with(DCM_PixelRepresentation, 2), "Pixel Representation (0028,0103) 2, expected 0 or 1");
  refused(with(DCM_SamplesPerPixel, 3), "Samples per Pixel (0028,0002) 3, expected 1");
  refused({.sop_class = UID_CTImageStorage}, "no RT Dose");
  write_file(scratch / "text", "not DICOM");
  EXPECT_FALSE(is_dicom_dose(scratch / "text"));
  EXPECT_FALSE(is_dicom_dose(scratch / "missing"));
  EXPECT_THROW(read_dose(scratch / "missing"), InputError);
}

// SOURCE.md: 1048626 at most, times 1.4e-5 Gy.
TEST(Dose, OfARealPlanIsReadWhole) {
  TETWARP_REAL_DATA(folder, "rt-breast");
  const AnyVolume dose = read_dose(folder / "rtdose.dcm");
  EXPECT_EQ(dose.geometry(),
            (Geometry{{194, 129, 98}, {2.5, 2.5, 3}, {-228.6541915, -419.2444776, -122.4407}, glm::dmat3(1)}));
  const auto values = dose.as<float>();
  EXPECT_FLOAT_EQ(*std::max_element(values.begin(), values.end()), 1048626 * 1.4e-5F);
  EXPECT_FLOAT_EQ(*std::min_element(values.begin(), values.end()), 0);
}

}  // namespace
}  // namespace tetwarp
