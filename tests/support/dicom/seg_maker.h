// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/dicom/dicom_maker.h"

/// A small DICOM segmentation as an annotation program might write it: slice by slice, frames without a voxel left out.
struct MadeSeg {
  int columns = 6, rows = 4, slices = 3;
  glm::dvec3 origin{-10, -20, 30}, spacing{0.5, 0.75, 2.5};
  bool fractional = false;
  int label_bits = 0;                                 ///< 8 or 16: a label map, in which the last segment wins
  int largest = 255;                                  ///< Maximum Fractional Value
  std::vector<int> segments = {1, 2};                 ///< Segment Numbers
  std::function<int(int, int, int, int)> value = {};  ///< value of segment n at voxel (i, j, k)
  std::string spacing_between = "2.5", frame = "1.2.4", study = "1.2", patient = "SECRET-ID";
  E_TransferSyntax encoding = EXS_LittleEndianExplicit;  ///< of a compressed one the encoder must be registered
  std::function<void(DcmDataset&)> edit = {};            ///< changes the data set at last, before it is written

  void write(const std::filesystem::path& path) const {
    DcmFileFormat format;
    DcmDataset& data = *format.getDataset();
    put_header(data);
    put_segments(data);
    put_shared(data);
    put_frames(data);
    if (edit) edit(data);
    if (data.chooseRepresentation(encoding, nullptr).bad()) throw std::runtime_error("no such coding");
    const OFCondition result = format.saveFile(path.c_str(), encoding);
    if (result.bad()) throw std::runtime_error(result.text());
  }

  static void text(DcmItem& item, const DcmTagKey& tag, const std::string& written) {
    item.putAndInsertString(tag, written.c_str());
  }
  static void word(DcmItem& item, const DcmTagKey& tag, int written) {
    item.putAndInsertUint16(tag, static_cast<Uint16>(written));
  }
  static DcmItem& append(DcmItem& item, const DcmTagKey& sequence) {
    DcmItem* appended = nullptr;
    if (item.findOrCreateSequenceItem(sequence, appended, -2).bad()) throw std::runtime_error("no item");
    return *appended;
  }
  static void code(DcmItem& item, const DcmTagKey& sequence, const char* coded, const char* scheme,
                   const char* meaning) {
    DcmItem& to = append(item, sequence);
    text(to, DCM_CodeValue, coded);
    text(to, DCM_CodingSchemeDesignator, scheme);
    text(to, DCM_CodeMeaning, meaning);
  }
  static constexpr char kDimensions[] = "1.2.6.1";
  static constexpr char kLabelMapStorage[] = "1.2.840.10008.5.1.4.1.1.66.7";

 private:
  void put_header(DcmDataset& data) const {
    for (const auto& [tag, given] : std::initializer_list<std::pair<DcmTagKey, std::string>>{
             {DCM_SOPClassUID, label_bits > 0 ? kLabelMapStorage : UID_SegmentationStorage},
             {DCM_SOPInstanceUID, "1.2.6.2"},
             {DCM_SeriesInstanceUID, "1.2.6"},
             {DCM_StudyInstanceUID, study},
             {DCM_FrameOfReferenceUID, frame},
             {DCM_PositionReferenceIndicator, ""},
             {DCM_Modality, "SEG"},
             {DCM_ImageType, "DERIVED\\PRIMARY"},
             {DCM_PatientName, "SECRET^NAME"},
             {DCM_PatientID, patient},
             {DCM_PatientBirthDate, ""},
             {DCM_PatientSex, ""},
             {DCM_StudyDate, "20200102"},
             {DCM_StudyTime, "030405"},
             {DCM_StudyID, "1"},
             {DCM_AccessionNumber, ""},
             {DCM_ReferringPhysicianName, ""},
             {DCM_SeriesNumber, "5"},
             {DCM_SeriesDescription, "Organs"},
             {DCM_InstanceNumber, "1"},
             {DCM_ContentDate, "20200103"},
             {DCM_ContentTime, "040506"},
             {DCM_Manufacturer, "Maker"},
             {DCM_ManufacturerModelName, "Model"},
             {DCM_DeviceSerialNumber, "7"},
             {DCM_SoftwareVersions, "1.0"},
             {DCM_ContentLabel, "ORGANS"},
             {DCM_ContentDescription, "Two organs"},
             {DCM_ContentCreatorName, "SECRET^READER"},
             {DCM_LossyImageCompression, "00"},
             {DCM_PhotometricInterpretation, "MONOCHROME2"},
             {DcmTagKey(0x0029, 0x0010), "PRIVATE MAKER"},
             {DCM_SegmentationType, label_bits > 0 ? "LABELMAP"
                                    : fractional   ? "FRACTIONAL"
                                                   : "BINARY"}}) {
      text(data, tag, given);
    }
    const int bits = label_bits > 0 ? label_bits : fractional ? 8 : 1;
    for (const auto& [tag, given] : std::initializer_list<std::pair<DcmTagKey, int>>{{DCM_Rows, rows},
                                                                                     {DCM_Columns, columns},
                                                                                     {DCM_SamplesPerPixel, 1},
                                                                                     {DCM_BitsAllocated, bits},
                                                                                     {DCM_BitsStored, bits},
                                                                                     {DCM_HighBit, bits - 1},
                                                                                     {DCM_PixelRepresentation, 0}})
      word(data, tag, given);
    if (!fractional) return;
    text(data, DCM_SegmentationFractionalType, "OCCUPANCY");
    word(data, DCM_MaximumFractionalValue, largest);
  }

  void put_segments(DcmDataset& data) const {
    std::vector<int> numbers = segments;
    if (label_bits > 0) numbers.insert(numbers.begin(), 0);  // the background
    for (const int number : numbers) {
      DcmItem& item = append(data, DCM_SegmentSequence);
      word(item, DCM_SegmentNumber, number);
      text(item, DCM_SegmentLabel, "Organ " + std::to_string(number));
      text(item, DCM_SegmentAlgorithmType, "SEMIAUTOMATIC");
      text(item, DCM_SegmentAlgorithmName, "Painter");
      text(item, DCM_TrackingID, "organ-" + std::to_string(number));
      text(item, DCM_TrackingUID, "1.2.6.9." + std::to_string(number));
      code(item, DCM_SegmentedPropertyCategoryCodeSequence, "123037004", "SCT", "Anatomical Structure");
      code(item, DCM_SegmentedPropertyTypeCodeSequence, "10200004", "SCT", "Liver");
      text(item, DcmTagKey(0x0029, 0x0010), "PRIVATE MAKER");
    }
    text(append(data, DCM_DimensionOrganizationSequence), DCM_DimensionOrganizationUID, kDimensions);
    const auto dimension = [&](const DcmTagKey& pointer, const DcmTagKey& group) {
      DcmItem& item = append(data, DCM_DimensionIndexSequence);
      text(item, DCM_DimensionOrganizationUID, kDimensions);
      item.putAndInsertTagKey(DCM_DimensionIndexPointer, pointer);
      item.putAndInsertTagKey(DCM_FunctionalGroupPointer, group);
    };
    dimension(DCM_ImagePositionPatient, DCM_PlanePositionSequence);
    dimension(DCM_ReferencedSegmentNumber, DCM_SegmentIdentificationSequence);
  }

  void put_shared(DcmDataset& data) const {
    DcmItem& shared = append(data, DCM_SharedFunctionalGroupsSequence);
    text(append(shared, DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient, "1\\0\\0\\0\\1\\0");
    DcmItem& measures = append(shared, DCM_PixelMeasuresSequence);
    text(measures, DCM_PixelSpacing, std::to_string(spacing.y) + "\\" + std::to_string(spacing.x));
    text(measures, DCM_SliceThickness, "3");
    if (!spacing_between.empty()) text(measures, DCM_SpacingBetweenSlices, spacing_between);
  }

  void put_frames(DcmDataset& data) const {
    if (label_bits > 0) return put_labels(data);
    std::vector<Uint8> pixels;
    std::size_t bit = 0;
    int frames = 0;
    for (int k = 0; k < slices; ++k) {
      for (std::size_t n = 0; n < segments.size(); ++n) {
        if (is_empty(static_cast<int>(n), k)) continue;
        ++frames;
        for (int pixel = 0; pixel < rows * columns; ++pixel, ++bit) {
          const int here = value(static_cast<int>(n), pixel % columns, pixel / columns, k);
          if (fractional || bit % 8 == 0) pixels.push_back(0);
          pixels.back() = static_cast<Uint8>(fractional ? here : pixels.back() | here << bit % 8);
        }
        word(append(put_frame(data, k, {k + 1, static_cast<int>(n) + 1}), DCM_SegmentIdentificationSequence),
             DCM_ReferencedSegmentNumber, segments[n]);
      }
    }
    text(data, DCM_NumberOfFrames, std::to_string(frames));
    if (pixels.size() % 2 != 0) pixels.push_back(0);
    data.putAndInsertUint8Array(DCM_PixelData, pixels.data(), pixels.size());
  }

  /// A frame for each slice, whose pixels are Segment Numbers.
  void put_labels(DcmDataset& data) const {
    std::vector<Uint16> labels;
    for (int k = 0; k < slices; ++k) {
      put_frame(data, k, {k + 1});
      for (int pixel = 0; pixel < rows * columns; ++pixel) {
        labels.push_back(0);
        for (std::size_t n = 0; n < segments.size(); ++n) {
          if (value(static_cast<int>(n), pixel % columns, pixel / columns, k) != 0)
            labels.back() = static_cast<Uint16>(segments[n]);
        }
      }
    }
    text(data, DCM_NumberOfFrames, std::to_string(slices));
    if (label_bits == 16) {
      data.putAndInsertUint16Array(DCM_PixelData, labels.data(), labels.size());
    } else {
      const std::vector<Uint8> bytes(labels.begin(), labels.end());
      data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size());
    }
  }

  DcmItem& put_frame(DcmDataset& data, int k, const std::vector<int>& dimensions) const {
    DcmItem& groups = append(data, DCM_PerFrameFunctionalGroupsSequence);
    const std::vector<Uint32> index(dimensions.begin(), dimensions.end());
    append(groups, DCM_FrameContentSequence)
        .putAndInsertUint32Array(DCM_DimensionIndexValues, index.data(), index.size());
    text(append(groups, DCM_PlanePositionSequence), DCM_ImagePositionPatient,
         position_text(origin.x, origin.y, origin.z + k * spacing.z));
    return groups;
  }

  bool is_empty(int segment, int k) const {
    for (int pixel = 0; pixel < rows * columns; ++pixel) {
      if (value(segment, pixel % columns, pixel / columns, k) != 0) return false;
    }
    return true;
  }
};
