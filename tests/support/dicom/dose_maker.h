// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

/// A small RT Dose file. Value n is stored as 1000 n in 16 bits, or as 10 000 n in 32 bits.
struct MadeDose {
  int bits = 32;
  std::string frames = "3", offsets = "0\\2.5\\5", position = "-10\\20\\7", orientation = "1\\0\\0\\0\\1\\0";
  std::string sop_class = UID_RTDoseStorage;
  int missing_words = 0;
  int columns = 4, rows = 2, count = 24;  ///< voxels
  std::string spacing = "2\\3", frame = "1.2.4", study = "1.2", patient = "SECRET-ID";
  std::function<unsigned(unsigned)> stored = {};
  std::function<void(DcmDataset&)> edit = {};  ///< changes the data set at last, before it is written
  E_TransferSyntax encoding = EXS_LittleEndianExplicit;

  void write(const std::filesystem::path& path) const {
    DcmFileFormat format;
    DcmDataset& data = *format.getDataset();
    put_texts(data);
    put_plan(data);
    for (const auto& [tag, value] : std::initializer_list<std::pair<DcmTagKey, int>>{{DCM_Rows, rows},
                                                                                     {DCM_Columns, columns},
                                                                                     {DCM_BitsAllocated, bits},
                                                                                     {DCM_BitsStored, bits},
                                                                                     {DCM_HighBit, bits - 1},
                                                                                     {DCM_SamplesPerPixel, 1},
                                                                                     {DCM_PixelRepresentation, 0}}) {
      data.putAndInsertUint16(tag, static_cast<Uint16>(value));
    }
    std::vector<Uint16> words;
    for (unsigned n = 0; n < static_cast<unsigned>(count); ++n) {
      const unsigned value = stored ? stored(n) : 1000 * n * (bits == 32 ? 10 : 1);
      words.push_back(static_cast<Uint16>(value));
      if (bits == 32) words.push_back(static_cast<Uint16>(value >> 16));
    }
    words.resize(words.size() - static_cast<std::size_t>(missing_words));
    data.putAndInsertUint16Array(DCM_PixelData, words.data(), words.size());
    if (edit) edit(data);
    const OFCondition result = format.saveFile(path.c_str(), encoding);
    if (result.bad()) throw std::runtime_error(result.text());
  }

 private:
  void put_texts(DcmDataset& data) const {
    for (const auto& [tag, text] :
         std::initializer_list<std::pair<DcmTagKey, std::string>>{{DCM_SOPClassUID, sop_class},
                                                                  {DCM_SOPInstanceUID, "1.2.3"},
                                                                  {DCM_SeriesInstanceUID, "1.2.7"},
                                                                  {DCM_StudyInstanceUID, study},
                                                                  {DCM_FrameOfReferenceUID, frame},
                                                                  {DCM_Modality, "RTDOSE"},
                                                                  {DCM_PatientName, "SECRET^NAME"},
                                                                  {DCM_PatientID, patient},
                                                                  {DCM_PatientSex, ""},
                                                                  {DCM_StudyDate, "20200102"},
                                                                  {DCM_SeriesNumber, "14"},
                                                                  {DCM_SeriesDescription, "Plan dose"},
                                                                  {DCM_OperatorsName, "SECRET^PLANNER"},
                                                                  {DCM_PhotometricInterpretation, "MONOCHROME2"},
                                                                  {DcmTagKey(0x0029, 0x0010), "PRIVATE MAKER"},
                                                                  {DCM_DoseUnits, "GY"},
                                                                  {DCM_DoseType, "PHYSICAL"},
                                                                  {DCM_DoseSummationType, "PLAN"},
                                                                  {DCM_TissueHeterogeneityCorrection, "IMAGE"},
                                                                  {DCM_NormalizationPoint, "1\\2\\3"},
                                                                  {DCM_NumberOfFrames, frames},
                                                                  {DCM_GridFrameOffsetVector, offsets},
                                                                  {DCM_ImagePositionPatient, position},
                                                                  {DCM_ImageOrientationPatient, orientation},
                                                                  {DCM_PixelSpacing, spacing},
                                                                  {DCM_DoseGridScaling, "0.0005"}}) {
      data.putAndInsertString(tag, text.c_str());
    }
    data.putAndInsertTagKey(DCM_FrameIncrementPointer, DCM_GridFrameOffsetVector);
  }

  /// Puts references to the dose's plan and its structures, and a histogram.
  static void put_plan(DcmDataset& data) {
    const auto refer = [&](const DcmTagKey& sequence, const char* class_uid, const char* instance) {
      DcmItem* item = nullptr;
      if (data.findOrCreateSequenceItem(sequence, item, -2).bad()) throw std::runtime_error("no item");
      item->putAndInsertString(DCM_ReferencedSOPClassUID, class_uid);
      item->putAndInsertString(DCM_ReferencedSOPInstanceUID, instance);
    };
    refer(DCM_ReferencedRTPlanSequence, UID_RTPlanStorage, "1.2.8.1");
    refer(DCM_ReferencedStructureSetSequence, UID_RTStructureSetStorage, "1.2.8.2");
    DcmItem* histogram = nullptr;
    if (data.findOrCreateSequenceItem(DCM_DVHSequence, histogram, -2).bad()) throw std::runtime_error("no item");
    histogram->putAndInsertString(DCM_DVHType, "CUMULATIVE");
  }
};
