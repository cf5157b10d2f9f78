// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_copies.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <set>
#include <tuple>

#include "io/dicom/pixels/dicom_pixels.h"
#include "io/dicom/scan/dicom_bytes.h"
#include "io/hash.h"
#include "io/opened_file.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using Headers = std::vector<DicomFileHeader>;

/// Whether the last `count` bytes of two files are the same.
bool same_end(const DicomFileHeader& a, const DicomFileHeader& b, std::uint64_t count) {
  constexpr std::size_t kPiece = 1 << 20;
  OpenedFile first(a.file), second(b.file);
  if (first.size() != a.file_bytes || second.size() != b.file_bytes) return false;
  std::vector<std::byte> left(std::min<std::uint64_t>(count, kPiece)), right(left.size());
  while (count > 0) {
    const std::size_t piece = std::min<std::uint64_t>(count, left.size());
    const bool read = first.read(a.file_bytes - count, std::span(left).first(piece)) == piece &&
                      second.read(b.file_bytes - count, std::span(right).first(piece)) == piece;
    if (!read || std::memcmp(left.data(), right.data(), piece) != 0) return false;
    count -= piece;
  }
  return true;
}

bool same_file(const DicomFileHeader& a, const DicomFileHeader& b) {
  return a.file_bytes == b.file_bytes && same_end(a, b, a.file_bytes);
}

/// The stored values of a slice; none where it cannot be decoded.
std::optional<std::vector<int>> stored_values(const DicomFileHeader& header) {
  try {
    FileBuffer buffer;
    const ParsedSlice slice = parse_slice(buffer.read(header.file), header.file);
    if (!pixel_problem(slice.header).empty()) return std::nullopt;
    std::vector<std::uint16_t> words(slice.native.size() / 2);
    if (slice.native.empty())
      words = decode_slice(slice);
    else
      std::memcpy(words.data(), slice.native.data(), 2 * words.size());
    std::vector<int> values;
    for (const std::uint16_t word : words) values.push_back(stored_value(slice.header.pixels, word));
    return values;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

bool same_encoded_pixels(const DicomFileHeader& a, const DicomFileHeader& b) {
  const bool comparable = a.encoding == b.encoding && a.encoding != EXS_DeflatedLittleEndianExplicit;
  return comparable && a.pixel_bytes && a.pixel_bytes == b.pixel_bytes && same_end(a, b, *a.pixel_bytes);
}

/// Why two files of one SOP Instance UID do not hold the same image; empty: they do.
std::string difference(const DicomFileHeader& a, const DicomFileHeader& b) {
  if (same_file(a, b)) return {};
  if (a.frame || b.frame) return "hold several frames and are not the same byte for byte";
  if (a.position != b.position) return "differ in Image Position";
  if (a.orientation != b.orientation) return "differ in Image Orientation";
  if (a.spacing != b.spacing) return "differ in Pixel Spacing";
  if (a.pixels != b.pixels) return "differ in the form or the meaning of their pixels";
  if (same_encoded_pixels(a, b)) return {};
  const auto first = stored_values(a), second = stored_values(b);
  if (!first || !second) return "cannot be compared, the pixels of one cannot be decoded";
  return *first == *second ? std::string() : "differ in their pixels";
}

/// A file that may be a copy of an earlier one. Each file is given by the index of its first header.
struct Pair {
  std::size_t original, copy;
};

bool has_shorter_name(const DicomFileHeader& a, const DicomFileHeader& b) {
  const std::string &left = a.file.native(), &right = b.file.native();
  return left.size() != right.size() ? left.size() < right.size() : left < right;
}

/// Pairs each file with the one of the shortest name among the files that have the same key. A file of several frames
/// counts as one file; a file without a key is in no pair.
template <class Key>
std::vector<Pair> pairs_by(const Headers& files, const std::vector<std::optional<Key>>& keys) {
  std::vector<std::size_t> order;
  for (std::size_t n = 0; n < files.size(); ++n) {
    if (keys[n]) order.push_back(n);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : has_shorter_name(files[a], files[b]);
  });
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < order.size();) {
    const std::size_t first = order[i];
    std::size_t last = first;
    for (++i; i < order.size() && keys[order[i]] == keys[first]; ++i) {
      if (files[order[i]].file != files[last].file) pairs.push_back({first, last = order[i]});
    }
  }
  return pairs;
}

std::vector<Pair> pairs_of_one_uid(const Headers& files) {
  std::vector<std::optional<std::string_view>> uids(files.size());
  for (std::size_t n = 0; n < files.size(); ++n) {
    if (!files[n].sop_instance_uid.empty()) uids[n] = files[n].sop_instance_uid;
  }
  return pairs_by(files, uids);
}

/// Pairs of files without a UID that are the same byte for byte. Only files of one size whose slices lie at one
/// position are read.
std::vector<Pair> pairs_of_same_bytes(const Headers& files, const std::stop_token& stop) {
  std::vector<std::optional<std::tuple<double, double, double, std::uint64_t>>> places(files.size());
  for (std::size_t n = 0; n < files.size(); ++n) {
    const glm::dvec3 p = files[n].position.value_or(glm::dvec3(0));
    if (files[n].sop_instance_uid.empty() && files[n].frame.value_or(0) == 0)
      places[n] = {p.x, p.y, p.z, files[n].file_bytes};
  }
  std::set<std::size_t> together;
  for (const Pair& pair : pairs_by(files, places)) together.insert({pair.original, pair.copy});
  const std::vector<std::size_t> suspects(together.begin(), together.end());
  std::vector<std::optional<Sha256::Digest>> digests(files.size());
  for_each_index(suspects.size(), 0, {.stop = stop},
                 [&](std::size_t i) { digests[suspects[i]] = digest_of(files[suspects[i]].file); });
  return pairs_by(files, digests);
}

}  // namespace

std::optional<std::string> drop_copies(Headers& files, DicomSeries& series, const std::stop_token& stop) {
  std::vector<Pair> pairs = pairs_of_one_uid(files);
  std::vector<std::string> differences(pairs.size());
  for_each_index(pairs.size(), 0, {.stop = stop},
                 [&](std::size_t n) { differences[n] = difference(files[pairs[n].original], files[pairs[n].copy]); });
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    if (differences[n].empty()) continue;
    const DicomFileHeader &original = files[pairs[n].original], &copy = files[pairs[n].copy];
    return "two files have the SOP Instance UID " + shown(copy.sop_instance_uid) + " and " + differences[n] + ": " +
           shown(original.file) + ", " + shown(copy.file) + "; take away the one that is wrong";
  }
  const std::vector<Pair> nameless = pairs_of_same_bytes(files, stop);
  pairs.insert(pairs.end(), nameless.begin(), nameless.end());
  if (pairs.empty()) return std::nullopt;
  const std::string example =
      shown(files[pairs.front().copy].file) + " of " + shown(files[pairs.front().original].file);
  std::set<fs::path> copies;
  for (const Pair& pair : pairs) copies.insert(files[pair.copy].file);
  std::erase_if(files, [&](const DicomFileHeader& header) { return copies.contains(header.file); });
  series.warnings.push_back(std::to_string(copies.size()) + " identical " +
                            (copies.size() > 1 ? "copies of slices" : "copy of a slice") + " left out: " + example +
                            (copies.size() > 1 ? " and others" : ""));
  return std::nullopt;
}

}  // namespace tetwarp
