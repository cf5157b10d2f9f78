#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcistrmb.h>

#include <glm/geometric.hpp>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "io/dicom_header.h"
#include "io/dicom_headers.h"
#include "io/dicom_pixels.h"
#include "io/dicom_series.h"
#include "io/dicom_stack.h"
#include "io/hash.h"
#include "io/parallel.h"

namespace tetwarp {
namespace {

std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  require(stream.good(), "cannot be read, " + file.string() + ": " + std::strerror(errno) + "; check the file");
  std::vector<std::byte> bytes(static_cast<std::size_t>(stream.tellg()));
  stream.seekg(0);
  stream.read(reinterpret_cast<char*>(bytes.data()), std::ssize(bytes));
  require(stream.gcount() == std::ssize(bytes), "cannot be read whole, " + file.string() + "; check the file");
  return bytes;
}

std::unique_ptr<DcmFileFormat> parse(const std::vector<std::byte>& bytes, const std::filesystem::path& file) {
  DcmInputBufferStream stream;
  stream.setBuffer(bytes.data(), std::ssize(bytes));
  stream.setEos();
  auto format = std::make_unique<DcmFileFormat>();
  format->transferInit();
  const OFCondition result = format->read(stream);
  format->transferEnd();
  require(result.good(),
          "truncated or damaged file, " + file.string() + ": " + result.text() + "; copy the file again");
  return format;
}

/// Bytes of Pixel Data that are there; compressed: of the file.
std::optional<std::uint64_t> pixel_bytes_of(DcmDataset& data, std::uint64_t file_bytes) {
  DcmElement* element = nullptr;
  if (data.findAndGetElement(DCM_PixelData, element).bad()) return std::nullopt;
  return DcmXfer(data.getOriginalXfer()).isEncapsulated() ? file_bytes : element->getLength();
}

/// A file that was listed may have been replaced since.
void require_unchanged(const DicomFileHeader& header, const DicomSlice& slice, const Geometry& geometry) {
  const auto same = [&](bool is_same, const std::string& what) {
    require(is_same,
            what + " is not what it was when the series was listed, " + slice.file.string() + "; list it again");
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

LoadedSlice load_slice(const DicomSlice& slice, const Geometry& geometry, HuTableCache& tables,
                       std::span<std::int16_t> hu) {
  LoadedSlice loaded;
  std::unique_ptr<DcmFileFormat> format;
  DicomFileHeader header;
  {
    const std::vector<std::byte> bytes = read_bytes(slice.file);
    loaded.digest = Sha256().add(bytes).digest();
    format = parse(bytes, slice.file);
    header = header_of(*format, slice.file);
    header.file_bytes = bytes.size();
    header.pixel_bytes = pixel_bytes_of(*format->getDataset(), bytes.size());
  }
  for (const auto& problem : {geometry_problem(header), pixel_problem(header)}) require(problem.empty(), problem);
  require_unchanged(header, slice, geometry);
  const std::vector<std::uint16_t> words = decode_pixels(*format->getDataset(), header);
  loaded.count = convert_to_hu(words, *tables.table_for(header.pixels), slice.file, hu);
  loaded.pixels = header.pixels;
  loaded.header.reset(format->getAndRemoveDataset());
  delete loaded.header->remove(DCM_PixelData);
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
            "padding beyond int16 in HU, " + series.slices[k].file.string() +
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
  result.volume.voxels.resize(static_cast<std::size_t>(voxel_count(series.geometry)));
  const std::size_t slice_size = result.volume.voxels.size() / series.slices.size();

  std::vector<LoadedSlice> slices(series.slices.size());
  HuTableCache tables;
  for_each_index(slices.size(), threads, control, [&](std::size_t k) {
    const std::span<std::int16_t> hu = std::span(result.volume.voxels).subspan(k * slice_size, slice_size);
    slices[k] = load_slice(series.slices[k], series.geometry, tables, hu);
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
