#include "io/dicom_pixels.h"

#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "deform/errors.h"
#include "io/dicom_text.h"

namespace tetwarp {
namespace {

[[noreturn]] void refuse_pixels(const DicomFileHeader& header, const std::string& reason) {
  throw InputError("pixel data cannot be decoded, " + header.file.string() + ": " + reason +
                   "; copy or export the file again");
}

/// The bytes of all fragments, without the offset table. @param joined  holds them where there are several
std::span<const Uint8> codestream_of(DcmPixelSequence& sequence, std::vector<Uint8>& joined) {
  std::span<const Uint8> only;
  for (unsigned long i = 1; i < sequence.card(); ++i) {
    DcmPixelItem* item = nullptr;
    Uint8* data = nullptr;
    if (sequence.getItem(item, i).bad() || item->getUint8Array(data).bad() || !data) continue;
    only = {data, item->getLength()};
    if (sequence.card() > 2) joined.insert(joined.end(), only.begin(), only.end());
  }
  return sequence.card() > 2 ? joined : only;
}

struct JpegFrame {
  int rows = 0, columns = 0, precision = 0;
};

/// The frame header of a JPEG or JPEG-LS stream (ITU-T T.81 B.2.2, T.87 C.2.2); zeros if there is none.
JpegFrame jpeg_frame(std::span<const Uint8> bytes) {
  std::size_t at = 2;  // after the start marker
  while (at + 9 < bytes.size()) {
    const Uint8 marker = bytes[at + 1];
    if (bytes[at] != 0xff) return {};
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    const auto word = [&](std::size_t i) { return bytes[at + i] * 256 + bytes[at + i + 1]; };
    const bool is_frame =
        marker == 0xf7 || (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc);
    if (is_frame) return {word(5), word(7), bytes[at + 4]};
    at += 2 + static_cast<std::size_t>(word(2));
  }
  return {};
}

/// The decoders fill up what a damaged stream lacks; so its size and its end are checked first.
void check_jpeg(std::span<const Uint8> bytes, const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  const JpegFrame frame = jpeg_frame(bytes);
  if (frame.rows != pixels.rows || frame.columns != pixels.columns) {
    refuse_pixels(header, "expected an image of " + size_text(pixels) + ", found one of " + std::to_string(frame.rows) +
                              " x " + std::to_string(frame.columns));
  }
  if ((frame.precision > 8 ? 16 : 8) != pixels.bits_allocated) {
    refuse_pixels(header, "expected " + std::to_string(pixels.bits_allocated) + " bits a pixel, found " +
                              std::to_string(frame.precision));
  }
  // Coded data never hold the end marker (they stuff 0xff); encoders pad after it with what they like.
  constexpr std::array<Uint8, 2> end_marker{0xff, 0xd9};
  if (std::find_end(bytes.begin(), bytes.end(), end_marker.begin(), end_marker.end()) == bytes.end()) {
    refuse_pixels(header, "expected an end of image marker within " + std::to_string(bytes.size()) +
                              " bytes, found none: the data are truncated");
  }
}

/// Unfolds an RLE segment (PS3.5 G.3.2); the last literal run counts as far as it is there.
/// @return how many bytes of `plane` were set
std::size_t unfold(std::span<const Uint8> segment, std::span<Uint8> plane) {
  std::size_t done = 0;
  for (std::size_t at = 0; at + 1 < segment.size() && done < plane.size();) {
    const std::size_t control = segment[at++], room = plane.size() - done;
    if (control < 128) {
      const std::size_t count = std::min({control + 1, segment.size() - at, room});
      std::copy_n(segment.begin() + at, count, plane.begin() + done);
      at += count;
      done += count;
    } else if (control > 128) {
      const std::size_t count = std::min(257 - control, room);
      std::fill_n(plane.begin() + done, count, segment[at++]);
      done += count;
    }
  }
  return done;
}

/// Unfolds the byte planes of a frame, the high bytes first (PS3.5 G.4, G.5). DCMTK fills up what a segment lacks, and
/// takes twice as long; so it is done here.
std::vector<std::uint16_t> decode_rle(std::span<const Uint8> bytes, const DicomFileHeader& header) {
  constexpr std::size_t header_bytes = 64;
  const auto word = [&](std::size_t i) {
    return bytes[4 * i] | std::size_t{bytes[4 * i + 1]} << 8 | std::size_t{bytes[4 * i + 2]} << 16 |
           std::size_t{bytes[4 * i + 3]} << 24;
  };
  const auto planes = static_cast<std::size_t>(header.pixels.bits_allocated / 8);
  const std::uint64_t expected = slice_bytes(header.pixels) / planes;
  if (bytes.size() < header_bytes || word(0) != planes) {
    refuse_pixels(header, "expected " + std::to_string(planes) + " RLE segments, found " +
                              (bytes.size() < header_bytes ? "none" : std::to_string(word(0))));
  }
  std::vector<std::uint16_t> words(expected);
  std::vector<Uint8> bytes_of_plane(expected);
  for (std::size_t plane = 1; plane <= planes; ++plane) {
    const std::size_t begin = std::min(word(plane), bytes.size());
    const std::size_t end = plane < planes ? std::clamp(word(plane + 1), begin, bytes.size()) : bytes.size();
    const std::uint64_t found = unfold(bytes.subspan(begin, end - begin), bytes_of_plane);
    if (found < expected) {
      refuse_pixels(header, "expected " + std::to_string(expected) + " bytes of RLE segment " + std::to_string(plane) +
                                ", found " + std::to_string(found));
    }
    for (std::size_t i = 0; i < expected; ++i) words[i] = static_cast<std::uint16_t>(words[i] << 8 | bytes_of_plane[i]);
  }
  return words;
}

/// The fragments of a compressed frame. @param joined  see codestream_of
std::span<const Uint8> fragments_of(DcmPixelData& pixels, const DicomFileHeader& header, std::vector<Uint8>& joined) {
  E_TransferSyntax encoding = EXS_Unknown;
  const DcmRepresentationParameter* parameter = nullptr;
  DcmPixelSequence* sequence = nullptr;
  pixels.getOriginalRepresentationKey(encoding, parameter);
  if (pixels.getEncapsulatedRepresentation(encoding, parameter, sequence).bad() || !sequence) {
    refuse_pixels(header, "expected compressed fragments, found none");
  }
  return codestream_of(*sequence, joined);
}

/// HU of words that all fit int16 with an offset, in 16 bits, of which a vector holds most: what does not fit shows in
/// the signs. @return whether they do, and the format allows it; if not, `hu` holds anything
bool add_offset(std::span<const std::uint16_t> words, const HuTable& table, std::span<std::int16_t> hu) {
  const PixelFormat& format = table.format;
  if (!table.offset || format.high_bit + 1 != format.bits_stored) return false;
  const int sign = 1 << (format.bits_stored - 1);
  const bool is_raised = !format.is_signed && format.bits_stored == 16;  // by half the range, for int16 to hold it
  const int more = *table.offset + (is_raised ? sign : 0);
  if (more != static_cast<std::int16_t>(more)) return false;
  const auto mask = static_cast<std::uint16_t>(2 * sign - 1),
             flip = static_cast<std::uint16_t>(format.is_signed || is_raised ? sign : 0),
             extend = static_cast<std::uint16_t>(format.is_signed ? sign : 0),
             offset = static_cast<std::uint16_t>(more);
  std::uint16_t misfits = 0;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto value = static_cast<std::uint16_t>(((words[i] & mask) ^ flip) - extend);
    const auto sum = static_cast<std::uint16_t>(value + offset);
    hu[i] = static_cast<std::int16_t>(sum);
    misfits |= static_cast<std::uint16_t>((value ^ sum) & (offset ^ sum));
  }
  return (misfits & 0x8000) == 0;
}

HuCount look_up(std::span<const std::uint16_t> words, const HuTable& table, const std::filesystem::path& file,
                std::span<std::int16_t> hu) {
  HuCount count;
  std::uint8_t kinds = 0;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::uint8_t kind = table.kind[words[i]];
    hu[i] = table.hu[words[i]];
    kinds |= kind;
    count.rounded += kind & HuTable::rounded;
    count.saturated_padding += (kind & HuTable::saturated_padding) != 0;
  }
  if ((kinds & HuTable::beyond) == 0) return count;
  const auto first =
      std::find_if(words.begin(), words.end(), [&](std::uint16_t w) { return table.kind[w] & HuTable::beyond; });
  const int stored = stored_value(table.format, *first);
  throw InputError("HU beyond int16, " + file.string() + ": stored value " + std::to_string(stored) + " gives " +
                   number(hu_of(table.format, stored)) +
                   " HU, expected -32768 to 32767; check Rescale Slope (0028,1053) " + number(*table.format.slope) +
                   " and Intercept (0028,1052) " + number(*table.format.intercept));
}

}  // namespace

std::vector<std::uint16_t> decode_pixels(DcmDataset& data, const DicomFileHeader& header) {
  DcmElement* element = nullptr;
  data.findAndGetElement(DCM_PixelData, element);
  auto* pixels = dynamic_cast<DcmPixelData*>(element);
  if (!pixels) refuse_pixels(header, "expected Pixel Data (7FE0,0010), found none");
  if (DcmXfer(header.encoding).isEncapsulated()) {
    std::vector<Uint8> joined;
    const std::span<const Uint8> bytes = fragments_of(*pixels, header, joined);
    if (header.encoding == EXS_RLELossless) return decode_rle(bytes, header);
    check_jpeg(bytes, header);
  }

  const std::uint64_t needed = slice_bytes(header.pixels);
  std::vector<std::uint16_t> words((needed + 1) / 2);
  Uint32 fragment = 0;
  OFString color_model;
  const OFCondition result = pixels->getUncompressedFrame(&data, 0, fragment, words.data(),
                                                          static_cast<Uint32>(2 * words.size()), color_model);
  if (result.bad()) refuse_pixels(header, result.text());
  if (header.pixels.bits_allocated == 16) return words;
  std::vector<Uint8> bytes(needed);
  std::memcpy(bytes.data(), words.data(), needed);
  return {bytes.begin(), bytes.end()};
}

std::shared_ptr<const HuTable> make_hu_table(const PixelFormat& format) {
  auto table = std::make_shared<HuTable>();
  const std::size_t words = std::size_t{1} << format.bits_allocated;
  table->format = format;
  table->hu.resize(words);
  table->kind.resize(words);
  const auto padding = stored_padding(format);
  for (std::size_t word = 0; word < words; ++word) {
    const int stored = stored_value(format, static_cast<unsigned>(word));
    const double exact_hu = hu_of(format, stored), whole_hu = std::nearbyint(exact_hu);
    const double fitting = std::clamp(whole_hu, -32768.0, 32767.0);
    const bool is_padding = padding && padding->low <= stored && stored <= padding->high;
    table->hu[word] = static_cast<std::int16_t>(fitting);
    if (exact_hu != whole_hu) table->kind[word] |= HuTable::rounded;
    if (fitting != whole_hu) table->kind[word] |= is_padding ? HuTable::saturated_padding : HuTable::beyond;
  }
  const double intercept = *format.intercept;
  if (format.bits_allocated == 16 && *format.slope == 1 && intercept == std::nearbyint(intercept) &&
      std::abs(intercept) <= 65536) {
    table->offset = static_cast<int>(intercept);
  }
  return table;
}

std::shared_ptr<const HuTable> HuTableCache::table_for(const PixelFormat& format) {
  const std::lock_guard lock(mutex_);
  if (!last_ || last_->format != format) last_ = make_hu_table(format);
  return last_;
}

HuCount convert_to_hu(std::span<const std::byte> words, const HuTable& table, const std::filesystem::path& file,
                      std::span<std::int16_t> hu) {
  HuCount count;
  std::array<std::uint16_t, 4096> aligned;
  for (std::size_t begin = 0; begin < hu.size(); begin += aligned.size()) {
    const std::size_t size = std::min(aligned.size(), hu.size() - begin);
    std::memcpy(aligned.data(), words.data() + 2 * begin, 2 * size);
    const std::span<std::int16_t> part = hu.subspan(begin, size);
    const std::span<const std::uint16_t> from(aligned.data(), size);
    if (add_offset(from, table, part)) continue;
    const HuCount more = look_up(from, table, file, part);
    count.rounded += more.rounded;
    count.saturated_padding += more.saturated_padding;
  }
  return count;
}

HuCount convert_to_hu(std::span<const std::uint16_t> words, const HuTable& table, const std::filesystem::path& file,
                      std::span<std::int16_t> hu) {
  return convert_to_hu(std::as_bytes(words), table, file, hu);
}

}  // namespace tetwarp
