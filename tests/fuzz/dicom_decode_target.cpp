// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// One compressed frame, behind what a header says of it: number of the transfer syntax, Bits Allocated, Bits Stored,
// Pixel Representation, a byte each, then Rows and Columns, two bytes each, little endian.
#include <array>
#include <span>

#include "io/dicom/pixels/dicom_pixels.h"
#include "tests/fuzz/input_file.h"

namespace {

constexpr std::size_t kHeader = 8;

/// The header that scanning would find in a file of these bytes.
tetwarp::DicomFileHeader header_of(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kSyntaxes = {
      UID_RLELosslessTransferSyntax,          UID_JPEGProcess1TransferSyntax,     UID_JPEGProcess2_4TransferSyntax,
      UID_JPEGProcess6_8TransferSyntax,       UID_JPEGProcess10_12TransferSyntax, UID_JPEGProcess14TransferSyntax,
      UID_JPEGProcess14SV1TransferSyntax,     UID_JPEGLSLosslessTransferSyntax,   UID_JPEGLSLossyTransferSyntax,
      UID_JPEG2000LosslessOnlyTransferSyntax, UID_JPEG2000TransferSyntax,         "1.2.840.10008.1.2.4.201"};
  tetwarp::DicomFileHeader header;
  header.transfer_syntax_uid = kSyntaxes[data[0] % kSyntaxes.size()];
  header.encoding = DcmXfer(header.transfer_syntax_uid.c_str()).getXfer();
  header.file_bytes = size;
  header.pixel_bytes = size;
  tetwarp::PixelFormat& pixels = header.pixels;
  pixels.bits_allocated = data[1];
  pixels.bits_stored = data[2];
  pixels.high_bit = data[2] - 1;
  pixels.is_signed = data[3] == 1;
  pixels.rows = data[4] | data[5] << 8;
  pixels.columns = data[6] | data[7] << 8;
  pixels.slope = 1;
  pixels.intercept = 0;
  return header;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tetwarp::prepare_dcmtk();
  if (size < kHeader) return 0;
  const tetwarp::DicomFileHeader header = header_of(data, size);
  if (!tetwarp::pixel_problem(header).empty()) return 0;
  const auto frame = std::as_bytes(std::span(data + kHeader, size - kHeader));
  accepted([&] { tetwarp::decode_frame(std::span(&frame, 1), header); });
  return 0;
}
