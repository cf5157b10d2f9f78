// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "io/dicom/codecs/dicom_codecs.h"

namespace tetwarp {
namespace {

constexpr std::size_t kHeaderBytes = 64;

struct Unfolded {
  std::size_t done = 0;  ///< bytes of the plane that were set
  std::size_t used = 0;  ///< bytes of the segment that were read
  bool beyond = false;   ///< the last run holds more than the plane has room for
};

/// Unfolds an RLE segment (PS3.5 G.3.2). If the last literal run is cut short, the bytes that are there count.
Unfolded unfold(std::span<const std::uint8_t> segment, std::span<std::uint8_t> plane) {
  Unfolded all;
  std::size_t& at = all.used;
  while (at + 1 < segment.size() && all.done < plane.size()) {
    const std::size_t control = segment[at++], room = plane.size() - all.done;
    if (control == 128) continue;
    const std::size_t run = control < 128 ? control + 1 : 257 - control;
    all.beyond = run > room;
    if (control < 128) {
      const std::size_t count = std::min({run, segment.size() - at, room});
      std::copy_n(segment.begin() + at, count, plane.begin() + all.done);
      at += count;
      all.done += count;
    } else {
      const std::size_t count = std::min(run, room);
      std::fill_n(plane.begin() + all.done, count, segment[at++]);
      all.done += count;
    }
  }
  return all;
}

}  // namespace

// Decoded without DCMTK, which makes up what a segment lacks and takes twice as long.
std::vector<std::uint16_t> decode_rle(std::span<const std::uint8_t> frame, const DicomFileHeader& header) {
  const auto word = [&](std::size_t i) {
    return frame[4 * i] | std::size_t{frame[4 * i + 1]} << 8 | std::size_t{frame[4 * i + 2]} << 16 |
           std::size_t{frame[4 * i + 3]} << 24;
  };
  const auto planes = static_cast<std::size_t>(header.pixels.bits_allocated / 8);
  const std::uint64_t expected = slice_bytes(header.pixels) / planes;
  if (frame.size() < kHeaderBytes || word(0) != planes) {
    refuse_pixels(header, "expected " + std::to_string(planes) + " RLE segments, found " +
                              (frame.size() < kHeaderBytes ? "none" : std::to_string(word(0))));
  }
  std::vector<std::uint16_t> words(expected);
  std::vector<std::uint8_t> bytes(expected);
  for (std::size_t plane = 1; plane <= planes; ++plane) {  // the plane of the high bytes is stored first (PS3.5 G.2)
    const std::size_t begin = std::min(word(plane), frame.size());
    const std::size_t end = plane < planes ? std::clamp(word(plane + 1), begin, frame.size()) : frame.size();
    const std::span<const std::uint8_t> segment = frame.subspan(begin, end - begin);
    const Unfolded found = unfold(segment, bytes);
    const std::string name = "RLE segment " + std::to_string(plane);
    if (found.done < expected) {
      refuse_pixels(header, "expected " + std::to_string(expected) + " bytes of " + name + ", found " +
                                std::to_string(found.done));
    }
    // If a run lost the byte with its length, more than padding is left over. Segments are padded to an even length,
    // some to a longer one.
    const auto rest = segment.subspan(std::min(found.used + 1, segment.size()));
    if (found.beyond || std::any_of(rest.begin(), rest.end(), [](std::uint8_t byte) { return byte != 0; })) {
      refuse_pixels(header, "expected " + std::to_string(expected) + " bytes of " + name + ", found more");
    }
    for (std::size_t i = 0; i < expected; ++i) words[i] = static_cast<std::uint16_t>(words[i] << 8 | bytes[i]);
  }
  return words;
}

}  // namespace tetwarp
