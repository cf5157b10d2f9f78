#include "io/dicom_bytes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "deform/errors.h"
#include "io/dicom_codecs.h"
#include "io/dicom_stream.h"
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

/// Bytes that the value of Pixel Data has by its own length field, which ends at `at` (PS3.5 7.1); none for what DCMTK
/// has to look at: other value representations, lengths that are undefined or odd.
std::optional<std::size_t> native_length(std::span<const std::byte> bytes, std::size_t at, E_TransferSyntax encoding) {
  const bool known = encoding == EXS_LittleEndianExplicit
                         ? at >= 12 && starts_with(bytes, at - 12, kPixelData) && starts_with(bytes, at - 8, kWords)
                         : at >= 8 && starts_with(bytes, at - 8, kPixelData);
  if (!known) return std::nullopt;
  const std::uint32_t length = word_at(bytes, at - 4);
  return length % 2 == 0 ? std::optional<std::size_t>(length) : std::nullopt;
}

/// The items of encapsulated Pixel Data but the first, the offset table (PS3.5 A.4), which begin at `at` and end the
/// file; none if it is not like this.
std::vector<std::span<const std::byte>> fragments_at(std::span<const std::byte> bytes, std::size_t at) {
  const bool known = at >= 12 && starts_with(bytes, at - 12, kPixelData) &&
                     word_at(bytes, at - 4) == DCM_UndefinedLength &&
                     (starts_with(bytes, at - 8, kOctets) || starts_with(bytes, at - 8, kWords));
  std::vector<std::span<const std::byte>> items;
  while (known && bytes.size() - at >= 8) {
    const std::size_t length = word_at(bytes, at + 4), room = bytes.size() - at - 8;
    if (starts_with(bytes, at, kItemsEnd) && room == 0 && !items.empty()) {
      items.erase(items.begin());
      return items;
    }
    if (!starts_with(bytes, at, kItem) || length > room) break;
    items.push_back(bytes.subspan(at + 8, length));
    at += 8 + length;
  }
  return {};
}

/// What a deflated data set with this header may inflate to.
std::size_t inflated_limit(const PixelFormat& pixels) {
  const std::uint64_t frames = static_cast<std::uint64_t>(std::max(pixels.frames, 1));
  return std::min(kLargestInflatedHeader + slice_bytes(pixels) * frames, kLargestInflated);
}

/// The attributes before Pixel Data, if these end the file: words of 16 bits each, or fragments.
/// @param limit  what the data set may inflate to, as these attributes say
std::optional<ParsedSlice> parse_up_to_pixels(std::span<const std::byte> bytes, const std::filesystem::path& file,
                                              std::size_t& limit) {
  static_assert(std::endian::native == std::endian::little);
  ParsedSlice slice;
  slice.format = std::make_unique<DcmFileFormat>();
  const DicomRead read = parse_dicom(*slice.format, bytes, DCM_PixelData, kLargestInflatedHeader);
  if (read.result.bad() || read.rest == 0 || read.rest >= bytes.size()) return std::nullopt;
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
  const auto length = native_length(bytes, at, encoding);
  const std::uint64_t needed = slice_bytes(slice.header.pixels);
  if (slice.header.pixels.bits_allocated != 16 || length != bytes.size() - at || needed == 0 || *length < needed)
    return std::nullopt;
  slice.header.pixel_bytes = *length;
  slice.native = bytes.subspan(at, needed);
  return slice;
}

/// Bytes of Pixel Data that are there; compressed: of the file.
std::optional<std::uint64_t> pixel_bytes_of(DcmDataset& data, std::uint64_t file_bytes) {
  DcmElement* element = nullptr;
  if (data.findAndGetElement(DCM_PixelData, element).bad()) return std::nullopt;
  return element->getLengthField() == DCM_UndefinedLength ? file_bytes : element->getLength();
}

}  // namespace

std::span<const std::byte> FileBuffer::read(const std::filesystem::path& file) {
  OpenedFile opened(file);
  const auto check = [&] {
    require(opened.problem().empty(), "cannot be read, " + shown(file) + ": " + opened.problem() + "; check the file");
  };
  check();
  const std::size_t size = opened.size();
  if (room_ < size) {
    room_ = std::max(size, 2 * room_);
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(room_);
  }
  const std::span<std::byte> bytes(bytes_.get(), size);
  const std::size_t count = opened.read(0, bytes);
  check();
  require(count == size, "cannot be read whole, " + shown(file) + "; check the file");
  return bytes;
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
