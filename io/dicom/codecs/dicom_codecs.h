// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: how transfer syntaxes keep pixels, and the decoders of one compressed frame of one sample a pixel.
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// What a frame of Pixel Data consists of (PS3.5 8.1, 8.2).
enum class PixelCoding : std::uint8_t { native, rle, jpeg, jpeg_ls, jpeg_2000 };

/// How a transfer syntax keeps pixels; none for those that no build decodes.
std::optional<PixelCoding> pixel_coding(const std::string& transfer_syntax_uid);

/// Whether a transfer syntax may have changed pixels.
bool is_lossy(const std::string& transfer_syntax_uid);

/// Its name in the standard, for those that DCMTK 3.6.7 does not know; empty for all others.
std::string name_of_newer_syntax(const std::string& transfer_syntax_uid);

/// Whether this build has OpenJPEG.
bool decodes_jpeg_2000();

/// @throws InputError that names the file
[[noreturn]] void refuse_pixels(const DicomFileHeader& header, const std::string& reason);

// Each decoder gives one word a pixel, rows top to bottom, every bit as stored, and throws InputError, which names the
// file, for a frame that is truncated, of another size or layout than the header says, or damaged as far as that shows:
// no coding has a checksum (docs/reference/dicom.md has the numbers). Nothing larger than the frame that the header
// asks for is allocated before the frame's own header is known to agree.

/// RLE (PS3.5 Annex G).
std::vector<std::uint16_t> decode_rle(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// JPEG (ITU-T T.81), Huffman coded: baseline, extended, progressive, lossless.
std::vector<std::uint16_t> decode_jpeg(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// JPEG-LS (ITU-T T.87).
std::vector<std::uint16_t> decode_jpeg_ls(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// JPEG 2000 (ITU-T T.800) and its high-throughput block coder (T.814).
std::vector<std::uint16_t> decode_jpeg_2000(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

}  // namespace tetwarp
