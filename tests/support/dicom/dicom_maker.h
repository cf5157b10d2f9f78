// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

/// A tiny CT slice as a scanner might write it. A test changes the members that it is about.
struct MadeSlice {
  int rows = 4, columns = 6;
  int bits_allocated = 16, bits_stored = 16, high_bit = 15;
  bool is_signed = true;
  std::vector<std::uint16_t> words;  ///< empty: pixel i holds i
  std::string position = "-10\\-20\\30", orientation = "1\\0\\0\\0\\1\\0", spacing = "0.75\\0.5";  // rows 0.75 mm apart
  std::string slope = "1", intercept = "-1024";
  std::string sop_class = UID_CTImageStorage, sop_instance = "1.2.3.1", series = "1.2.3", study = "1.2",
              frame = "1.2.4";
  std::string modality = "CT", image_type = "ORIGINAL\\PRIMARY\\AXIAL";
  int instance_number = 1, series_number = 1;
  E_TransferSyntax encoding = EXS_LittleEndianExplicit;
  const DcmRepresentationParameter* encoder_parameter = nullptr;
  std::function<void(DcmDataset&)> edit;  ///< changes the data set at last, before it is written
};

inline std::vector<std::uint16_t> words_of(const MadeSlice& slice) {
  std::vector<std::uint16_t> words = slice.words;
  for (int i = 0; std::ssize(words) < slice.rows * slice.columns; ++i) words.push_back(static_cast<std::uint16_t>(i));
  return words;
}

inline void put_pixels(DcmDataset& data, const MadeSlice& slice) {
  const std::vector<std::uint16_t> words = words_of(slice);
  if (slice.bits_allocated == 8) {
    std::vector<Uint8> bytes(words.begin(), words.end());
    data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size());
  } else {
    data.putAndInsertUint16Array(DCM_PixelData, words.data(), words.size());
  }
}

/// Puts all attributes of a slice but Pixel Data.
inline void put_attributes(DcmDataset& data, const MadeSlice& slice) {
  const auto text = [&](const DcmTagKey& tag, const std::string& value) {
    data.putAndInsertString(tag, value.c_str());
  };
  const auto word = [&](const DcmTagKey& tag, int value) { data.putAndInsertUint16(tag, static_cast<Uint16>(value)); };
  text(DCM_SOPClassUID, slice.sop_class);
  text(DCM_SOPInstanceUID, slice.sop_instance);
  text(DCM_SeriesInstanceUID, slice.series);
  text(DCM_StudyInstanceUID, slice.study);
  text(DCM_FrameOfReferenceUID, slice.frame);
  text(DCM_Modality, slice.modality);
  text(DCM_ImageType, slice.image_type);
  text(DCM_PatientName, "SECRET^NAME");
  text(DCM_PatientID, "SECRET-ID");
  text(DCM_InstanceNumber, std::to_string(slice.instance_number));
  text(DCM_SeriesNumber, std::to_string(slice.series_number));
  text(DCM_ImagePositionPatient, slice.position);
  text(DCM_ImageOrientationPatient, slice.orientation);
  text(DCM_PixelSpacing, slice.spacing);
  text(DCM_RescaleSlope, slice.slope);
  text(DCM_RescaleIntercept, slice.intercept);
  text(DCM_PhotometricInterpretation, "MONOCHROME2");
  word(DCM_SamplesPerPixel, 1);
  word(DCM_Rows, slice.rows);
  word(DCM_Columns, slice.columns);
  word(DCM_BitsAllocated, slice.bits_allocated);
  word(DCM_BitsStored, slice.bits_stored);
  word(DCM_HighBit, slice.high_bit);
  word(DCM_PixelRepresentation, slice.is_signed ? 1 : 0);
}

/// Writes the slice. Its transfer syntax may also be one that a registered encoder of DCMTK makes.
inline void write_slice(const std::filesystem::path& path, const MadeSlice& slice) {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  put_attributes(data, slice);
  put_pixels(data, slice);
  if (slice.edit) slice.edit(data);
  const OFCondition coded = data.chooseRepresentation(slice.encoding, slice.encoder_parameter);
  if (coded.bad()) throw std::runtime_error(std::string(DcmXfer(slice.encoding).getXferName()) + ": " + coded.text());
  const OFCondition result = format.saveFile(path.c_str(), slice.encoding);
  if (result.bad()) throw std::runtime_error(result.text());
}

/// Image Position of a slice as text, z with six decimals.
inline std::string position_text(double x, double y, double z) {
  char text[64];
  std::snprintf(text, sizeof text, "%g\\%g\\%.6f", x, y, z);
  return text;
}

/// Writes slices "s00.dcm" and so on, 2.5 mm apart along z; `change(k, slice)` may change each.
inline void write_stack(
    const std::filesystem::path& folder, int count,
    const std::function<void(int, MadeSlice&)>& change = [](int, MadeSlice&) {}) {
  std::filesystem::create_directories(folder);
  for (int k = 0; k < count; ++k) {
    MadeSlice slice;
    slice.position = position_text(-10, -20, 30 + 2.5 * k);
    slice.instance_number = k + 1;
    slice.sop_instance = std::string("1.2.3.").append(std::to_string(k + 1));
    change(k, slice);
    char name[24];
    std::snprintf(name, sizeof name, "s%02d.dcm", k);
    write_slice(folder / name, slice);
  }
}
