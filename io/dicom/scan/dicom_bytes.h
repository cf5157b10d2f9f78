// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: one DICOM file in memory, and what is parsed of it.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"

namespace tetwarp {

/// A range of bytes of a file.
struct FileRange {
  std::uint64_t begin = 0, bytes = 0;
};

/// Memory that holds one file after the other, so that it is allocated once.
class FileBuffer {
 public:
  /// Reads all bytes of a file. They are valid until the next call. @throws InputError naming the file
  std::span<const std::byte> read(const std::filesystem::path& file);
  /// Reads parts of a file into one piece of memory, one after the other. They are valid until the next call.
  /// @throws InputError naming the file
  std::span<const std::byte> read(const std::filesystem::path& file, std::span<const FileRange> parts);

 private:
  std::span<std::byte> room_for(std::size_t bytes);

  std::unique_ptr<std::byte[]> bytes_;
  std::size_t room_ = 0;
};

/// SHA-256 of a file, read piece by piece. @throws InputError naming the file
Sha256::Digest digest_of(const std::filesystem::path& file);

struct ParsedSlice {
  std::unique_ptr<DcmFileFormat> format;
  DicomFileHeader header;
  /// Where Pixel Data lie in the bytes of the file: `native` has 16-bit words, little endian, as many as the header
  /// says; `fragments` has the fragments of compressed frames, without the offset table. `format` does not hold Pixel
  /// Data then. If both are empty, `format` holds them.
  std::span<const std::byte> native;
  std::vector<std::span<const std::byte>> fragments;
};

/// How many bytes uncompressed Pixel Data have by their own length field.
/// @param start  the 12 bytes before the value (PS3.5 7.1)
/// @return none for what DCMTK has to look at: other value representations, lengths that are undefined or odd, big
/// endian
std::optional<std::size_t> native_length(std::span<const std::byte> start, E_TransferSyntax encoding);

/// The items of encapsulated Pixel Data (PS3.5 A.4).
struct PixelItems {
  std::vector<FileRange> items;  ///< without tag and length; the first is the Basic Offset Table
  /// The place in the file behind the delimiter; none: these are no items, or they are cut short.
  std::optional<std::uint64_t> end;
};
/// Finds the items of encapsulated Pixel Data.
/// @param read        fills a span with bytes of the file from an offset on, and returns how many there were
/// @param file_bytes  length of the file
/// @param at          where the value of Pixel Data begins
PixelItems pixel_items(const std::function<std::size_t(std::uint64_t, std::span<std::byte>)>& read,
                       std::uint64_t file_bytes, std::uint64_t at);

/// The most bytes that a deflated data set with this header may inflate to.
std::size_t inflated_limit(const PixelFormat& pixels);

/// How many bytes of Pixel Data there are; of compressed Pixel Data, the length of the file.
std::optional<std::uint64_t> pixel_bytes_of(DcmDataset& data, std::uint64_t file_bytes);

/// Parses a whole file. Pixel Data that end the file are left where they are, which spares DCMTK's copies of most of
/// the file; its decoder of compressed Pixel Data also adds a byte to fragments of odd length.
/// @throws InputError naming the file for one that is truncated or damaged
ParsedSlice parse_slice(std::span<const std::byte> bytes, const std::filesystem::path& file);

}  // namespace tetwarp
