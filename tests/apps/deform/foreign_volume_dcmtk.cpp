// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cstring>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "tests/apps/deform/foreign_volumes.h"

namespace tetwarp::test {
namespace {

struct Slice {
  glm::dvec3 position{0}, row{0}, column{0};
  double rows_apart = 0, columns_apart = 0;
  std::int64_t rows = 0, columns = 0;
  std::vector<std::int16_t> hu;
};

double number(DcmDataset& data, const DcmTagKey& tag, unsigned long n = 0) {
  Float64 value = 0;
  Uint16 whole = 0;
  if (data.findAndGetFloat64(tag, value, n).good()) return value;
  if (data.findAndGetUint16(tag, whole, n).good()) return whole;
  throw std::runtime_error(std::string("no ") + DcmTag(tag).getTagName());
}

glm::dvec3 triple(DcmDataset& data, const DcmTagKey& tag, unsigned long first) {
  return {number(data, tag, first), number(data, tag, first + 1), number(data, tag, first + 2)};
}

Slice read_slice(const std::filesystem::path& file) {
  DcmFileFormat format;
  if (const OFCondition result = format.loadFile(file.c_str()); result.bad())
    throw std::runtime_error(file.string() + ": " + result.text());
  DcmDataset& data = *format.getDataset();
  Slice slice{.position = triple(data, DCM_ImagePositionPatient, 0),
              .row = triple(data, DCM_ImageOrientationPatient, 0),
              .column = triple(data, DCM_ImageOrientationPatient, 3),
              .rows_apart = number(data, DCM_PixelSpacing, 0),
              .columns_apart = number(data, DCM_PixelSpacing, 1),
              .rows = static_cast<std::int64_t>(number(data, DCM_Rows)),
              .columns = static_cast<std::int64_t>(number(data, DCM_Columns)),
              .hu = {}};
  const Uint16* stored = nullptr;
  unsigned long count = 0;
  if (data.findAndGetUint16Array(DCM_PixelData, stored, &count).bad() ||
      count != static_cast<unsigned long>(slice.rows * slice.columns))
    throw std::runtime_error(file.string() + ": not one native pixel of 16 bits a voxel");
  const bool is_signed = number(data, DCM_PixelRepresentation) != 0;
  const double slope = number(data, DCM_RescaleSlope), intercept = number(data, DCM_RescaleIntercept);
  for (unsigned long n = 0; n < count; ++n) {
    const double value = is_signed ? static_cast<std::int16_t>(stored[n]) : stored[n];
    slice.hu.push_back(static_cast<std::int16_t>(slope * value + intercept));
  }
  return slice;
}

}  // namespace

Volume<std::int16_t> read_with_dcmtk(const std::filesystem::path& folder) {
  std::vector<Slice> slices;
  for (const auto& file : std::filesystem::directory_iterator(folder)) slices.push_back(read_slice(file.path()));
  const Slice any = slices.at(0);
  const glm::dvec3 normal = glm::cross(any.row, any.column);
  std::sort(slices.begin(), slices.end(), [&](const Slice& a, const Slice& b) {
    return glm::dot(normal, a.position) < glm::dot(normal, b.position);
  });
  const double gaps = static_cast<double>(std::max<std::size_t>(slices.size() - 1, 1));
  const glm::dvec3 step = (slices.back().position - slices.front().position) / gaps;
  Volume<std::int16_t> volume;
  volume.geometry = {.size = {any.columns, any.rows, std::ssize(slices)},
                     .spacing = {any.columns_apart, any.rows_apart, glm::length(step)},
                     .origin = slices.front().position,
                     .direction = glm::dmat3(any.row, any.column, glm::normalize(step))};
  for (const Slice& slice : slices) volume.voxels.insert(volume.voxels.end(), slice.hu.begin(), slice.hu.end());
  return volume;
}

}  // namespace tetwarp::test
