// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <memory>

#include "tests/support/dicom/dicom_maker.h"

// Enhanced CT objects (PS3.3 A.38) made of classic slices, as a converter might make them.

/// Classic slices in memory, native Pixel Data included, in the order of the frames.
using ClassicSlices = std::vector<std::unique_ptr<DcmDataset>>;

inline std::unique_ptr<DcmDataset> classic_slice(const MadeSlice& slice) {
  auto data = std::make_unique<DcmDataset>();
  put_attributes(*data, slice);
  put_pixels(*data, slice);
  if (slice.edit) slice.edit(*data);
  return data;
}

/// The slices that `write_stack` writes, in memory.
inline ClassicSlices classic_stack(
    int count, const std::function<void(int, MadeSlice&)>& change = [](int, MadeSlice&) {}) {
  ClassicSlices slices;
  for (int k = 0; k < count; ++k) {
    MadeSlice slice;
    slice.position = position_text(-10, -20, 30 + 2.5 * k);
    slice.instance_number = k + 1;
    slice.sop_instance = std::string("1.2.3.").append(std::to_string(k + 1));
    for (int i = 0; i < slice.rows * slice.columns; ++i) slice.words.push_back(static_cast<std::uint16_t>(i + 100 * k));
    change(k, slice);
    slices.push_back(classic_slice(slice));
  }
  return slices;
}

/// Writes slices as classic files, "s000.dcm" and so on.
inline void write_classic(const std::filesystem::path& folder, const ClassicSlices& slices) {
  std::filesystem::create_directories(folder);
  for (std::size_t k = 0; k < slices.size(); ++k) {
    char name[16];
    std::snprintf(name, sizeof name, "s%03d.dcm", static_cast<int>(k));
    DcmFileFormat format(slices[k].get());
    const OFCondition result = format.saveFile((folder / name).c_str(), EXS_LittleEndianExplicit);
    if (result.bad()) throw std::runtime_error(result.text());
  }
}

/// Reads the slices of files, whose Pixel Data become uncompressed.
inline ClassicSlices classic_files(const std::vector<std::filesystem::path>& files) {
  ClassicSlices slices;
  for (const std::filesystem::path& file : files) {
    DcmFileFormat format;
    if (format.loadFile(file.c_str()).bad() || format.loadAllDataIntoMemory().bad() ||
        format.getDataset()->chooseRepresentation(EXS_LittleEndianExplicit, nullptr).bad())
      throw std::runtime_error("cannot read " + file.string());
    slices.emplace_back(format.getAndRemoveDataset());
  }
  return slices;
}

/// The item of a functional group. It is made if it is not there.
inline DcmItem& macro_of(DcmItem& groups, const DcmTagKey& sequence) {
  DcmItem* item = nullptr;
  groups.findOrCreateSequenceItem(sequence, item, 0);
  return *item;
}

inline void copy_text(DcmItem& from, const DcmTagKey& old_tag, DcmItem& to, const DcmTagKey& tag) {
  OFString value;
  if (from.findAndGetOFStringArray(old_tag, value).good()) to.putAndInsertString(tag, value.c_str());
}

struct MadeEnhanced {
  std::string sop_class = UID_EnhancedCTImageStorage, sop_instance = "1.2.3.900";
  bool all_shared = false;  ///< spacing and orientation are shared; otherwise each frame has its own
  std::function<void(int, DcmItem&)> edit_groups = {};  ///< changes the functional groups of a frame
  std::function<void(DcmDataset&)> edit = {};           ///< changes the data set at last, before it is written

  /// An Enhanced CT object made of classic slices. The words of its Pixel Data are those of the slices, one after the
  /// other.
  std::unique_ptr<DcmDataset> of(const ClassicSlices& slices) const {
    auto data = std::make_unique<DcmDataset>(*slices.front());
    const DcmTagKey moved[] = {DCM_ImagePositionPatient, DCM_ImageOrientationPatient,
                               DCM_PixelSpacing,         DCM_SliceThickness,
                               DCM_RescaleSlope,         DCM_RescaleIntercept,
                               DCM_RescaleType,          DCM_KVP,
                               DCM_ConvolutionKernel,    DCM_AcquisitionNumber,
                               DCM_AcquisitionDate,      DCM_AcquisitionTime,
                               DCM_SliceLocation,        DCM_PixelData,
                               DCM_ImageComments};
    for (const DcmTagKey& tag : moved) data->findAndDeleteElement(tag);
    data->putAndInsertString(DCM_SOPClassUID, sop_class.c_str());
    data->putAndInsertString(DCM_SOPInstanceUID, sop_instance.c_str());
    data->putAndInsertString(DCM_NumberOfFrames, std::to_string(slices.size()).c_str());
    data->putAndInsertString(DCM_ImageType, "ORIGINAL\\PRIMARY\\VOLUME\\NONE");
    data->putAndInsertString(DCM_ContentDate, "20200104");
    data->putAndInsertString(DCM_ContentTime, "101112");
    data->putAndInsertString(DCM_AcquisitionDateTime, "20200104101112");
    DcmItem* shared = nullptr;
    data->findOrCreateSequenceItem(DCM_SharedFunctionalGroupsSequence, shared, -2);
    if (all_shared) put_shared(*slices.front(), *shared);
    copy_text(*slices.front(), DCM_KVP, macro_of(*shared, DCM_CTXRayDetailsSequence), DCM_KVP);
    copy_text(*slices.front(), DCM_ConvolutionKernel, macro_of(*shared, DCM_CTReconstructionSequence),
              DCM_ConvolutionKernel);
    for (std::size_t k = 0; k < slices.size(); ++k) put_frame(*data, *slices[k], static_cast<int>(k));
    put_words(*data, slices);
    if (edit) edit(*data);
    return data;
  }

  void write(const std::filesystem::path& path, const ClassicSlices& slices,
             E_TransferSyntax encoding = EXS_LittleEndianExplicit) const {
    std::filesystem::create_directories(path.parent_path());
    const std::unique_ptr<DcmDataset> data = of(slices);
    DcmFileFormat format(data.get());
    if (format.getDataset()->chooseRepresentation(encoding, nullptr).bad()) throw std::runtime_error("no encoder");
    const OFCondition result = format.saveFile(path.c_str(), encoding);
    if (result.bad()) throw std::runtime_error(result.text());
  }

 private:
  static void put_shared(DcmItem& slice, DcmItem& groups) {
    copy_text(slice, DCM_ImageOrientationPatient, macro_of(groups, DCM_PlaneOrientationSequence),
              DCM_ImageOrientationPatient);
    DcmItem& measures = macro_of(groups, DCM_PixelMeasuresSequence);
    copy_text(slice, DCM_PixelSpacing, measures, DCM_PixelSpacing);
    copy_text(slice, DCM_SliceThickness, measures, DCM_SliceThickness);
  }

  void put_frame(DcmDataset& data, DcmDataset& slice, int k) const {
    DcmItem* groups = nullptr;
    data.findOrCreateSequenceItem(DCM_PerFrameFunctionalGroupsSequence, groups, -2);
    copy_text(slice, DCM_ImagePositionPatient, macro_of(*groups, DCM_PlanePositionSequence), DCM_ImagePositionPatient);
    if (!all_shared) put_shared(slice, *groups);
    DcmItem& values = macro_of(*groups, DCM_PixelValueTransformationSequence);
    copy_text(slice, DCM_RescaleSlope, values, DCM_RescaleSlope);
    copy_text(slice, DCM_RescaleIntercept, values, DCM_RescaleIntercept);
    values.putAndInsertString(DCM_RescaleType, "HU");
    DcmItem& content = macro_of(*groups, DCM_FrameContentSequence);
    content.putAndInsertString(DCM_StackID, "1");
    content.putAndInsertUint32(DCM_InStackPositionNumber, static_cast<Uint32>(k + 1));
    Sint32 acquisition = 0;
    if (slice.findAndGetSint32(DCM_AcquisitionNumber, acquisition).good())
      content.putAndInsertUint16(DCM_FrameAcquisitionNumber, static_cast<Uint16>(acquisition));
    copy_text(slice, DCM_ImageComments, content, DCM_FrameComments);
    copy_text(slice, DCM_ImageType, macro_of(*groups, DCM_CTImageFrameTypeSequence), DCM_FrameType);
    if (edit_groups) edit_groups(k, *groups);
  }

  static void put_words(DcmDataset& data, const ClassicSlices& slices) {
    Uint16 allocated = 16, rows = 0, columns = 0;
    data.findAndGetUint16(DCM_BitsAllocated, allocated);
    data.findAndGetUint16(DCM_Rows, rows);
    data.findAndGetUint16(DCM_Columns, columns);
    // A file of one slice may have a byte of padding, which is left out.
    const std::size_t size = std::size_t{rows} * columns;
    std::vector<Uint8> bytes;
    std::vector<Uint16> words;
    for (const auto& slice : slices) {
      const Uint16* found = nullptr;
      const Uint8* octets = nullptr;
      unsigned long count = 0;
      if (allocated == 8 && slice->findAndGetUint8Array(DCM_PixelData, octets, &count).good())
        bytes.insert(bytes.end(), octets, octets + std::min<std::size_t>(count, size));
      else if (slice->findAndGetUint16Array(DCM_PixelData, found, &count).good())
        words.insert(words.end(), found, found + std::min<std::size_t>(count, size));
    }
    if (allocated == 8)
      data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size());
    else
      data.putAndInsertUint16Array(DCM_PixelData, words.data(), words.size());
  }
};
