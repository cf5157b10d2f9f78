// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/codecs/jpeg2000_codestream.h"

#include <algorithm>
#include <array>
#include <vector>

namespace tetwarp {
namespace {

using Bytes = std::span<const std::uint8_t>;

// The most that a codestream may state. A CT slice has one tile, or some tens, and some thousands of code-blocks.
constexpr std::uint64_t kLargestSide = 65535, kMostTiles = 4096, kMostBlocks = 1 << 19;

// Markers (T.800 Table A.2).
constexpr unsigned kStart = 0xff4f, kSize = 0xff51, kCodingStyle = 0xff52, kCodingStyleOfComponent = 0xff53,
                   kTilePart = 0xff90, kData = 0xff93, kEnd = 0xffd9;

struct Refusal {
  std::string reason;
};

void expect(bool holds, const std::string& reason) {
  if (!holds) throw Refusal{reason};
}

std::string hex(unsigned marker) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (int shift = 12; shift >= 0; shift -= 4) text += digits[marker >> shift & 15];
  return text;
}

/// A big-endian number of `size` bytes. It is refused where the bytes end before it does.
std::uint64_t number_at(Bytes bytes, std::size_t at, std::size_t size) {
  expect(at <= bytes.size() && size <= bytes.size() - at,
         "expected more than " + std::to_string(bytes.size()) + " bytes: the data are truncated");
  std::uint64_t value = 0;
  for (std::size_t n = 0; n < size; ++n) value = value << 8 | bytes[at + n];
  return value;
}

/// Where the image and its tiles lie on the reference grid (T.800 B.2, B.3), of one component that is not subsampled.
struct ReferenceGrid {
  std::uint64_t x0, y0, x1, y1, tile_width, tile_height, tile_x0, tile_y0, tiles_across, tiles_down;
};

/// What a marker of coding style says (T.800 A.6.1).
struct Style {
  std::uint64_t layers = 0;
  /// Exponents of a code-block's sides, which have 2^block_width and 2^block_height samples.
  unsigned levels = 0, block_width = 0, block_height = 0;
  /// exponents of a precinct's sides by resolution: width in the low 4 bits, height in the high 4
  std::array<std::uint8_t, 33> precincts{};
};

std::uint64_t ceil_shift(std::uint64_t value, unsigned shift) {
  return (value + (std::uint64_t{1} << shift) - 1) >> shift;
}

ReferenceGrid read_size(Bytes segment, Jpeg2000Image& image) {
  const auto word = [&](std::size_t n) { return number_at(segment, 2 + 4 * n, 4); };
  ReferenceGrid grid{word(2), word(3), word(0), word(1), word(4), word(5), word(6), word(7), 0, 0};
  expect(
      grid.x0 < grid.x1 && grid.y0 < grid.y1 && grid.x1 - grid.x0 <= kLargestSide && grid.y1 - grid.y0 <= kLargestSide,
      "expected an image of 1 to 65535 rows and columns, found another");
  image.columns = static_cast<std::uint32_t>(grid.x1 - grid.x0);
  image.rows = static_cast<std::uint32_t>(grid.y1 - grid.y0);
  image.components = static_cast<int>(number_at(segment, 34, 2));
  const std::uint64_t sample = number_at(segment, 36, 1);
  image.is_signed = sample >= 128;
  image.precision = static_cast<int>(sample % 128) + 1;
  expect(number_at(segment, 37, 2) == 0x0101,
         "expected a sample for every pixel, found a component that is subsampled");
  expect(grid.tile_width > 0 && grid.tile_height > 0 && grid.tile_x0 <= grid.x0 && grid.tile_y0 <= grid.y0 &&
             grid.tile_x0 + grid.tile_width > grid.x0 && grid.tile_y0 + grid.tile_height > grid.y0,
         "expected tiles that begin with the image, found none there");
  grid.tiles_across = (grid.x1 - grid.tile_x0 + grid.tile_width - 1) / grid.tile_width;
  grid.tiles_down = (grid.y1 - grid.tile_y0 + grid.tile_height - 1) / grid.tile_height;
  expect(grid.tiles_across <= kMostTiles && grid.tiles_down <= kMostTiles / grid.tiles_across,
         "expected at most " + std::to_string(kMostTiles) + " tiles, found " + std::to_string(grid.tiles_across) +
             " x " + std::to_string(grid.tiles_down));
  return grid;
}

Style read_style(Bytes segment) {
  Style style;
  const bool has_precincts = number_at(segment, 0, 1) & 1;
  style.layers = number_at(segment, 2, 2);
  style.levels = static_cast<unsigned>(number_at(segment, 5, 1));
  style.block_width = static_cast<unsigned>(number_at(segment, 6, 1)) + 2;
  style.block_height = static_cast<unsigned>(number_at(segment, 7, 1)) + 2;
  number_at(segment, 9, 1);  // refuses a segment that ends before its last byte
  expect(style.layers > 0 && style.levels <= 32 && style.block_width <= 10 && style.block_height <= 10,
         "expected a coding style of T.800, found another");
  style.precincts.fill(0xff);  // sides of 2^15: one precinct holds everything
  for (std::size_t level = 0; has_precincts && level <= style.levels; ++level) {
    style.precincts[level] = static_cast<std::uint8_t>(number_at(segment, 10 + level, 1));
    expect(level == 0 || (style.precincts[level] % 16 > 0 && style.precincts[level] / 16 > 0),
           "expected precincts of 2 x 2 and more, found smaller ones");
  }
  return style;
}

struct Parts {
  std::uint64_t precincts = 0, blocks = 0;
};

/// How many precincts one resolution has along one axis, and at most how many code-blocks each of its bands has there
/// (T.800 B.6, B.7).
Parts parts_along(std::uint64_t begin, std::uint64_t end, unsigned precinct, unsigned block, bool is_lowest) {
  if (begin >= end) return {};
  const unsigned half = is_lowest ? 0 : 1, side = std::min(block, precinct - half);
  return {ceil_shift(end, precinct) - (begin >> precinct), (((end - begin) >> half) >> side) + 2};
}

/// Adds the precincts and code-blocks of all resolutions of one tile to `all`.
void add_parts(const std::array<std::uint64_t, 4>& tile, const Style& style, Parts& all) {
  for (unsigned level = 0; level <= style.levels; ++level) {
    const unsigned shift = style.levels - level;
    const auto along = [&](std::size_t axis, unsigned precinct, unsigned block) {
      return parts_along(ceil_shift(tile[axis], shift), ceil_shift(tile[axis + 2], shift), precinct, block, level == 0);
    };
    const Parts x = along(0, style.precincts[level] % 16, style.block_width),
                y = along(1, style.precincts[level] / 16, style.block_height);
    all.precincts += x.precincts * y.precincts;
    all.blocks += (level == 0 ? 1 : 3) * x.blocks * y.blocks;
  }
}

/// Refuses more packets than there are bytes: each takes a byte at least, and each layer of each precinct has one
/// (T.800 B.9).
void check_parts(const ReferenceGrid& grid, const Style& style, std::size_t bytes) {
  Parts all;
  for (std::uint64_t q = 0; q < grid.tiles_down; ++q) {
    for (std::uint64_t p = 0; p < grid.tiles_across; ++p) {
      const std::uint64_t x = grid.tile_x0 + p * grid.tile_width, y = grid.tile_y0 + q * grid.tile_height;
      add_parts({std::max(x, grid.x0), std::max(y, grid.y0), std::min(x + grid.tile_width, grid.x1),
                 std::min(y + grid.tile_height, grid.y1)},
                style, all);
      expect(all.precincts <= bytes / style.layers, "expected as many packets as " + std::to_string(bytes) +
                                                        " bytes can hold, found more: the data are truncated");
      expect(all.blocks <= kMostBlocks, "expected at most " + std::to_string(kMostBlocks) + " code-blocks, found more");
    }
  }
}

/// The marker at a place and the segment that follows it; the segment is without its length.
struct Marker {
  unsigned code = 0;
  Bytes segment;
  std::size_t next = 0;
};

Marker marker_at(Bytes bytes, std::size_t at) {
  Marker marker;
  marker.code = static_cast<unsigned>(number_at(bytes, at, 2));
  if (marker.code == kStart || marker.code == kData || marker.code == kEnd) {
    marker.next = at + 2;
    return marker;
  }
  const std::uint64_t length = number_at(bytes, at + 2, 2);
  expect(marker.code >= 0xff01 && length >= 2, "expected a marker, found " + hex(marker.code));
  number_at(bytes, at + 4 + length - 2, 0);  // refuses a segment that ends before its length says
  marker.segment = bytes.subspan(at + 4, length - 2);
  marker.next = at + 2 + length;
  return marker;
}

/// Refuses coded data that were not made by a coder: bits are stuffed so that no marker occurs in them, so they have no
/// 0xff before a byte above 0x8f, nor at their end. OpenJPEG 2.5.0 asserts this of the high-throughput coder (T.814)
/// and so ends the program at damaged data. Markers of packets (T.800 A.8) are refused with them, for nothing tells
/// them from damage; OpenJPH writes none.
void check_stuffing(Bytes data) {
  const auto bad = std::adjacent_find(data.begin(), data.end(),
                                      [](std::uint8_t a, std::uint8_t b) { return a == 0xff && b > 0x8f; });
  expect(bad == data.end() && (data.empty() || data.back() != 0xff),
         "expected high-throughput data without markers, found " +
             (bad == data.end() ? "ff at their end" : hex(0xff00u | *std::next(bad))));
}

/// Follows the tile-parts (T.800 A.4.2) to the end marker. @return the place behind the end marker
std::size_t follow_tile_parts(Bytes bytes, std::size_t at, std::uint64_t tiles, bool is_high_throughput) {
  std::vector<bool> seen(tiles);
  while (true) {
    const Marker part = marker_at(bytes, at);
    if (part.code == kEnd) break;
    expect(part.code == kTilePart, "expected a tile-part or the end of the image, found marker " + hex(part.code));
    const std::uint64_t tile = number_at(part.segment, 0, 2), length = number_at(part.segment, 2, 4);
    expect(tile < tiles, "expected " + std::to_string(tiles) + " tiles, found number " + std::to_string(tile + 1));
    seen[tile] = true;
    std::size_t in_header = part.next;
    for (Marker marker = marker_at(bytes, in_header); marker.code != kData; marker = marker_at(bytes, in_header)) {
      expect(marker.code != kCodingStyle && marker.code != kCodingStyleOfComponent,
             "expected one coding style, found one for tile " + std::to_string(tile + 1));
      expect(marker.code != kTilePart && marker.code != kEnd && marker.code != kStart,
             "expected data of tile " + std::to_string(tile + 1) + ", found marker " + hex(marker.code));
      in_header = marker.next;
    }
    const std::size_t data = in_header + 2;
    if (length == 0) {  // this tile-part reaches to the end of the codestream
      constexpr std::array<std::uint8_t, 2> end_marker{0xff, 0xd9};
      const auto end = std::find_end(bytes.begin() + static_cast<std::ptrdiff_t>(in_header), bytes.end(),
                                     end_marker.begin(), end_marker.end());
      at = static_cast<std::size_t>(end - bytes.begin());
    } else {
      expect(at + length >= data, "expected a tile-part of more than " + std::to_string(length) + " bytes");
      at += length;
    }
    number_at(bytes, at, 2);  // refuses a codestream without an end marker
    if (is_high_throughput) check_stuffing(bytes.subspan(data, std::max(at, data) - data));
  }
  const auto missing = std::find(seen.begin(), seen.end(), false);
  expect(missing == seen.end(), "expected " + std::to_string(tiles) + " tiles, found none with number " +
                                    std::to_string(missing - seen.begin() + 1));
  return at + 2;
}

/// The codestream within a file of JPEG 2000 (T.800 Annex I). DICOM does not allow such files as Pixel Data, and some
/// devices send them.
Bytes without_boxes(Bytes bytes) {
  constexpr std::uint64_t kSignature = 0x6a502020, kCodestream = 0x6a703263;  // the boxes "jP  " and "jp2c"
  if (bytes.size() < 12 || number_at(bytes, 4, 4) != kSignature) return bytes;
  for (std::size_t at = 0;;) {
    std::uint64_t length = number_at(bytes, at, 4);
    const std::uint64_t type = number_at(bytes, at + 4, 4);
    const std::size_t begin = at + (length == 1 ? 16 : 8);
    if (length == 1) length = number_at(bytes, at + 8, 8);
    if (length == 0) length = bytes.size() - at;
    expect(length >= begin - at && length <= bytes.size() - at, "expected a box of JPEG 2000, found a damaged one");
    if (type == kCodestream) return bytes.subspan(begin, length - (begin - at));
    at += length;
  }
}

Jpeg2000Image read(Bytes bytes) {
  Jpeg2000Image image;
  bytes = without_boxes(bytes);
  expect(marker_at(bytes, 0).code == kStart, "expected a JPEG 2000 codestream, found something else");
  Marker marker = marker_at(bytes, 2);
  expect(marker.code == kSize, "expected the size of the image, found marker " + hex(marker.code));
  const ReferenceGrid grid = read_size(marker.segment, image);
  bool has_style = false;
  std::size_t at = marker.next;
  while ((marker = marker_at(bytes, at)).code != kTilePart) {
    expect(marker.code != kCodingStyleOfComponent && marker.code != kData && marker.code != kEnd &&
               marker.code != kStart && !(marker.code == kCodingStyle && has_style),
           "expected one coding style and tiles, found marker " + hex(marker.code));
    if (marker.code == kCodingStyle) {
      check_parts(grid, read_style(marker.segment), bytes.size());
      image.block_style_at = at + 4 + 8;
      has_style = true;
    }
    at = marker.next;
  }
  expect(has_style, "expected a coding style, found none");
  const bool is_high_throughput = (bytes[image.block_style_at] & 0x40) != 0;
  image.codestream = bytes.first(follow_tile_parts(bytes, at, grid.tiles_across * grid.tiles_down, is_high_throughput));
  return image;
}

}  // namespace

Jpeg2000Image read_jpeg_2000(Bytes bytes, std::string& problem) {
  try {
    return read(bytes);
  } catch (const Refusal& refusal) {
    problem = refusal.reason;
    return {};
  }
}

}  // namespace tetwarp
