// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>

#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/write_file.h"

// DICOM files whose Pixel Data are written byte by byte, for data that no encoder of DCMTK makes.

/// Appends an attribute in Explicit VR Little Endian. @param vr  two letters, or none for an item (PS3.5 7.1.2, 7.5)
inline void append_element(std::string& bytes, std::uint16_t group, std::uint16_t element, const std::string& vr,
                           std::uint32_t length) {
  append_value(bytes, group);
  append_value(bytes, element);
  const bool is_short = vr == "UI" || vr == "UL" || vr == "US";
  bytes += vr;
  if (is_short) {
    append_value(bytes, static_cast<std::uint16_t>(length));
    return;
  }
  if (!vr.empty()) bytes += std::string(2, '\0');
  append_value(bytes, length);
}

/// Preamble and meta header (PS3.10 7.1) that name a transfer syntax, whether or not DCMTK knows it.
inline std::string file_start(std::string transfer_syntax_uid) {
  if (transfer_syntax_uid.size() % 2 != 0) transfer_syntax_uid += '\0';
  std::string meta;
  append_element(meta, 2, 0x10, "UI", static_cast<std::uint32_t>(transfer_syntax_uid.size()));
  meta += transfer_syntax_uid;
  std::string bytes = std::string(128, '\0') + "DICM";
  append_element(bytes, 2, 0, "UL", 4);
  append_value(bytes, static_cast<std::uint32_t>(meta.size()));
  return bytes + meta;
}

/// The bytes of all attributes of a data set but Pixel Data, in Explicit VR Little Endian.
inline std::string attributes_of(DcmDataset& data) {
  delete data.remove(DCM_PixelData);
  std::string bytes(data.calcElementLength(EXS_LittleEndianExplicit, EET_ExplicitLength) + 1024, '\0');
  DcmOutputBufferStream stream(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  data.transferInit();
  if (data.write(stream, EXS_LittleEndianExplicit, EET_ExplicitLength, nullptr).bad())
    throw std::runtime_error("cannot encode the slice");
  data.transferEnd();
  void* buffer = nullptr;
  offile_off_t length = 0;
  stream.flushBuffer(buffer, length);
  bytes.resize(static_cast<std::size_t>(length));
  return bytes;
}

/// The bytes of all attributes of a slice but Pixel Data, in Explicit VR Little Endian.
inline std::string attributes_of(const MadeSlice& slice) {
  DcmDataset data;
  put_attributes(data, slice);
  if (slice.edit) slice.edit(data);
  return attributes_of(data);
}

/// Encapsulated Pixel Data (PS3.5 A.4). @param offsets  the Basic Offset Table, right or wrong
inline std::string encapsulated(const std::vector<std::string>& fragments,
                                const std::vector<std::uint32_t>& offsets = {}) {
  std::string bytes;
  append_element(bytes, 0x7fe0, 0x10, "OB", 0xffffffff);
  append_element(bytes, 0xfffe, 0xe000, "", static_cast<std::uint32_t>(4 * offsets.size()));
  for (const std::uint32_t offset : offsets) append_value(bytes, offset);
  for (const std::string& fragment : fragments) {
    append_element(bytes, 0xfffe, 0xe000, "", static_cast<std::uint32_t>(fragment.size()));
    bytes += fragment;
  }
  append_element(bytes, 0xfffe, 0xe0dd, "", 0);
  return bytes;
}

inline void write_encapsulated(const std::filesystem::path& path, const MadeSlice& slice,
                               const std::string& transfer_syntax_uid, const std::vector<std::string>& fragments,
                               const std::vector<std::uint32_t>& offsets = {}) {
  write_file(path, file_start(transfer_syntax_uid) + attributes_of(slice) + encapsulated(fragments, offsets));
}

/// All bytes of the fragments of a file that DCMTK can parse.
inline std::string frame_in(const std::filesystem::path& path) {
  DcmFileFormat format;
  DcmElement* element = nullptr;
  if (format.loadFile(path.c_str()).bad() || format.getDataset()->findAndGetElement(DCM_PixelData, element).bad())
    throw std::runtime_error("no Pixel Data in " + path.string());
  E_TransferSyntax encoding = EXS_Unknown;
  const DcmRepresentationParameter* parameter = nullptr;
  DcmPixelSequence* sequence = nullptr;
  auto& pixels = dynamic_cast<DcmPixelData&>(*element);
  pixels.getOriginalRepresentationKey(encoding, parameter);
  pixels.getEncapsulatedRepresentation(encoding, parameter, sequence);
  std::string bytes;
  for (unsigned long n = 1; sequence && n < sequence->card(); ++n) {
    DcmPixelItem* item = nullptr;
    Uint8* data = nullptr;
    if (sequence->getItem(item, n).good() && item->getUint8Array(data).good() && data)
      bytes.append(reinterpret_cast<const char*>(data), item->getLength());
  }
  return bytes;
}

/// The frame of a slice as an encoder of DCMTK makes it; the encoders must be registered.
inline std::string encoded_frame(const std::filesystem::path& scratch, MadeSlice slice, E_TransferSyntax encoding) {
  slice.encoding = encoding;
  write_slice(scratch / "encoded.dcm", slice);
  const std::string bytes = frame_in(scratch / "encoded.dcm");
  std::filesystem::remove(scratch / "encoded.dcm");
  return bytes;
}
