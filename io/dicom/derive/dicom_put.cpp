// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/derive/dicom_put.h"

#include <dcmtk/dcmdata/dcsequen.h>
#include <dcmtk/dcmdata/dctag.h>
#include <dcmtk/dcmdata/dcvrss.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "deform/errors.h"
#include "deform/version.h"

namespace tetwarp {

namespace {

void check(const OFCondition& condition, const DcmTagKey& tag) {
  if (condition.bad()) throw Error("cannot set attribute " + tag_name(tag) + ": " + condition.text());
}

std::string decimal_strings(std::span<const double> values) {
  std::string text;
  for (const double value : values) {
    if (!text.empty()) text += '\\';
    text += decimal_string(value);
  }
  return text;
}

}  // namespace

std::string decimal_string(double value) {
  require(std::isfinite(value), "a DICOM decimal string cannot hold " + std::to_string(value) + "; check the geometry");
  if (value == 0) return "0";  // minus zero is written without a sign
  constexpr std::ptrdiff_t kLongest = 16;
  char text[32];
  std::to_chars_result result = std::to_chars(text, text + sizeof text, value);
  for (int digits = 16; result.ptr - text > kLongest; --digits) {
    result = std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits);
  }
  return {text, result.ptr};
}

std::string tag_name(const DcmTagKey& tag) {
  char number[16];
  std::snprintf(number, sizeof number, "(%04x,%04x) ", tag.getGroup(), tag.getElement());
  return number + std::string(DcmTag(tag).getTagName());
}

void put(DcmItem& item, const DcmTagKey& tag, const std::string& value) {
  check(item.putAndInsertString(tag, value.c_str()), tag);
}
void put(DcmItem& item, const DcmTagKey& tag, std::uint16_t value) { check(item.putAndInsertUint16(tag, value), tag); }

void put_missing(DcmItem& item, std::span<const DcmTagKey> tags) {
  for (const DcmTagKey& tag : tags) {
    if (!item.tagExists(tag)) put(item, tag, "");
  }
}

void drop(DcmItem& item, const DcmTagKey& tag) { item.findAndDeleteElement(tag); }

void put(DcmItem& item, const DcmTagKey& tag, std::int16_t value) {
  auto element = std::make_unique<DcmSignedShort>(DcmTag(tag, EVR_SS));
  check(element->putSint16(value), tag);
  check(item.insert(element.get(), OFTrue), tag);
  element.release();
}

void put_decimals(DcmItem& item, const DcmTagKey& tag, std::span<const double> values, double tolerance) {
  bool same = true;
  for (std::size_t i = 0; i < values.size() && same; ++i) {
    double present = 0;
    same = item.findAndGetFloat64(tag, present, static_cast<unsigned long>(i)).good() &&
           std::abs(present - values[i]) <= tolerance;
  }
  if (!same) put(item, tag, decimal_strings(values));
}

DcmItem& append_item(DcmItem& item, const DcmTagKey& sequence) {
  DcmSequenceOfItems* present = nullptr;
  if (item.findAndGetSequence(sequence, present).bad()) drop(item, sequence);
  DcmItem* appended = nullptr;
  check(item.findOrCreateSequenceItem(sequence, appended, -2), sequence);  // -2: a new item at the end
  return *appended;
}

void put_empty_sequence(DcmItem& item, const DcmTagKey& sequence) {
  check(item.insertEmptyElement(sequence, OFTrue), sequence);
}

void append_code(DcmItem& item, const DcmTagKey& sequence, const std::string& value, const std::string& meaning) {
  DcmItem& code = append_item(item, sequence);
  put(code, DCM_CodeValue, value);
  put(code, DCM_CodingSchemeDesignator, "DCM");
  put(code, DCM_CodeMeaning, meaning);
}

void put_position(DcmItem& item, const Geometry& geometry, std::int64_t k) {
  const glm::dvec3 position = point_from_index(geometry)(glm::dvec3(0, 0, static_cast<double>(k)));
  put_decimals(item, DCM_ImagePositionPatient, std::vector{position.x, position.y, position.z}, 1e-6);
}

void put_orientation(DcmItem& item, const Geometry& geometry) {
  const glm::dvec3 row = geometry.direction[0], column = geometry.direction[1];
  put_decimals(item, DCM_ImageOrientationPatient, std::vector{row.x, row.y, row.z, column.x, column.y, column.z}, 1e-7);
}

void put_pixel_spacing(DcmItem& item, const Geometry& geometry) {
  put_decimals(item, DCM_PixelSpacing, std::vector{geometry.spacing.y, geometry.spacing.x}, 1e-7);
}

void put_image_plane(DcmItem& item, const Geometry& geometry, std::int64_t k) {
  put_position(item, geometry, k);
  put_orientation(item, geometry);
  put_pixel_spacing(item, geometry);
}

const Geometry& require_hu_volume(const ConstVolumeView& volume) {
  require(volume.geometry && volume.voxels, "there is no volume to write as DICOM");
  require_valid(*volume.geometry, "the volume to write as DICOM");
  require(volume.type == VoxelType::i16 && volume.components == 1, "a DICOM CT series needs int16 HU, the volume has " +
                                                                       std::to_string(volume.components) + " x " +
                                                                       to_string(volume.type) + "; convert it");
  require(volume.buffered == whole(*volume.geometry), "only a part of the volume is there; give all of it");
  require(volume.geometry->size.x <= UINT16_MAX && volume.geometry->size.y <= UINT16_MAX,
          "a DICOM image has at most 65535 rows and columns, the volume is " + to_string(volume.geometry->size));
  return *volume.geometry;
}

std::span<const std::int16_t> slice_of(const ConstVolumeView& volume, std::size_t k) {
  const std::size_t count = static_cast<std::size_t>(volume.geometry->size.x * volume.geometry->size.y);
  return {reinterpret_cast<const std::int16_t*>(volume.voxels) + k * count, count};
}

void put_pixel_format(DcmItem& item, const Geometry& geometry, int bits, bool is_signed) {
  require(geometry.size.x <= UINT16_MAX && geometry.size.y <= UINT16_MAX,
          "a DICOM image has at most 65535 rows and columns, the volume is " + to_string(geometry.size));
  put(item, DCM_SamplesPerPixel, std::uint16_t{1});
  put(item, DCM_PhotometricInterpretation, "MONOCHROME2");
  put(item, DCM_Rows, static_cast<std::uint16_t>(geometry.size.y));
  put(item, DCM_Columns, static_cast<std::uint16_t>(geometry.size.x));
  put(item, DCM_BitsAllocated, static_cast<std::uint16_t>(bits));
  put(item, DCM_BitsStored, static_cast<std::uint16_t>(bits));
  put(item, DCM_HighBit, static_cast<std::uint16_t>(bits - 1));
  put(item, DCM_PixelRepresentation, static_cast<std::uint16_t>(is_signed));
}

void put_hu_format(DcmItem& item, const Geometry& geometry) {
  put_pixel_format(item, geometry, 16, true);
  put(item, DCM_RescaleIntercept, "0");
  put(item, DCM_RescaleSlope, "1");
  put(item, DCM_RescaleType, "HU");
}

void put_tetwarp(DcmItem& item, const std::string& model) {
  put(item, DCM_Manufacturer, "Tetwarp");
  put(item, DCM_ManufacturerModelName, model);
  put(item, DCM_SoftwareVersions, std::string(version()) + "\\" + commit());
}

std::string ascii(const std::string& text, std::size_t characters) {
  std::string result = text.substr(0, characters);
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return result;
}

}  // namespace tetwarp
