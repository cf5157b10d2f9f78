// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/derive/dicom_derive.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrui.h>

#include <algorithm>
#include <numeric>

#include "deform/version.h"
#include "io/dicom/codecs/dicom_compress.h"
#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_charset.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"
#include "io/shown_text.h"

namespace tetwarp {

namespace {

constexpr std::size_t kLongestDescription = 64;  // in characters, the limit of VR LO

std::string uid_of(const Sha256& hash) { return uid_from_digest(hash.digest()); }

/// Stands in for a UID that the source should have and does not have: a hash of all its headers, so that two sources
/// without UIDs are not taken for one.
std::string uid_from_headers(const DicomHeaders& source, const std::string& what) {
  Sha256 hash;
  hash.add(what);
  for (const auto& slice : source.slices) {
    DcmDataset copy(*slice);  // a copy, since encoding removes group lengths
    hash.add(encoded(copy));
  }
  return uid_of(hash);
}

std::string uid_or_made_up(const DicomHeaders& source, const DcmTagKey& tag) {
  const std::string uid = text_of(*source.slices.front(), tag);
  return uid.empty() ? uid_from_headers(source, tag_name(tag)) : uid;
}

/// All choices of a form in one line, to be hashed.
std::string line_of(const DicomForm& form) {
  std::string text = uid_of(form.encoding);
  if (form.keep_frame_of_reference) text += " frame of reference kept";
  if (form.series_number) text += " number " + std::to_string(*form.series_number);
  if (form.series_description) text += " description " + *form.series_description;
  if (form.deidentification) {
    text += " deidentified";
    for (const ConfidentialityOption option : form.deidentification->options) text.append(" ").append(name_of(option));
  }
  return text;
}

std::string series_uid(const DicomHeaders& source, const DicomDerivation& derivation, const DerivedSeries& series) {
  Sha256 hash;
  hash.add("tetwarp derived series").add(uid_or_made_up(source, DCM_SeriesInstanceUID));
  // A part of a series is another source than the whole.
  for (const std::string& uid : series.sop_instance) hash.add(uid);
  const bool named = std::none_of(series.sop_instance.begin(), series.sop_instance.end(),
                                  [](const std::string& uid) { return uid.empty(); });
  if (!named) hash.add(uid_from_headers(source, "instances"));
  hash.add(derivation.field_sha256).add(derivation.parameters).add(version()).add(commit());
  // A field of zeros has the same digest, but gives another frame of reference.
  if (!derivation.deformed) hash.add("resampled");
  if (derivation.form != DicomForm()) hash.add(line_of(derivation.form));
  return uid_of(hash);
}

/// Frame of Reference UID of the derived series.
/// @param frame  Frame of Reference UID of the source
std::string frame_uid(const std::string& frame, const DicomDerivation& derivation) {
  if (!derivation.deformed || derivation.form.keep_frame_of_reference) return frame;
  return uid_of(Sha256().add("tetwarp deformed frame of reference").add(frame).add(derivation.field_sha256));
}

/// A Series Description that the user chose, in the character set of the source.
std::string chosen_description(const std::string& text, const std::string& character_set) {
  const std::string cannot = "the series description \"" + shown(text) + "\" ";
  require(length_of(text) <= kLongestDescription,
          cannot + "has " + std::to_string(length_of(text)) + " characters; DICOM takes at most 64");
  const bool plain = std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == '\\'; });
  require(plain, cannot + "holds a backslash or a control character; leave them out");
  const std::optional<std::string> coded = coded_text(text, character_set);
  require(coded.has_value(), cannot + "cannot be written in the character set of the series, " +
                                 (character_set.empty() ? "ASCII" : shown(character_set)) + "; use other characters");
  return *coded;
}

/// Instance Numbers of the output: the source's, where each occurs once and is fit for a file name, else 1 to n.
/// @param slices  how many the output has; if the source has another number of slices, they are numbered from 1
std::vector<int> instance_numbers(const std::vector<DicomFileHeader>& headers, std::size_t slices) {
  std::vector<int> numbers;
  for (const DicomFileHeader& header : headers) numbers.push_back(header.instance_number);
  std::vector<int> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  const bool distinct = std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  if (distinct && sorted.front() >= 0 && numbers.size() == slices) return numbers;
  numbers.resize(slices);
  std::iota(numbers.begin(), numbers.end(), 1);
  return numbers;
}

/// The source slice whose header each output slice takes over: its own, or the nearest along the stack.
std::vector<std::size_t> header_slices(const std::vector<DicomFileHeader>& headers, const Geometry& geometry) {
  std::vector<std::size_t> nearest(static_cast<std::size_t>(geometry.size.z));
  std::iota(nearest.begin(), nearest.end(), std::size_t{0});
  if (headers.size() == nearest.size()) return nearest;
  const AffineMap index = index_from_point(geometry);
  std::vector<double> places;  // where the source's slices lie, as slice index of the output
  for (const DicomFileHeader& header : headers) places.push_back(index(header.position.value_or(glm::dvec3(0))).z);
  for (std::size_t& slice : nearest) {
    const auto at = static_cast<double>(slice);
    const auto closer = [at](double a, double b) { return std::abs(a - at) < std::abs(b - at); };
    slice = static_cast<std::size_t>(std::min_element(places.begin(), places.end(), closer) - places.begin());
  }
  return nearest;
}

std::optional<PaddingRange> common_padding(const std::vector<DicomFileHeader>& headers) {
  const std::optional<PaddingRange> first = padding_hu(headers.front().pixels);
  for (const DicomFileHeader& header : headers) {
    const std::optional<PaddingRange> other = padding_hu(header.pixels);
    if (!first || !other || first->low != other->low || first->high != other->high) return {};
  }
  return first;
}

/// Whether a slice is a frame of the same file as the one before it.
bool continues_file(const DerivedSeries& series, std::size_t slice) {
  return series.frame[slice] > 0 && series.frame[slice - 1] > 0 &&
         series.sop_instance[slice] == series.sop_instance[slice - 1];
}

/// Puts Source Image Sequence, with an item for each file; images without a usable UID cannot be named and are left
/// out.
void put_references(DcmItem& target, const DerivedSeries& series, const SliceRange& sampled, bool deformed) {
  std::string frames;
  for (std::int64_t k = sampled.first; k <= sampled.last; ++k) {
    const std::size_t slice = static_cast<std::size_t>(k);
    if (!is_uid(series.sop_instance.at(slice))) continue;
    if (k > sampled.first && continues_file(series, slice)) {
      DcmItem* image = nullptr;
      target.findAndGetSequenceItem(DCM_SourceImageSequence, image, -1);
      frames += "\\" + std::to_string(series.frame[slice]);
      put(*image, DCM_ReferencedFrameNumber, frames);
      continue;
    }
    DcmItem& image = append_item(target, DCM_SourceImageSequence);
    const std::string& sop_class = series.sop_class.at(slice);
    put(image, DCM_ReferencedSOPClassUID, is_uid(sop_class) ? sop_class : UID_CTImageStorage);
    put(image, DCM_ReferencedSOPInstanceUID, series.sop_instance[slice]);
    frames = std::to_string(series.frame[slice]);
    if (series.frame[slice] > 0) put(image, DCM_ReferencedFrameNumber, frames);
    append_code(image, DCM_PurposeOfReferenceCodeSequence, "121322", "Source image for image processing operation");
    put(image, DCM_SpatialLocationsPreserved, deformed ? "NO" : "YES");
  }
}

/// Puts attributes of General Image (PS3.3 C.7.6.1) and Contributing Equipment: what was done to which images, and by
/// what.
void put_derivation(DcmItem& target, DcmDataset& source, const DerivedSeries& series, const DicomDerivation& derivation,
                    const SliceRange& sampled) {
  put(target, DCM_ImageType, derived_image_type(source));
  put_how_derived(target, derivation);
  put_references(target, series, sampled, derivation.deformed);
}

/// Puts Slice Location (position along the normal) and the distance of slices, each only where the source has it.
void put_slice_place(DcmItem& target, DcmDataset& source, const Geometry& geometry, std::size_t k) {
  if (source.tagExists(DCM_SpacingBetweenSlices)) {
    put_decimals(target, DCM_SpacingBetweenSlices, std::vector{geometry.spacing.z}, 1e-6);
  }
  if (source.tagExists(DCM_SliceLocation)) {
    const glm::dvec3 position = point_from_index(geometry)(glm::dvec3(0, 0, static_cast<double>(k)));
    put_decimals(target, DCM_SliceLocation,
                 std::vector{glm::dot(position, glm::cross(geometry.direction[0], geometry.direction[1]))}, 0);
  }
}

void deidentify(DerivedSeries& series, DcmDataset& source, const Deidentification& how) {
  const Deidentifier deidentifier(how, text_of(source, DCM_PatientID), text_of(source, DCM_StudyInstanceUID));
  for (std::string* uid : {&series.study_uid, &series.series_uid, &series.frame_of_reference_uid,
                           &series.source_series_uid, &series.source_frame_of_reference_uid})
    *uid = deidentifier.uid(*uid);
  for (std::string& uid : series.sop_instance) {
    if (is_uid(uid)) uid = deidentifier.uid(uid);
  }
  series.deidentifier = deidentifier;
}

void put_padding(DcmItem& target, const PaddingRange& padding) {
  put(target, DCM_PixelPaddingValue, static_cast<std::int16_t>(padding.low));
  if (padding.high != padding.low) put(target, DCM_PixelPaddingRangeLimit, static_cast<std::int16_t>(padding.high));
}

}  // namespace

std::string derived_image_type(DcmDataset& source) {
  std::string type = "DERIVED\\SECONDARY\\AXIAL";
  OFString value;
  for (unsigned long i = 3; source.findAndGetOFString(DCM_ImageType, value, i).good(); ++i) {
    type += '\\';
    type += value.c_str();
  }
  return type;
}

bool is_uid(const std::string& text) {
  return !text.empty() && DcmUniqueIdentifier::checkStringValue(text.c_str(), "1").good();
}

std::string derived_number(DcmItem& source) {
  Sint32 number = 0;
  source.findAndGetSint32(DCM_SeriesNumber, number);
  return std::to_string(number > INT32_MAX - 1000 ? number : number + 1000);
}

std::string derived_description(DcmItem& source, const DicomDerivation& derivation) {
  const std::string mine = derivation.deformed ? "deformed" : "resampled", own = text_of(source, DCM_SeriesDescription);
  if (own.empty() || derivation.form.deidentification) return mine;
  const std::string text = mine + ": " + own;
  if (text.size() <= kLongestDescription) return text;
  const std::string set = text_of(source, DCM_SpecificCharacterSet);
  const bool ascii = std::all_of(own.begin(), own.end(), [](char c) { return c >= ' ' && c <= '~'; });
  const bool one_byte = set.starts_with("ISO_IR 1") && set != "ISO_IR 192" && set.find('\\') == std::string::npos;
  if (!ascii && !one_byte) return mine;
  return text.substr(0, kLongestDescription);
}

void put_equipment(DcmItem& target, const std::string& purpose, const std::string& meaning,
                   const DicomDerivation& derivation) {
  DcmItem& equipment = append_item(target, DCM_ContributingEquipmentSequence);
  append_code(equipment, DCM_PurposeOfReferenceCodeSequence, purpose, meaning);
  put_tetwarp(equipment, "tetwarp");
  put(equipment, DCM_ContributionDescription,
      ascii("field sha256 " + derivation.field_sha256 + "; " + derivation.parameters, 1024));
}

void put_how_derived(DcmItem& target, const DicomDerivation& derivation) {
  put(target, DCM_DerivationDescription, ascii(derivation.description, 1024));
  append_code(target, DCM_DerivationCodeSequence, "113085", "Spatial resampling");
  put_equipment(target, "109103", "Modifying Equipment", derivation);
}

DerivedSeries derive_series(const DicomHeaders& source, const Geometry& geometry, const DicomDerivation& derivation) {
  require(!source.slices.empty(), "the source series has no slices; a derived series needs their headers");
  std::vector<DicomFileHeader> headers;
  std::vector<DcmDataset*> slices;
  for (const auto& slice : source.slices) {
    headers.push_back(header_of(*slice));
    slices.push_back(slice.get());
  }
  DerivedSeries series;
  for (const DicomFileHeader& header : headers) {
    series.sop_class.push_back(header.sop_class_uid);
    series.sop_instance.push_back(header.sop_instance_uid);
  }
  series.frame = source.frames;
  series.frame.resize(headers.size());
  series.study_uid = uid_or_made_up(source, DCM_StudyInstanceUID);
  series.series_uid = series_uid(source, derivation, series);
  series.source_series_uid = text_of(*slices.front(), DCM_SeriesInstanceUID);
  series.source_frame_of_reference_uid = uid_or_made_up(source, DCM_FrameOfReferenceUID);
  series.frame_of_reference_uid = frame_uid(series.source_frame_of_reference_uid, derivation);
  const DicomForm& form = derivation.form;
  series.number = form.series_number ? std::to_string(*form.series_number) : derived_number(*slices.front());
  series.description = form.series_description ? chosen_description(*form.series_description,
                                                                    text_of(*slices.front(), DCM_SpecificCharacterSet))
                                               : derived_description(*slices.front(), derivation);
  series.instance_number = instance_numbers(headers, static_cast<std::size_t>(geometry.size.z));
  series.header = header_slices(headers, geometry);
  series.varying = varying_acquisition(slices, std::ssize(slices) == geometry.size.z);
  series.padding = common_padding(headers);
  if (derivation.form.deidentification) deidentify(series, *slices.front(), *derivation.form.deidentification);
  return series;
}

std::vector<DcmTagKey> derive_slice(DcmItem& target, DcmDataset& source, const DerivedSeries& series,
                                    const DicomDerivation& derivation, const SliceRange& sampled,
                                    const Geometry& geometry, std::size_t k) {
  carry_over(target, source, series.varying);
  if (series.deidentifier) series.deidentifier->apply(target, true);
  put(target, DCM_SOPClassUID, UID_CTImageStorage);
  put(target, DCM_Modality, "CT");
  put(target, DCM_StudyInstanceUID, series.study_uid);
  put(target, DCM_SeriesInstanceUID, series.series_uid);
  put(target, DCM_SeriesNumber, series.number);
  put(target, DCM_SeriesDescription, series.description);
  put(target, DCM_FrameOfReferenceUID, series.frame_of_reference_uid);
  put(target, DCM_InstanceNumber, std::to_string(series.instance_number.at(k)));
  put_derivation(target, source, series, derivation, sampled);
  put_image_plane(target, geometry, static_cast<std::int64_t>(k));
  put_slice_place(target, source, geometry, k);
  if (series.padding) put_padding(target, *series.padding);
  std::vector<DcmTagKey> added;
  for (const DcmTagKey& tag : type_2_attributes()) {
    if (target.tagExists(tag)) continue;
    put(target, tag, "");
    added.push_back(tag);
  }
  return added;
}

}  // namespace tetwarp
