// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/codecs/dicom_compress.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrleenc.h>
#include <dcmtk/dcmdata/dcstack.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmjpls/djcodece.h>
#include <dcmtk/dcmjpls/djcparam.h>
#include <dcmtk/dcmjpls/djrparam.h>
#include <zlib.h>

#include <algorithm>
#include <memory>

#include "deform/errors.h"

namespace tetwarp {
namespace {

void check(const OFCondition& condition) {
  if (condition.bad()) throw Error(std::string("cannot compress a slice: ") + condition.text());
}

/// An RLE segment: the byte of each word that begins at bit `shift`, row after row (PS3.5 G.3.1).
std::vector<std::byte> rle_segment(std::span<const std::int16_t> voxels, std::size_t columns, int shift) {
  DcmRLEEncoder encoder(1);
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    encoder.add(static_cast<unsigned char>(static_cast<std::uint16_t>(voxels[n]) >> shift));
    if ((n + 1) % columns == 0) encoder.flush();
  }
  if (encoder.fail()) throw Error("cannot compress a slice: out of memory");
  std::vector<std::byte> segment(encoder.size());
  encoder.write(segment.data());
  return segment;
}

/// An RLE frame: the header of 16 words, then the high bytes of all words, then the low ones (PS3.5 G.4, G.5).
std::vector<std::byte> rle_frame(std::span<const std::int16_t> voxels, std::size_t columns) {
  constexpr std::size_t kHeader = 64;
  const std::vector<std::byte> high = rle_segment(voxels, columns, 8), low = rle_segment(voxels, columns, 0);
  // Number of segments, and the byte at which each begins.
  const std::size_t words[] = {2, kHeader, kHeader + high.size()};
  std::vector<std::byte> frame(kHeader + high.size() + low.size());
  for (std::size_t word = 0; word < std::size(words); ++word) {
    for (std::size_t n = 0; n < 4; ++n) frame[4 * word + n] = static_cast<std::byte>(words[word] >> (8 * n));
  }
  std::copy(high.begin(), high.end(), frame.begin() + kHeader);
  std::copy(low.begin(), low.end(), frame.begin() + words[2]);
  return frame;
}

/// A frame of JPEG-LS. It calls DCMTK's coder directly: DCMTK's registry of coders is one for the whole process.
std::vector<std::byte> jpeg_ls_frame(std::span<const std::int16_t> voxels, std::size_t rows, std::size_t columns) {
  DcmDataset slice;
  check(slice.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(rows)));
  check(slice.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(columns)));
  check(slice.putAndInsertUint16(DCM_SamplesPerPixel, 1));
  check(slice.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME2"));
  check(slice.putAndInsertUint16(DCM_BitsAllocated, 16));
  check(slice.putAndInsertUint16(DCM_BitsStored, 16));
  check(slice.putAndInsertUint16(DCM_HighBit, 15));
  check(slice.putAndInsertUint16(DCM_PixelRepresentation, 1));
  DcmPixelData element(DCM_PixelData);
  DcmStack stack;  // the coder looks for attributes of the image in what lies on this stack
  stack.push(&slice);
  stack.push(&element);
  const DJLSRepresentationParameter lossless(0, OFTrue);
  const DJLSCodecParameter raw(OFFalse);  // the coder is to take the words as they are
  DcmPixelSequence* sequence = nullptr;
  OFBool ignored = OFFalse;
  const DcmCodec& coder = DJLSLosslessEncoder();
  const OFCondition done =
      coder.encode(reinterpret_cast<const Uint16*>(voxels.data()), static_cast<Uint32>(voxels.size_bytes()), &lossless,
                   sequence, &raw, stack, ignored);
  const std::unique_ptr<DcmPixelSequence> fragments(sequence);
  check(done);
  std::vector<std::byte> frame;
  for (unsigned long n = 1; n < fragments->card(); ++n) {  // fragment 0 is the offset table
    DcmPixelItem* fragment = nullptr;
    Uint8* bytes = nullptr;
    check(fragments->getItem(fragment, n));
    check(fragment->getUint8Array(bytes));
    const auto* begin = reinterpret_cast<const std::byte*>(bytes);
    frame.insert(frame.end(), begin, begin + fragment->getLength());
  }
  return frame;
}

}  // namespace

const char* uid_of(DicomEncoding encoding) {
  switch (encoding) {
    case DicomEncoding::deflated: return UID_DeflatedExplicitVRLittleEndianTransferSyntax;
    case DicomEncoding::rle: return UID_RLELosslessTransferSyntax;
    case DicomEncoding::jpeg_ls: return UID_JPEGLSLosslessTransferSyntax;
    case DicomEncoding::uncompressed: break;
  }
  return UID_LittleEndianExplicitTransferSyntax;
}

bool is_encapsulated(DicomEncoding encoding) {
  return encoding == DicomEncoding::rle || encoding == DicomEncoding::jpeg_ls;
}

std::vector<std::byte> compressed_frame(std::span<const std::int16_t> voxels, std::size_t rows, std::size_t columns,
                                        DicomEncoding encoding) {
  std::vector<std::byte> frame =
      encoding == DicomEncoding::rle ? rle_frame(voxels, columns) : jpeg_ls_frame(voxels, rows, columns);
  frame.resize(frame.size() + frame.size() % 2);
  return frame;
}

std::vector<std::byte> deflated(std::span<const std::byte> dataset) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw Error("cannot deflate a slice: out of memory");
  std::vector<std::byte> packed(deflateBound(&stream, static_cast<uLong>(dataset.size())));
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(dataset.data()));
  stream.avail_in = static_cast<uInt>(dataset.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int status = deflate(&stream, Z_FINISH);
  const std::size_t size = stream.total_out;
  deflateEnd(&stream);
  if (status != Z_STREAM_END) throw Error("cannot deflate a slice: it does not fit its room");
  packed.resize(size + size % 2);
  return packed;
}

}  // namespace tetwarp
