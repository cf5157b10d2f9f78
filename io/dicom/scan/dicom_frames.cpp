// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_frames.h"

#include <dcmtk/dcmdata/dcdeftag.h>

#include <algorithm>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/pixels/dicom_pixels.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

/// Numbers of `width` bytes each, the low byte first.
std::vector<std::uint64_t> numbers_in(std::span<const std::byte> bytes, std::size_t width) {
  std::vector<std::uint64_t> numbers(bytes.size() / width);
  for (std::size_t n = 0; n < width * numbers.size(); ++n)
    numbers[n / width] |= std::to_integer<std::uint64_t>(bytes[n]) << 8 * (n % width);
  return numbers;
}

/// The entries of Extended Offset Table (PS3.3 C.7.6.3.1.8); empty where there is none.
std::vector<std::uint64_t> extended_offsets(DcmDataset& data) {
  DcmElement* element = nullptr;
  Uint64* offsets = nullptr;
  if (!is_at_most(data, DCM_ExtendedOffsetTable, kLongestValue) ||
      data.findAndGetElement(DCM_ExtendedOffsetTable, element).bad() || element->getUint64Array(offsets).bad() ||
      !offsets) {
    return {};
  }
  return {offsets, offsets + element->getLength() / sizeof *offsets};
}

}  // namespace

FrameFile::FrameFile(const std::filesystem::path& file) : file_(file), opened_(std::make_shared<OpenedFile>(file)) {
  require(opened_->problem().empty(),
          "cannot be read, " + shown(file) + ": " + opened_->problem() + "; check the file");
  parse(DCM_PixelData, kLargestInflatedHeader);
  frames_ = std::make_unique<EnhancedFrames>(*format_->getDataset());
  require(frames_->problem().empty(), frames_->problem() + ", " + shown(file) + "; export the file again");
  find_pixels();
}

void FrameFile::parse(const DcmTagKey& until, std::size_t inflated_limit) {
  format_ = std::make_unique<DcmFileFormat>();
  const DicomRead read = parse_dicom(*format_, opened_, until, ERM_autoDetect, inflated_limit);
  require(read.result.good(),
          "truncated or damaged file, " + shown(file_) + ": " + read.result.text() + "; copy the file again");
  rest_ = read.rest;
  DcmDataset& data = *format_->getDataset();
  for (DcmObject* one = data.nextInContainer(nullptr); one; one = data.nextInContainer(one)) {
    if (one->getTag().getXTag() != DCM_PixelData) one->loadAllDataIntoMemory();
  }
  whole_ = header_of(*format_, file_);
  whole_.file_bytes = opened_->size();
}

void FrameFile::find_pixels() {
  const std::uint64_t at = opened_->size() - std::min<std::uint64_t>(rest_, opened_->size());
  if (rest_ > 0 && pixel_coding(whole_.transfer_syntax_uid).value_or(PixelCoding::native) != PixelCoding::native) {
    whole_.pixel_bytes = rest_;
    const auto read = [&](std::uint64_t begin, std::span<std::byte> to) { return opened_->read(begin, to); };
    return assign_fragments(pixel_items(read, opened_->size(), at));
  }
  std::array<std::byte, 12> start{};
  const bool is_deflated = whole_.encoding == EXS_DeflatedLittleEndianExplicit;
  if (!is_deflated && at >= start.size() && opened_->read(at - start.size(), start) == start.size()) {
    const auto length = native_length(start, whole_.encoding);
    if (length && whole_.pixels.bits_allocated == 16) {
      whole_.pixel_bytes = std::min<std::uint64_t>(*length, rest_);
      native_begin_ = at;
      return;
    }
  }
  frames_.reset();
  parse(DCM_UndefinedTagKey, inflated_limit(whole_.pixels));
  whole_.pixel_bytes = pixel_bytes_of(*format_->getDataset(), opened_->size());
  frames_ = std::make_unique<EnhancedFrames>(*format_->getDataset());
}

void FrameFile::assign_fragments(const PixelItems& found) {
  const auto frames = static_cast<std::size_t>(frames_->count());
  if (!found.items.empty()) fragments_.assign(found.items.begin() + 1, found.items.end());
  const std::size_t count = fragments_.size();
  std::vector<std::uint64_t> basic;
  if (!found.items.empty()) {
    const FileRange entries{found.items.front().begin, std::min(found.items.front().bytes, kLongestValue)};
    FileBuffer table;
    basic = numbers_in(table.read(file_, {&entries, 1}), sizeof(std::uint32_t));
  }
  if (!found.end) refuse_cut(basic);
  if (count == frames || frames == 1) {  // one fragment a frame, since no frame is without one
    for (std::size_t n = 0; n < frames; ++n) first_fragment_.push_back(n);
    first_fragment_.push_back(count);
    return;
  }
  const std::string mismatch = plural(count, "fragment") + " of " + plural(frames, "frame");
  if (count < frames) refuse_pixels(whole_, "expected a fragment of each frame, found " + mismatch);
  std::vector<std::size_t> starts;
  const std::vector<std::uint64_t> extended = extended_offsets(*format_->getDataset());
  if (!extended.empty()) starts = starts_in_table(extended, "Extended Offset Table (7FE0,0001)");
  if (!basic.empty()) {
    const std::vector<std::size_t> others = starts_in_table(basic, "Basic Offset Table");
    if (!starts.empty() && starts != others)
      refuse_pixels(whole_, "expected offset tables that agree, found two that do not");
    starts = others;
  }
  if (starts.empty()) refuse_pixels(whole_, "expected an offset table, found none with " + mismatch);
  first_fragment_ = std::move(starts);
  first_fragment_.push_back(count);
}

/// Refuses Pixel Data whose fragments end early and names the frame in which they do. The offset table tells the frame;
/// without one, one fragment is taken for one frame.
void FrameFile::refuse_cut(std::span<const std::uint64_t> table) const {
  const auto frames = static_cast<std::size_t>(frames_->count());
  const std::size_t count = fragments_.size();
  std::size_t frame = std::min(count + 1, frames);
  if (table.size() == frames && count > 0) {
    const std::uint64_t end = fragments_.back().begin + fragments_.back().bytes - fragments_.front().begin + 8;
    const auto after = std::upper_bound(table.begin(), table.end(), end);
    frame = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - table.begin(), 1));
  }
  refuse_pixels(whole_, "Pixel Data is truncated or damaged in frame " + std::to_string(frame) +
                            ": expected a whole fragment after " + std::to_string(count) + ", found none");
}

std::vector<std::size_t> FrameFile::starts_in_table(std::span<const std::uint64_t> table,
                                                    const std::string& name) const {
  const auto frames = static_cast<std::size_t>(frames_->count());
  if (table.size() != frames) {
    refuse_pixels(whole_, "expected " + std::to_string(frames) + " entries of the " + name + ", found " +
                              std::to_string(table.size()));
  }
  std::vector<std::size_t> starts;
  std::size_t fragment = 0;
  for (const std::uint64_t offset : table) {
    const std::uint64_t begin = fragments_.front().begin + offset;
    while (fragment < fragments_.size() && fragments_[fragment].begin < begin) ++fragment;
    const bool fits = fragment < fragments_.size() && fragments_[fragment].begin == begin &&
                      (starts.empty() ? fragment == 0 : fragment > starts.back());
    if (!fits) {
      refuse_pixels(whole_, "expected the beginning of frame " + std::to_string(starts.size() + 1) + " in the " + name +
                                ", found " + std::to_string(offset) + ", where no fragment of its own begins");
    }
    starts.push_back(fragment);
  }
  return starts;
}

FrameFile::Frame FrameFile::frame(int number) const {
  Frame frame;
  {
    const std::lock_guard lock(mutex_);
    require(number >= 0 && number < frames_->count(), "there is no frame " + std::to_string(number + 1) +
                                                          ", expected at most " + std::to_string(frames_->count()) +
                                                          ", " + shown(file_) + "; list the series again");
    frame.data = frames_->slice(number);
  }
  frame.header = frame_header(*frame.data, whole_, number);
  for (const DcmTagKey& tag : {DCM_StackID, DCM_TemporalPositionIndex, DCM_DimensionIndexValues})
    drop(*frame.data, tag);  // frames of this file are counted by these; `header` keeps what is needed of them
  return frame;
}

FrameFile::Pixels FrameFile::pixels(const DicomFileHeader& header, FileBuffer& buffer) const {
  const auto frame = static_cast<std::size_t>(header.frame.value_or(0));
  if (native_begin_) {
    const std::uint64_t bytes = slice_bytes(header.pixels);
    const FileRange words{*native_begin_ + frame * bytes, bytes};
    return {buffer.read(file_, {&words, 1}), {}};
  }
  if (!first_fragment_.empty()) {
    const std::size_t first = first_fragment_.at(frame), end = first_fragment_.at(frame + 1);
    const std::span<const std::byte> joined = buffer.read(file_, std::span(fragments_).subspan(first, end - first));
    return {{}, decode_frame({&joined, 1}, header)};
  }
  const std::lock_guard lock(mutex_);
  return {{}, decode_pixels(*format_->getDataset(), header)};
}

}  // namespace tetwarp
