#include <tbb/enumerable_thread_specific.h>

#include <glm/geometric.hpp>

#include "deform/large_memory.h"
#include "io/dicom_bytes.h"
#include "io/dicom_codecs.h"
#include "io/dicom_header.h"
#include "io/dicom_headers.h"
#include "io/dicom_pixels.h"
#include "io/dicom_put.h"
#include "io/dicom_series.h"
#include "io/dicom_stack.h"
#include "io/hash.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

/// A file that was listed may have been replaced since.
void require_unchanged(const DicomFileHeader& header, const DicomSlice& slice, const Geometry& geometry) {
  const auto same = [&](bool is_same, const std::string& what) {
    require(is_same, what + " is not what it was when the series was listed, " + shown(slice.file) + "; list it again");
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
  Sha256::Digest digest{};
  HuCount count;
};

LoadedSlice load_slice(const DicomSlice& slice, const Geometry& geometry, HuTableCache& tables, FileBuffer& buffer,
                       std::span<std::int16_t> hu) {
  LoadedSlice loaded;
  const std::span<const std::byte> bytes = buffer.read(slice.file);
  loaded.digest = Sha256().add(bytes).digest();
  ParsedSlice parsed = parse_slice(bytes, slice.file);
  const DicomFileHeader& header = parsed.header;
  for (const auto& problem : {geometry_problem(header), pixel_problem(header)}) require(problem.empty(), problem);
  require_unchanged(header, slice, geometry);
  const std::shared_ptr<const HuTable> table = tables.table_for(header.pixels);
  if (!parsed.native.empty()) {
    loaded.count = convert_to_hu(parsed.native, *table, slice.file, hu);
  } else {
    const std::vector<std::uint16_t> words = parsed.fragments.empty()
                                                 ? decode_pixels(*parsed.format->getDataset(), header)
                                                 : decode_frame(parsed.fragments, header);
    loaded.count = convert_to_hu(words, *table, slice.file, hu);
  }
  loaded.pixels = header.pixels;
  loaded.header.reset(parsed.format->getAndRemoveDataset());
  delete loaded.header->remove(DCM_PixelData);
  if (is_lossy(header.transfer_syntax_uid)) put(*loaded.header, DCM_LossyImageCompression, "01");
  return loaded;
}

bool same_padding(const std::optional<PaddingRange>& a, const std::optional<PaddingRange>& b) {
  return a.has_value() == b.has_value() && (!a || (a->low == b->low && a->high == b->high));
}

/// The padding of all slices, where they agree. Padding that was saturated is no data only if it is known as padding.
std::optional<PaddingRange> common_padding(const DicomSeries& series, const std::vector<LoadedSlice>& slices) {
  const auto first = padding_hu(slices.front().pixels);
  bool agree = true;
  for (const LoadedSlice& slice : slices) agree = agree && same_padding(padding_hu(slice.pixels), first);
  if (agree) return first;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    require(slices[k].count.saturated_padding == 0,
            "padding beyond int16 in HU, " + shown(series.slices[k].file) +
                ", and Pixel Padding Value (0028,0120) differs from slice to slice; make it the same in all slices");
  }
  return std::nullopt;
}

}  // namespace

DicomVolume load_dicom(const DicomSeries& series, int threads, const Control& control) {
  require(!series.refusal, series.refusal.value_or(""));
  require(!series.slices.empty(), "the series holds no slice, " + series.series_uid + "; choose another series");
  prepare_dcmtk();
  DicomVolume result;
  result.series_uid = series.series_uid;
  result.volume.geometry = series.geometry;
  resize_large(result.volume.voxels, static_cast<std::size_t>(voxel_count(series.geometry)), threads);
  const std::size_t slice_size = result.volume.voxels.size() / series.slices.size();

  std::vector<LoadedSlice> slices(series.slices.size());
  HuTableCache tables;
  tbb::enumerable_thread_specific<FileBuffer> buffers;  // one file a thread, however long the series
  for_each_index(slices.size(), threads, control, [&](std::size_t k) {
    const std::span<std::int16_t> hu = std::span(result.volume.voxels).subspan(k * slice_size, slice_size);
    slices[k] = load_slice(series.slices[k], series.geometry, tables, buffers.local(), hu);
  });

  result.padding = common_padding(series, slices);
  auto headers = std::make_shared<DicomHeaders>();
  Sha256 hash;
  for (LoadedSlice& slice : slices) {
    hash.add(slice.digest);
    result.rounded += slice.count.rounded;
    headers->slices.push_back(std::move(slice.header));
  }
  result.sha256 = hash.hex();
  result.headers = std::move(headers);
  return result;
}

}  // namespace tetwarp
