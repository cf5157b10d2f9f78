// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/pixels/dicom_pixels.h"

#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom_text.h"

namespace tetwarp {
namespace {

DcmPixelData& pixel_data_of(DcmDataset& data, const DicomFileHeader& header) {
  DcmElement* element = nullptr;
  data.findAndGetElement(DCM_PixelData, element);
  auto* pixels = dynamic_cast<DcmPixelData*>(element);
  if (!pixels) refuse_pixels(header, "expected Pixel Data (7FE0,0010), found none");
  return *pixels;
}

std::vector<std::uint16_t> decode_bytes(std::span<const std::uint8_t> frame, const DicomFileHeader& header) {
  switch (pixel_coding(header.transfer_syntax_uid).value_or(PixelCoding::native)) {
    case PixelCoding::rle: return decode_rle(frame, header);
    case PixelCoding::jpeg: return decode_jpeg(frame, header);
    case PixelCoding::jpeg_ls: return decode_jpeg_ls(frame, header);
    case PixelCoding::jpeg_2000: return decode_jpeg_2000(frame, header);
    case PixelCoding::native: break;
  }
  refuse_pixels(
      header, "expected a transfer syntax with compressed frames, found " + uid_with_name(header.transfer_syntax_uid));
}

/// The words of uncompressed Pixel Data, in the order of bytes of this machine.
std::vector<std::uint16_t> native_words(DcmPixelData& pixels, DcmDataset& data, const DicomFileHeader& header) {
  const std::uint64_t needed = slice_bytes(header.pixels);
  std::vector<std::uint16_t> words((needed + 1) / 2);
  Uint32 fragment = 0;
  const auto frame = static_cast<Uint32>(header.frame.value_or(0));
  OFString color_model;
  const OFCondition result = pixels.getUncompressedFrame(&data, frame, fragment, words.data(),
                                                         static_cast<Uint32>(2 * words.size()), color_model);
  if (result.bad()) refuse_pixels(header, result.text());
  if (header.pixels.bits_allocated == 16) return words;
  const auto* bytes = reinterpret_cast<const Uint8*>(words.data());
  return {bytes, bytes + needed};
}

/// Turns words into HU by adding an offset, if that is all that slope and intercept do and all results fit int16. The
/// sums are made in 16 bits, of which a vector register holds most; what does not fit shows in the signs.
/// @return whether it was possible; if not, `hu` holds anything
bool add_offset(std::span<const std::uint16_t> words, const HuTable& table, std::span<std::int16_t> hu) {
  const PixelFormat& format = table.format;
  if (!table.offset || format.high_bit + 1 != format.bits_stored) return false;
  const int sign = 1 << (format.bits_stored - 1);
  // Raised by half of the range, so that int16 can hold the words.
  const bool is_raised = !format.is_signed && format.bits_stored == 16;
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

HuCount look_up(std::span<const std::uint16_t> words, const HuTable& table, const std::string& slice,
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
  throw InputError("HU beyond int16, " + slice + ": stored value " + std::to_string(stored) + " gives " +
                   number(hu_of(table.format, stored)) +
                   " HU, expected -32768 to 32767; check Rescale Slope (0028,1053) " + number(*table.format.slope) +
                   " and Intercept (0028,1052) " + number(*table.format.intercept));
}

}  // namespace

std::vector<std::span<const std::byte>> fragments_of(DcmDataset& data, const DicomFileHeader& header) {
  DcmPixelData& pixels = pixel_data_of(data, header);
  E_TransferSyntax encoding = EXS_Unknown;
  const DcmRepresentationParameter* parameter = nullptr;
  DcmPixelSequence* sequence = nullptr;
  pixels.getOriginalRepresentationKey(encoding, parameter);
  if (pixels.getEncapsulatedRepresentation(encoding, parameter, sequence).bad() || !sequence) {
    refuse_pixels(header, "expected compressed fragments, found none");
  }
  std::vector<std::span<const std::byte>> fragments;
  DcmObject* object = sequence->nextInContainer(nullptr);
  while (object && (object = sequence->nextInContainer(object))) {
    auto& item = dynamic_cast<DcmPixelItem&>(*object);
    Uint8* bytes = nullptr;
    if (item.getUint8Array(bytes).bad()) refuse_pixels(header, "expected a fragment, found none that can be read");
    if (bytes) fragments.push_back(std::as_bytes(std::span(bytes, item.getLength())));
  }
  return fragments;
}

std::vector<std::uint16_t> decode_frame(std::span<const std::span<const std::byte>> fragments,
                                        const DicomFileHeader& header) {
  const auto octets = [](std::span<const std::byte> bytes) {
    return std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  };
  if (fragments.size() == 1) return decode_bytes(octets(fragments.front()), header);
  std::vector<std::uint8_t> joined;
  for (const auto& fragment : fragments) joined.insert(joined.end(), octets(fragment).begin(), octets(fragment).end());
  return decode_bytes(joined, header);
}

std::vector<std::uint16_t> decode_pixels(DcmDataset& data, const DicomFileHeader& header) {
  if (pixel_coding(header.transfer_syntax_uid) == PixelCoding::native)
    return native_words(pixel_data_of(data, header), data, header);
  return decode_frame(fragments_of(data, header), header);
}

std::vector<std::uint16_t> decode_slice(const ParsedSlice& slice) {
  if (slice.fragments.empty()) return decode_pixels(*slice.format->getDataset(), slice.header);
  return decode_frame(slice.fragments, slice.header);
}

std::shared_ptr<const HuTable> make_hu_table(const PixelFormat& format) {
  auto table = std::make_shared<HuTable>();
  table->format = format;
  const auto padding = stored_padding(format);
  for (std::size_t word = 0; word < HuTable::kWords; ++word) {
    const int stored = stored_value(format, static_cast<unsigned>(word));
    const double exact_hu = hu_of(format, stored), whole_hu = std::nearbyint(exact_hu);
    const double fitting = std::clamp(whole_hu, -32768.0, 32767.0);
    const bool is_padding = padding && padding->low <= stored && stored <= padding->high;
    table->hu[word] = static_cast<std::int16_t>(fitting);
    if (exact_hu != whole_hu) table->kind[word] |= HuTable::rounded;
    if (fitting != whole_hu) table->kind[word] |= is_padding ? HuTable::saturated_padding : HuTable::beyond;
  }
  const double intercept = *format.intercept;
  if (*format.slope == 1 && intercept == std::nearbyint(intercept) && std::abs(intercept) <= 65536) {
    table->offset = static_cast<int>(intercept);
  }
  return table;
}

std::shared_ptr<const HuTable> HuTableCache::table_for(const PixelFormat& format) {
  const std::lock_guard lock(mutex_);
  if (!last_ || last_->format != format) last_ = make_hu_table(format);
  return last_;
}

HuCount convert_to_hu(std::span<const std::byte> words, const HuTable& table, const std::string& slice,
                      std::span<std::int16_t> hu) {
  require(words.size() == 2 * hu.size(), "pixels and voxels differ in number, " + slice + ": expected " +
                                             std::to_string(2 * hu.size()) + " bytes, found " +
                                             std::to_string(words.size()) + "; copy or export the file again");
  HuCount count;
  std::array<std::uint16_t, 4096> aligned;
  for (std::size_t begin = 0; begin < hu.size(); begin += aligned.size()) {
    const std::size_t size = std::min(aligned.size(), hu.size() - begin);
    std::memcpy(aligned.data(), words.data() + 2 * begin, 2 * size);
    const std::span<std::int16_t> part = hu.subspan(begin, size);
    const std::span<const std::uint16_t> from(aligned.data(), size);
    if (add_offset(from, table, part)) continue;
    const HuCount more = look_up(from, table, slice, part);
    count.rounded += more.rounded;
    count.saturated_padding += more.saturated_padding;
  }
  return count;
}

HuCount convert_to_hu(std::span<const std::uint16_t> words, const HuTable& table, const std::string& slice,
                      std::span<std::int16_t> hu) {
  return convert_to_hu(std::as_bytes(words), table, slice, hu);
}

}  // namespace tetwarp
