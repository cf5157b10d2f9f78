// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/enumerable_thread_specific.h>

#include <glm/geometric.hpp>
#include <map>
#include <mutex>
#include <utility>

#include "deform/large_memory.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/pixels/dicom_pixels.h"
#include "io/dicom/scan/dicom_bytes.h"
#include "io/dicom/scan/dicom_frames.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_headers.h"
#include "io/dicom/scan/dicom_stack.h"
#include "io/dicom_series.h"
#include "io/hash.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

/// Throws if a file is no longer the slice that was listed: it may have been replaced since.
void require_unchanged(const DicomFileHeader& header, const DicomSlice& slice, const Geometry& geometry) {
  const auto same = [&](bool is_same, const std::string& what) {
    require(is_same, what + " is not what it was when the series was listed, " + shown(slice.file, slice.frame) +
                         "; list it again");
  };
  const glm::dmat3 direction = rotation_of(*header.orientation);
  const glm::dvec2 spacing{geometry.spacing.x, geometry.spacing.y};
  same(header.sop_instance_uid == slice.sop_instance_uid, "SOP Instance UID");
  same(header.transfer_syntax_uid == slice.transfer_syntax_uid, "Transfer Syntax UID");
  same(header.pixels.columns == geometry.size.x && header.pixels.rows == geometry.size.y, "Rows x Columns");
  same(glm::dot(*header.position, direction[2]) == slice.position_mm, "Image Position");
  same(glm::dot(direction[0], geometry.direction[0]) > 1 - 1e-6 &&
           glm::dot(direction[1], geometry.direction[1]) > 1 - 1e-6,
       "Image Orientation");
  same(glm::length(*header.spacing - spacing) <= 1e-4 * glm::length(spacing), "Pixel Spacing");
}

struct LoadedSlice {
  std::unique_ptr<DcmDataset> header;  ///< without Pixel Data
  PixelFormat pixels;
  HuCount count;
};

void check(const DicomFileHeader& header, const DicomSlice& slice, const Geometry& geometry) {
  for (const auto problem_of : {geometry_problem, pixel_problem, excess_problem}) {
    const std::string problem = problem_of(header);
    require(problem.empty(), problem);
  }
  require_unchanged(header, slice, geometry);
}

/// Keeps what later steps need of a slice whose voxels were read.
void finish(LoadedSlice& loaded, std::unique_ptr<DcmDataset> data, const DicomFileHeader& header) {
  loaded.pixels = header.pixels;
  loaded.header = std::move(data);
  delete loaded.header->remove(DCM_PixelData);
  if (is_lossy(header.transfer_syntax_uid)) put(*loaded.header, DCM_LossyImageCompression, "01");
}

/// What threads that load slices share.
struct Loading {
  const DicomSeries& series;
  std::span<std::int16_t> voxels;
  HuTableCache tables = {};
  /// Each thread reads one file at a time, however long the series.
  tbb::enumerable_thread_specific<FileBuffer> buffers = {};

  std::span<std::int16_t> slice(std::size_t k) const {
    const std::size_t size = voxels.size() / series.slices.size();
    return voxels.subspan(k * size, size);
  }
};

/// Loads slice k from a file of its own. @param digest  receives the hash of the file; null: none is made
LoadedSlice load_slice(Loading& loading, std::size_t k, Sha256::Digest* digest) {
  const DicomSlice& slice = loading.series.slices[k];
  LoadedSlice loaded;
  const std::span<const std::byte> bytes = loading.buffers.local().read(slice.file);
  if (digest) *digest = Sha256().add(bytes).digest();
  ParsedSlice parsed = parse_slice(bytes, slice.file);
  const DicomFileHeader& header = parsed.header;
  check(header, slice, loading.series.geometry);
  const std::shared_ptr<const HuTable> table = loading.tables.table_for(header.pixels);
  if (!parsed.native.empty()) {
    loaded.count = convert_to_hu(parsed.native, *table, shown(header), loading.slice(k));
  } else {
    loaded.count = convert_to_hu(decode_slice(parsed), *table, shown(header), loading.slice(k));
  }
  finish(loaded, std::unique_ptr<DcmDataset>(parsed.format->getAndRemoveDataset()), header);
  return loaded;
}

/// Loads slice k, a frame of a file.
LoadedSlice load_frame(Loading& loading, std::size_t k, const FrameFile& file) {
  const DicomSlice& slice = loading.series.slices[k];
  LoadedSlice loaded;
  FrameFile::Frame frame = file.frame(*slice.frame);
  check(frame.header, slice, loading.series.geometry);
  const std::shared_ptr<const HuTable> table = loading.tables.table_for(frame.header.pixels);
  const FrameFile::Pixels pixels = file.pixels(frame.header, loading.buffers.local());
  loaded.count = pixels.native.empty() ? convert_to_hu(pixels.words, *table, shown(frame.header), loading.slice(k))
                                       : convert_to_hu(pixels.native, *table, shown(frame.header), loading.slice(k));
  finish(loaded, std::move(frame.data), frame.header);
  return loaded;
}

/// A file that holds one slice, or several as its frames. The first slice that is loaded parses it, and the last one
/// frees it.
struct SourceFile {
  std::filesystem::path path;
  std::size_t slices = 0;  ///< how many slices are not loaded yet
  bool has_frames = false;
  Sha256::Digest digest{};
  std::unique_ptr<std::mutex> mutex = std::make_unique<std::mutex>();
  std::shared_ptr<const FrameFile> frames = {};

  std::shared_ptr<const FrameFile> for_one_frame() {
    const std::lock_guard lock(*mutex);
    if (!frames) frames = std::make_shared<FrameFile>(path);
    --slices;
    return slices > 0 ? frames : std::exchange(frames, nullptr);
  }
};

/// All files of a series, each once, in the order of their first slices.
struct SourceFiles {
  std::vector<SourceFile> files;
  std::vector<std::size_t> of_slice;  ///< by slice: its file

  explicit SourceFiles(const DicomSeries& series) {
    std::map<std::filesystem::path, std::size_t> numbers;  // files of frames only
    for (const DicomSlice& slice : series.slices) {
      const auto next = slice.frame ? numbers.try_emplace(slice.file, files.size()).first->second : files.size();
      if (next == files.size()) files.push_back({.path = slice.file, .has_frames = slice.frame.has_value()});
      ++files[next].slices;
      of_slice.push_back(next);
    }
  }

  std::string hash() const {
    Sha256 hash;
    for (const SourceFile& file : files) hash.add(file.digest);
    return hash.hex();
  }
};

bool same_padding(const std::optional<PaddingRange>& a, const std::optional<PaddingRange>& b) {
  return a.has_value() == b.has_value() && (!a || (a->low == b->low && a->high == b->high));
}

/// The padding, where all slices agree. Where values of padding were saturated, all slices must agree: the saturated
/// values would pass for data.
std::optional<PaddingRange> common_padding(const DicomSeries& series, const std::vector<LoadedSlice>& slices) {
  const auto first = padding_hu(slices.front().pixels);
  bool agree = true;
  for (const LoadedSlice& slice : slices) agree = agree && same_padding(padding_hu(slice.pixels), first);
  if (agree) return first;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    require(slices[k].count.saturated_padding == 0,
            "padding beyond int16 in HU, " + shown(series.slices[k].file, series.slices[k].frame) +
                ", and Pixel Padding Value (0028,0120) differs from slice to slice; make it the same in all slices");
  }
  return std::nullopt;
}

}  // namespace

std::string hash_files(const DicomSeries& series, int threads, const Control& control) {
  SourceFiles sources(series);
  for_each_index(sources.files.size(), threads, control,
                 [&](std::size_t n) { sources.files[n].digest = digest_of(sources.files[n].path); });
  return sources.hash();
}

std::shared_ptr<const DicomHeaders> copy_headers(const DicomHeaders& headers) {
  auto copy = std::make_shared<DicomHeaders>();
  copy->frames = headers.frames;
  for (const auto& slice : headers.slices) copy->slices.push_back(std::make_unique<DcmDataset>(*slice));
  return copy;
}

DicomVolume load_dicom(const DicomSeries& series, int threads, const Control& control, FileHash hash) {
  require(!series.refusal, series.refusal.value_or(""));
  require(!series.slices.empty(), "the series holds no slice, " + series.series_uid + "; choose another series");
  prepare_dcmtk();
  DicomVolume result;
  result.series_uid = series.series_uid;
  result.volume.geometry = series.geometry;
  resize_large(result.volume.voxels, static_cast<std::size_t>(voxel_count(series.geometry)), threads);

  std::vector<LoadedSlice> slices(series.slices.size());
  SourceFiles sources(series);
  Loading loading{series, result.volume.voxels};
  std::vector<std::size_t> with_frames;  // these are hashed on their own, first, as that takes longest
  for (std::size_t n = 0; n < sources.files.size(); ++n) {
    if (hash == FileHash::made && sources.files[n].has_frames) with_frames.push_back(n);
  }
  for_each_index(with_frames.size() + slices.size(), threads, control, [&](std::size_t i) {
    if (i < with_frames.size()) {
      SourceFile& file = sources.files[with_frames[i]];
      file.digest = digest_of(file.path);
      return;
    }
    const std::size_t k = i - with_frames.size();
    SourceFile& file = sources.files[sources.of_slice[k]];
    slices[k] = file.has_frames ? load_frame(loading, k, *file.for_one_frame())
                                : load_slice(loading, k, hash == FileHash::made ? &file.digest : nullptr);
  });

  result.padding = common_padding(series, slices);
  auto headers = std::make_shared<DicomHeaders>();
  for (std::size_t k = 0; k < slices.size(); ++k) {
    result.rounded += slices[k].count.rounded;
    headers->slices.push_back(std::move(slices[k].header));
    headers->frames.push_back(series.slices[k].frame ? *series.slices[k].frame + 1 : 0);
  }
  if (hash == FileHash::made) result.sha256 = sources.hash();
  result.headers = std::move(headers);
  return result;
}

}  // namespace tetwarp
