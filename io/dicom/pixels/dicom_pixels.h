// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "io/dicom/scan/dicom_bytes.h"
#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Decodes Pixel Data of an object whose header passed `pixel_problem`: the only frame, or, of several frames that are
/// not compressed, the one that the header describes.
/// @return one word a pixel, rows top to bottom, every bit as stored
/// @throws InputError naming the file for data that are truncated, damaged or of another size than the header says
std::vector<std::uint16_t> decode_pixels(DcmDataset& data, const DicomFileHeader& header);

/// The fragments of an object's compressed Pixel Data (PS3.5 A.4), without the offset table.
/// @throws InputError naming the file where there are none
std::vector<std::span<const std::byte>> fragments_of(DcmDataset& data, const DicomFileHeader& header);

/// Decodes the fragments of one compressed frame. It does not use the Basic Offset Table (PS3.5 A.4), which is often
/// wrong and superfluous for one frame.
/// @return one word a pixel, rows top to bottom, every bit as stored
/// @throws InputError naming the file for data that are truncated, damaged or of another size than the header states
std::vector<std::uint16_t> decode_frame(std::span<const std::span<const std::byte>> fragments,
                                        const DicomFileHeader& header);

/// Decodes a slice that was parsed and whose pixels are not native: its fragments, or what its data set holds.
/// @return one word a pixel, rows top to bottom, every bit as stored
/// @throws InputError naming the file for data that are truncated, damaged or of another size than the header states
std::vector<std::uint16_t> decode_slice(const ParsedSlice& slice);

/// Turns words of Pixel Data into HU. A table is built once for all slices of one format. Every word of 16 bits has an
/// entry, whatever Bits Allocated says, so that no word that a decoder gives lies outside.
struct HuTable {
  enum Kind : std::uint8_t { exact = 0, rounded = 1, beyond = 2, saturated_padding = 4 };
  static constexpr std::size_t kWords = std::size_t{UINT16_MAX} + 1;
  PixelFormat format;
  std::array<std::int16_t, kWords> hu{};
  std::array<std::uint8_t, kWords> kind{};  ///< a Kind; `beyond`: the HU does not fit int16
  /// HU minus stored value, where slope and intercept only add a whole number; none elsewhere
  std::optional<int> offset;
};
std::shared_ptr<const HuTable> make_hu_table(const PixelFormat& format);

/// Keeps the table that was made last, for the next slice mostly has the same format.
class HuTableCache {
 public:
  std::shared_ptr<const HuTable> table_for(const PixelFormat& format);

 private:
  std::mutex mutex_;
  std::shared_ptr<const HuTable> last_;
};

struct HuCount {
  std::uint64_t rounded = 0;            ///< pixels whose HU was rounded to a whole number
  std::uint64_t saturated_padding = 0;  ///< pixels of padding whose HU does not fit int16
};
/// Converts words of Pixel Data to HU.
/// @param words  as many as there are `hu`
/// @param slice  name of the slice
/// @throws InputError naming the slice for a pixel whose HU does not fit int16
HuCount convert_to_hu(std::span<const std::uint16_t> words, const HuTable& table, const std::string& slice,
                      std::span<std::int16_t> hu);
/// Converts words of Pixel Data as they lie in a file, little endian, at any address, to HU.
/// @throws InputError naming the slice for a pixel whose HU does not fit int16
HuCount convert_to_hu(std::span<const std::byte> words, const HuTable& table, const std::string& slice,
                      std::span<std::int16_t> hu);

}  // namespace tetwarp
