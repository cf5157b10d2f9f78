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

/// The bytes of all fragments, without the offset table.
std::vector<Uint8> codestream_of(DcmPixelSequence& sequence) {
  std::vector<Uint8> bytes;
  for (unsigned long i = 1; i < sequence.card(); ++i) {
    DcmPixelItem* item = nullptr;
    Uint8* data = nullptr;
    if (sequence.getItem(item, i).bad() || item->getUint8Array(data).bad() || !data) continue;
    bytes.insert(bytes.end(), data, data + item->getLength());
  }
  return bytes;
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

/// Bytes that an RLE segment unfolds to (PS3.5 G.3.2); the last literal run counts as far as it is there.
std::uint64_t unfolded_bytes(std::span<const Uint8> segment) {
  std::uint64_t count = 0;
  for (std::size_t at = 0; at + 1 < segment.size();) {
    const std::size_t control = segment[at];
    const std::size_t literals = std::min(control + 1, segment.size() - at - 1);
    if (control < 128) count += literals;
    if (control > 128) count += 257 - control;
    at += control < 128 ? 1 + literals : (control == 128 ? 1 : 2);
  }
  return count;
}

/// DCMTK fills up what an RLE segment lacks; so each must unfold to a whole byte plane (PS3.5 G.4, G.5).
void check_rle(std::span<const Uint8> bytes, const DicomFileHeader& header) {
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
  for (std::size_t plane = 1; plane <= planes; ++plane) {
    const std::size_t begin = std::min(word(plane), bytes.size());
    const std::size_t end = plane < planes ? std::clamp(word(plane + 1), begin, bytes.size()) : bytes.size();
    const std::uint64_t found = unfolded_bytes(bytes.subspan(begin, end - begin));
    if (found < expected) {
      refuse_pixels(header, "expected " + std::to_string(expected) + " bytes of RLE segment " + std::to_string(plane) +
                                ", found " + std::to_string(found));
    }
  }
}

void check_encapsulated(DcmPixelData& pixels, const DicomFileHeader& header) {
  E_TransferSyntax encoding = EXS_Unknown;
  const DcmRepresentationParameter* parameter = nullptr;
  DcmPixelSequence* sequence = nullptr;
  pixels.getOriginalRepresentationKey(encoding, parameter);
  if (pixels.getEncapsulatedRepresentation(encoding, parameter, sequence).bad() || !sequence) {
    refuse_pixels(header, "expected compressed fragments, found none");
  }
  const std::vector<Uint8> bytes = codestream_of(*sequence);
  if (header.encoding == EXS_RLELossless)
    check_rle(bytes, header);
  else
    check_jpeg(bytes, header);
}

}  // namespace

std::vector<std::uint16_t> decode_pixels(DcmDataset& data, const DicomFileHeader& header) {
  DcmElement* element = nullptr;
  data.findAndGetElement(DCM_PixelData, element);
  auto* pixels = dynamic_cast<DcmPixelData*>(element);
  if (!pixels) refuse_pixels(header, "expected Pixel Data (7FE0,0010), found none");
  if (DcmXfer(header.encoding).isEncapsulated()) check_encapsulated(*pixels, header);

  const std::uint64_t needed = slice_bytes(header.pixels);
  std::vector<Uint8> bytes(needed + needed % 2);
  Uint32 fragment = 0;
  OFString color_model;
  const OFCondition result =
      pixels->getUncompressedFrame(&data, 0, fragment, bytes.data(), static_cast<Uint32>(bytes.size()), color_model);
  if (result.bad()) refuse_pixels(header, result.text());

  std::vector<std::uint16_t> words(needed / static_cast<unsigned>(header.pixels.bits_allocated / 8));
  if (header.pixels.bits_allocated == 8)
    std::copy_n(bytes.begin(), words.size(), words.begin());
  else
    std::memcpy(words.data(), bytes.data(), needed);
  return words;
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
  return table;
}

std::shared_ptr<const HuTable> HuTableCache::table_for(const PixelFormat& format) {
  const std::lock_guard lock(mutex_);
  if (!last_ || last_->format != format) last_ = make_hu_table(format);
  return last_;
}

HuCount convert_to_hu(std::span<const std::uint16_t> words, const HuTable& table, const std::filesystem::path& file,
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

}  // namespace tetwarp
