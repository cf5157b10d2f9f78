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

/// How a transfer syntax keeps pixels; none for a transfer syntax that no build of this program decodes.
std::optional<PixelCoding> pixel_coding(const std::string& transfer_syntax_uid);

/// Whether a transfer syntax may have changed pixels.
bool is_lossy(const std::string& transfer_syntax_uid);

/// Name of a transfer syntax in the standard, for those that DCMTK 3.6.7 does not know; empty for all others.
std::string name_of_newer_syntax(const std::string& transfer_syntax_uid);

/// Whether this build has OpenJPEG.
bool decodes_jpeg_2000();

/// Refuses the pixels of a slice.
/// @throws InputError, always: it has the reason and names the file
[[noreturn]] void refuse_pixels(const DicomFileHeader& header, const std::string& reason);

// Each decoder gives one word of 16 bits for each pixel, rows top to bottom, every bit as stored. It throws InputError,
// which names the file, for a frame that is truncated, damaged, or of another size or layout than the header says.
// Damage is found as far as it shows: no coding has a checksum (docs/reference/dicom.md has the numbers). Before the
// frame's own header is known to agree, nothing is allocated that is larger than the frame that the DICOM header
// describes.

/// Decodes a frame of RLE (PS3.5 Annex G).
std::vector<std::uint16_t> decode_rle(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// Decodes a frame of JPEG (ITU-T T.81), Huffman coded: baseline, extended, progressive or lossless.
std::vector<std::uint16_t> decode_jpeg(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// Decodes a frame of JPEG-LS (ITU-T T.87).
std::vector<std::uint16_t> decode_jpeg_ls(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

/// Decodes a frame of JPEG 2000 (ITU-T T.800), also with its high-throughput block coder (T.814).
std::vector<std::uint16_t> decode_jpeg_2000(std::span<const std::uint8_t> frame, const DicomFileHeader& header);

}  // namespace tetwarp
