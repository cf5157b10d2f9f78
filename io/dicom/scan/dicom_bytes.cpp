// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_bytes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/opened_file.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

bool is_little_endian(E_TransferSyntax encoding) {
  return encoding == EXS_LittleEndianExplicit || encoding == EXS_LittleEndianImplicit;
}

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t at) {
  const auto byte = [&](std::size_t n) { return std::to_integer<std::uint32_t>(bytes[at + n]); };
  return byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
}

bool starts_with(std::span<const std::byte> bytes, std::size_t at, const std::array<unsigned, 4>& start) {
  return at <= bytes.size() && bytes.size() - at >= start.size() &&
         std::equal(start.begin(), start.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](unsigned expected, std::byte found) { return expected == std::to_integer<unsigned>(found); });
}

constexpr std::array<unsigned, 4> kPixelData{0xe0, 0x7f, 0x10, 0x00}, kWords{'O', 'W', 0, 0}, kOctets{'O', 'B', 0, 0},
    kItem{0xfe, 0xff, 0x00, 0xe0}, kItemsEnd{0xfe, 0xff, 0xdd, 0xe0};
/// Bytes of tag, value representation and length before the value of Pixel Data. With Implicit VR they are 8, which
/// native_length knows.
constexpr std::size_t kStart = 12;

/// The fragments of Pixel Data that begin at `at`, without the offset table; none if these are no fragments or do not
/// end the file.
std::vector<std::span<const std::byte>> fragments_at(std::span<const std::byte> bytes, std::size_t at) {
  const auto read = [&](std::uint64_t begin, std::span<std::byte> to) {
    const std::size_t count = std::min<std::size_t>(to.size(), bytes.size() - begin);
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(begin), count, to.begin());
    return count;
  };
  const PixelItems found = pixel_items(read, bytes.size(), at);
  if (found.end != bytes.size()) return {};
  std::vector<std::span<const std::byte>> fragments;
  for (std::size_t n = 1; n < found.items.size(); ++n)
    fragments.push_back(bytes.subspan(found.items[n].begin, found.items[n].bytes));
  return fragments;
}

/// Parses the attributes before Pixel Data and finds Pixel Data in `bytes`, if these end the file: uncompressed words
/// of 16 bits each, or fragments.
/// @param limit  set to the most bytes that the data set may inflate to, by what the attributes say
/// @return none where Pixel Data are anything else, so that DCMTK has to parse the whole file
std::optional<ParsedSlice> parse_up_to_pixels(std::span<const std::byte> bytes, const std::filesystem::path& file,
                                              std::size_t& limit) {
  static_assert(std::endian::native == std::endian::little);
  ParsedSlice slice;
  slice.format = std::make_unique<DcmFileFormat>();
  const DicomRead read = parse_dicom(*slice.format, bytes, DCM_PixelData, kLargestInflatedHeader);
  if (read.result.bad() || read.rest == 0 || read.rest + kStart > bytes.size()) return std::nullopt;
  const std::size_t at = bytes.size() - read.rest;
  slice.header = header_of(*slice.format, file);
  limit = inflated_limit(slice.header.pixels);
  const E_TransferSyntax encoding = slice.header.encoding;
  if (pixel_coding(slice.header.transfer_syntax_uid).value_or(PixelCoding::native) != PixelCoding::native) {
    slice.fragments = fragments_at(bytes, at);
    slice.header.pixel_bytes = bytes.size();
    return slice.fragments.empty() ? std::nullopt : std::optional(std::move(slice));
  }
  if (!is_little_endian(encoding) || slice.format->getDataset()->getOriginalXfer() != encoding) return std::nullopt;
  const auto length = native_length(bytes.subspan(at - kStart, kStart), encoding);
  const std::uint64_t needed = slice_bytes(slice.header.pixels);
  if (slice.header.pixels.bits_allocated != 16 || length != bytes.size() - at || needed == 0 || *length < needed)
    return std::nullopt;
  slice.header.pixel_bytes = *length;
  slice.native = bytes.subspan(at, needed);
  return slice;
}

void require_readable(const OpenedFile& file) {
  require(file.problem().empty(), "cannot be read, " + shown(file.path()) + ": " + file.problem() + "; check the file");
}

std::span<const std::byte> read_parts(OpenedFile& file, std::span<const FileRange> parts, std::span<std::byte> bytes) {
  std::span<std::byte> rest = bytes;
  for (const FileRange& part : parts) {
    const std::size_t count = file.read(part.begin, rest.first(part.bytes));
    require_readable(file);
    require(count == part.bytes, "cannot be read whole, " + shown(file.path()) + "; check the file");
    rest = rest.subspan(count);
  }
  return bytes;
}

}  // namespace

std::optional<std::size_t> native_length(std::span<const std::byte> start, E_TransferSyntax encoding) {
  const bool is_explicit = encoding == EXS_LittleEndianExplicit;
  const bool known = is_explicit ? starts_with(start, 0, kPixelData) && starts_with(start, 4, kWords)
                                 : encoding == EXS_LittleEndianImplicit && starts_with(start, 4, kPixelData);
  if (!known) return std::nullopt;
  const std::uint32_t length = word_at(start, 8);
  return length % 2 == 0 ? std::optional<std::size_t>(length) : std::nullopt;
}

PixelItems pixel_items(const std::function<std::size_t(std::uint64_t, std::span<std::byte>)>& read,
                       std::uint64_t file_bytes, std::uint64_t at) {
  std::array<std::byte, kStart> start;
  PixelItems found;
  const bool known = at >= kStart && read(at - kStart, start) == kStart && starts_with(start, 0, kPixelData) &&
                     word_at(start, 8) == DCM_UndefinedLength &&
                     (starts_with(start, 4, kOctets) || starts_with(start, 4, kWords));
  constexpr std::size_t kTag = 8;
  const std::span<std::byte> tag = std::span(start).first(kTag);
  while (known && file_bytes - at >= kTag && read(at, tag) == kTag) {
    at += kTag;
    if (starts_with(tag, 0, kItemsEnd) && !found.items.empty()) {
      found.end = at;
      break;
    }
    const std::uint64_t length = word_at(tag, 4);
    if (!starts_with(tag, 0, kItem) || length > file_bytes - at) break;
    found.items.push_back({at, length});
    at += length;
  }
  return found;
}

std::size_t inflated_limit(const PixelFormat& pixels) {
  const std::uint64_t frames = static_cast<std::uint64_t>(std::max(pixels.frames, 1));
  return std::min(kLargestInflatedHeader + slice_bytes(pixels) * frames, kLargestInflated);
}

std::optional<std::uint64_t> pixel_bytes_of(DcmDataset& data, std::uint64_t file_bytes) {
  DcmElement* element = nullptr;
  if (data.findAndGetElement(DCM_PixelData, element).bad()) return std::nullopt;
  return element->getLengthField() == DCM_UndefinedLength ? file_bytes : element->getLength();
}

std::span<std::byte> FileBuffer::room_for(std::size_t bytes) {
  if (room_ < bytes) {
    room_ = std::max(bytes, 2 * room_);
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(room_);
  }
  return {bytes_.get(), bytes};
}

std::span<const std::byte> FileBuffer::read(const std::filesystem::path& file) {
  OpenedFile opened(file);
  require_readable(opened);
  const FileRange all{0, opened.size()};
  return read_parts(opened, {&all, 1}, room_for(opened.size()));
}

std::span<const std::byte> FileBuffer::read(const std::filesystem::path& file, std::span<const FileRange> parts) {
  OpenedFile opened(file);
  require_readable(opened);
  std::uint64_t size = 0;
  for (const FileRange& part : parts) size += part.bytes;
  return read_parts(opened, parts, room_for(size));
}

Sha256::Digest digest_of(const std::filesystem::path& file) {
  constexpr std::uint64_t kPiece = 1 << 20;
  OpenedFile opened(file);
  require_readable(opened);
  std::vector<std::byte> room(std::min(kPiece, opened.size()));
  Sha256 hash;
  for (FileRange piece; piece.begin < opened.size(); piece.begin += piece.bytes) {
    piece.bytes = std::min(kPiece, opened.size() - piece.begin);
    hash.add(read_parts(opened, {&piece, 1}, std::span(room).first(piece.bytes)));
  }
  return hash.digest();
}

ParsedSlice parse_slice(std::span<const std::byte> bytes, const std::filesystem::path& file) {
  std::size_t limit = kLargestInflatedHeader;
  std::optional<ParsedSlice> in_place = parse_up_to_pixels(bytes, file, limit);
  ParsedSlice slice;
  if (in_place) {
    slice = std::move(*in_place);
  } else {
    slice.format = std::make_unique<DcmFileFormat>();
    const OFCondition result = parse_dicom(*slice.format, bytes, DCM_UndefinedTagKey, limit).result;
    require(result.good(),
            "truncated or damaged file, " + shown(file) + ": " + result.text() + "; copy the file again");
    slice.header = header_of(*slice.format, file);
    slice.header.pixel_bytes = pixel_bytes_of(*slice.format->getDataset(), bytes.size());
  }
  slice.header.file_bytes = bytes.size();
  return slice;
}

}  // namespace tetwarp
