// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/input.h"

#include <algorithm>
#include <bit>
#include <fstream>

#include "deform/phantom.h"
#include "deform/text/text_number.h"
#include "io/dicom_series.h"
#include "io/image_file.h"

namespace tetwarp::bench {

namespace {

/// The series that --series names, or the only one of CT slices.
const DicomSeries& choose_series(const DicomScan& scan, const InputOptions& options) {
  const std::string where = options.path.string();
  const DicomSeries* found = nullptr;
  std::size_t matches = 0;
  const auto number = number_from<std::size_t>(options.series);
  for (std::size_t n = 0; n < scan.series.size(); ++n) {
    const DicomSeries& series = scan.series[n];
    const bool meant = options.series.empty() ? !series.slices.empty()
                                              : (number ? n + 1 == *number : series.series_uid == options.series);
    if (!meant) continue;
    found = &series;
    ++matches;
  }
  require(matches != 0, "no DICOM CT series" + (options.series.empty() ? "" : " \"" + options.series + "\"") + ", " +
                            where + "; `tetwarp info` lists what is there");
  require(matches == 1, std::to_string(matches) + " series found, " + where +
                            "; choose one with --series, `tetwarp info` lists them");
  require(!found->refusal, found->refusal.value_or(""));
  return *found;
}

Volume<std::int16_t> read_dicom(const InputOptions& options) {
  const DicomScan scan = scan_dicom(options.path);
  return load_dicom(choose_series(scan, options)).volume;
}

Volume<std::int16_t> read_file(const InputOptions& options) {
  if (!options.series.empty()) {
    throw UsageError("--series is for DICOM, " + options.path.string() + "; leave it out");
  }
  const AnyVolume volume = read_image(options.path);
  require(volume.components() == 1, std::to_string(volume.components()) + " components a voxel, " +
                                        options.path.string() + "; expected a volume with one");
  require(volume.type() == VoxelType::i16, "the benchmark is of int16 volumes, " + options.path.string() + " holds " +
                                               to_string(volume.type()) + "; convert it first");
  const std::span<const std::int16_t> voxels = volume.as<std::int16_t>();
  return {volume.geometry(), {voxels.begin(), voxels.end()}};
}

Volume<std::int16_t> read_raw(const InputOptions& options) {
  static_assert(std::endian::native == std::endian::little);
  const std::string where = options.raw.string();
  const glm::i64vec3 size(options.size[0], options.size[1], options.size[2]);
  std::ifstream file(options.raw, std::ios::binary);
  require(file.good(), "cannot be read, " + where);
  Volume<std::int16_t> volume{{.size = size}, {}};
  const auto expected = static_cast<std::uint64_t>(voxel_count(volume.geometry)) * sizeof(std::int16_t);
  const std::uint64_t found = std::filesystem::file_size(options.raw);
  require(found == expected, to_string(size) + " int16 voxels are " + std::to_string(expected) + " bytes, " + where +
                                 " holds " + std::to_string(found) + "; correct --size");
  volume.voxels.resize(expected / sizeof(std::int16_t));
  file.read(reinterpret_cast<char*>(volume.voxels.data()), static_cast<std::streamsize>(expected));
  require(file.good(), "cannot be read to its end, " + where);
  return volume;
}

Volume<std::int16_t> read_any(const InputOptions& options, std::int64_t slices) {
  if (!options.raw.empty()) return read_raw(options);
  if (options.path.empty()) return make_phantom({options.width, options.width, slices}, {1, 1, 1}, kPhantomSeed);
  return has_image_suffix(options.path) ? read_file(options) : read_dicom(options);
}

}  // namespace

std::string input_kind(const InputOptions& options) {
  if (!options.raw.empty()) return "raw";
  if (options.path.empty()) return "phantom";
  return has_image_suffix(options.path) ? "image" : "dicom";
}

void require_contrast(const Volume<std::int16_t>& volume) {
  require(!volume.voxels.empty(), "a volume without voxels cannot be deformed");
  const auto [low, high] = std::minmax_element(volume.voxels.begin(), volume.voxels.end());
  require(*low != *high, "every voxel is " + std::to_string(*low) + "; the benchmark refuses to time on " +
                             (*low == 0 ? "zeros" : "a constant") + ", give a volume with contents");
}

Volume<std::int16_t> read_input(const InputOptions& options, std::int64_t slices) {
  Volume<std::int16_t> volume = read_any(options, slices);
  volume.geometry = {.size = volume.geometry.size};
  require_contrast(volume);
  return volume;
}

}  // namespace tetwarp::bench
