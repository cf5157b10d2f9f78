// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/objects/dicom_registration.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrfd.h>
#include <dcmtk/dcmdata/dcvrul.h>

#include <algorithm>
#include <bit>
#include <fstream>

#include "deform/errors.h"
#include "deform/version.h"
#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"
#include "io/images/image_writer.h"

namespace tetwarp {

namespace {

constexpr std::uint64_t kVectorBytes = 12, kLargestValue = 0xfffffffe;
constexpr char kIdentity[] = "1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1";

using ByteBuffer = std::vector<std::byte>;

/// An image, or frames of it.
struct ReferencedImage {
  std::string sop_class, sop_instance, frames;
};

/// The files of the source, each once, in the order of its first slice; those without a usable UID cannot be named.
std::vector<ReferencedImage> source_images(const DerivedSeries& series) {
  std::vector<ReferencedImage> images;
  for (std::size_t n = 0; n < series.sop_instance.size(); ++n) {
    const std::string& uid = series.sop_instance[n];
    if (!is_uid(uid)) continue;
    auto image = std::find_if(images.begin(), images.end(), [&](const auto& one) { return one.sop_instance == uid; });
    if (image == images.end()) {
      const std::string& sop_class = series.sop_class[n];
      image = images.insert(images.end(), {is_uid(sop_class) ? sop_class : UID_CTImageStorage, uid, ""});
    }
    if (series.frame[n] > 0) image->frames += (image->frames.empty() ? "" : "\\") + std::to_string(series.frame[n]);
  }
  return images;
}

std::vector<ReferencedImage> derived_images(const std::vector<std::string>& instances) {
  std::vector<ReferencedImage> images;
  for (const std::string& uid : instances)
    if (!uid.empty()) images.push_back({UID_CTImageStorage, uid, ""});
  return images;
}

void put_references(DcmItem& item, const DcmTagKey& sequence, const std::vector<ReferencedImage>& images) {
  for (const ReferencedImage& image : images) {
    DcmItem& reference = append_item(item, sequence);
    put(reference, DCM_ReferencedSOPClassUID, image.sop_class);
    put(reference, DCM_ReferencedSOPInstanceUID, image.sop_instance);
    if (!image.frames.empty()) put(reference, DCM_ReferencedFrameNumber, image.frames);
  }
}

/// Common Instance Reference (C.12.2).
void put_series_reference(DcmItem& item, const std::string& series_uid, const std::vector<ReferencedImage>& images) {
  if (images.empty() || !is_uid(series_uid)) return;
  DcmItem& series = append_item(item, DCM_ReferencedSeriesSequence);
  put(series, DCM_SeriesInstanceUID, series_uid);
  put_references(series, DCM_ReferencedInstanceSequence, images);
}

/// Content Date and Time (type 1) without a clock: the first date that the source has. Where all were wiped, one that
/// nobody takes for true.
void put_content_date(DcmItem& item, DcmDataset& source) {
  std::string date = "19000101", time = "000000";
  for (const auto& [of_date, of_time] :
       {std::pair{DCM_ContentDate, DCM_ContentTime}, std::pair{DCM_AcquisitionDate, DCM_AcquisitionTime},
        std::pair{DCM_SeriesDate, DCM_SeriesTime}, std::pair{DCM_StudyDate, DCM_StudyTime}}) {
    if (text_of(source, of_date).empty()) continue;
    date = text_of(source, of_date);
    if (!text_of(source, of_time).empty()) time = text_of(source, of_time);
    break;
  }
  put(item, DCM_ContentDate, date);
  put(item, DCM_ContentTime, time);
}

/// The Series Number of the registration object: 1000 more than that of the derived series, which is 1000 more than the
/// source's.
std::string registration_number(const std::string& derived) {
  const long long number = std::atoll(derived.c_str());
  return std::to_string(number > INT32_MAX - 1000 ? number : number + 1000);
}

/// The attributes of the registration object that stand before the vectors, without SOP Instance UID.
DcmDataset head_of(const Registration& of, const std::vector<ReferencedImage>& derived) {
  DcmDataset head, &source = *of.source.slices.front();
  carry_patient_and_study(head, source);
  put_content_date(head, source);
  if (of.series.deidentifier) of.series.deidentifier->apply(head, false);
  put(head, DCM_SOPClassUID, UID_DeformableSpatialRegistrationStorage);
  put(head, DCM_StudyInstanceUID, of.series.study_uid);
  put(head, DCM_Modality, "REG");
  put(head, DCM_SeriesInstanceUID,
      uid_from_digest(Sha256().add("tetwarp registration series").add(of.series.series_uid).digest()));
  put(head, DCM_SeriesNumber, registration_number(of.series.number));
  const std::string number = text_of(source, DCM_SeriesNumber);
  put(head, DCM_SeriesDescription, "Deformation field" + (number.empty() ? "" : " of series " + number));
  put(head, DCM_Laterality, "");  // type 2C: required unless a body part that is no pair is named
  put(head, DCM_FrameOfReferenceUID, of.series.frame_of_reference_uid);
  put(head, DCM_InstanceNumber, "1");
  put_tetwarp(head, "tetwarp");
  put(head, DCM_DeviceSerialNumber, commit());  // type 1 (C.7.5.2)
  put_series_reference(head, of.series.source_series_uid, source_images(of.series));
  put_series_reference(head, of.series.series_uid, derived);
  put_equipment(head, "109102", "Processing Equipment", of.derivation);
  return head;
}

void put_identity(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem& matrix = append_item(item, sequence);
  put(matrix, DCM_FrameOfReferenceTransformationMatrix, kIdentity);
  put(matrix, DCM_FrameOfReferenceTransformationMatrixType, "RIGID");
}

/// The registration item of the derived series, whose points stay where they are.
DcmDataset registered_item(const Registration& of, const std::vector<ReferencedImage>& derived) {
  DcmDataset item;
  put_references(item, DCM_ReferencedImageSequence, derived);
  put(item, DCM_SourceFrameOfReferenceUID, of.series.frame_of_reference_uid);
  put_identity(item, DCM_PreDeformationMatrixRegistrationSequence);
  put_identity(item, DCM_PostDeformationMatrixRegistrationSequence);
  append_code(item, DCM_RegistrationTypeCodeSequence, "125021", "Frame of Reference Identity");
  return item;
}

/// The registration item of the source: the attributes that stand before the grid of vectors, and behind it.
DcmDataset source_item(const Registration& of) {
  DcmDataset item;
  put_references(item, DCM_ReferencedImageSequence, source_images(of.series));
  put(item, DCM_SourceFrameOfReferenceUID, of.series.source_frame_of_reference_uid);
  return item;
}
DcmDataset source_item_end() {
  DcmDataset item;
  put_identity(item, DCM_PreDeformationMatrixRegistrationSequence);
  put_identity(item, DCM_PostDeformationMatrixRegistrationSequence);
  put_empty_sequence(item, DCM_RegistrationTypeCodeSequence);  // type 2: how the field was found is not known here
  return item;
}

template <class Element, class Value>
void insert(DcmItem& item, const DcmTagKey& tag, OFCondition (Element::*set)(const Value*, unsigned long),
            const std::vector<Value>& values) {
  auto element = std::make_unique<Element>(DcmTag(tag));
  OFCondition result = (element.get()->*set)(values.data(), static_cast<unsigned long>(values.size()));
  if (result.good()) result = item.insert(element.get(), OFTrue);
  if (result.bad()) throw Error("cannot set attribute " + tag_name(tag) + ": " + result.text());
  element.release();
}

/// The grid but its vectors (C.20.3.1.1): voxel centres of the derived series.
DcmDataset grid_item(const Geometry& grid) {
  DcmDataset item;
  const glm::dvec3 row = grid.direction[0], column = grid.direction[1];
  put_decimals(item, DCM_ImagePositionPatient, std::vector{grid.origin.x, grid.origin.y, grid.origin.z}, 0);
  put_decimals(item, DCM_ImageOrientationPatient, std::vector{row.x, row.y, row.z, column.x, column.y, column.z}, 0);
  insert(item, DCM_GridDimensions, &DcmUnsignedLong::putUint32Array,
         std::vector{static_cast<Uint32>(grid.size.x), static_cast<Uint32>(grid.size.y),
                     static_cast<Uint32>(grid.size.z)});
  insert(item, DCM_GridResolution, &DcmFloatingPointDouble::putFloat64Array,
         std::vector<Float64>{grid.spacing.x, grid.spacing.y, grid.spacing.z});
  return item;
}

/// Content Identification Macro (table 10-12) but Instance Number.
DcmDataset tail_of(const DicomDerivation& derivation) {
  DcmDataset tail;
  put(tail, DCM_ContentLabel, "DEFORMATION");
  put(tail, DCM_ContentDescription, ascii(derivation.description, 64));
  put(tail, DCM_ContentCreatorName, "");
  return tail;
}

// --- bytes: sequences that hold the vectors have no length, so that they can be written around them (PS3.5 7.5.2)

constexpr unsigned kItem = 0xe000, kItemEnd = 0xe00d, kSequenceEnd = 0xe0dd;
constexpr std::uint64_t kUndefined = 0xffffffff;

void append(ByteBuffer& bytes, const ByteBuffer& more) { bytes.insert(bytes.end(), more.begin(), more.end()); }
void append(ByteBuffer& bytes, DcmDataset item) { append(bytes, encoded(item)); }

/// Tag, value representation and a length of 32 bits (PS3.5 7.1.2).
void append_start(ByteBuffer& bytes, const DcmTagKey& tag, const char* representation, std::uint64_t length) {
  append_number(bytes, tag.getGroup(), 2);
  append_number(bytes, tag.getElement(), 2);
  for (const char c : {representation[0], representation[1], '\0', '\0'}) bytes.push_back(static_cast<std::byte>(c));
  append_number(bytes, length, 4);
}

void open_item(ByteBuffer& bytes, const DcmTagKey& sequence) {
  append_start(bytes, sequence, "SQ", kUndefined);
  append_item_start(bytes, kItem, kUndefined);
}

void close_item_and_sequence(ByteBuffer& bytes) {
  append_item_start(bytes, kItemEnd, 0);
  append_item_start(bytes, kSequenceEnd, 0);
}

/// The sequence from its start to the first vector. @param derived  none: the item of the derived series is left out
ByteBuffer registration_start(const Registration& of, const std::vector<ReferencedImage>& derived,
                              const Geometry& grid) {
  ByteBuffer bytes;
  append_start(bytes, DCM_DeformableRegistrationSequence, "SQ", kUndefined);
  if (!derived.empty()) {
    append_item_start(bytes, kItem, kUndefined);
    append(bytes, registered_item(of, derived));
    append_item_start(bytes, kItemEnd, 0);
  }
  append_item_start(bytes, kItem, kUndefined);
  append(bytes, source_item(of));
  open_item(bytes, DCM_DeformableRegistrationGridSequence);
  append(bytes, grid_item(grid));
  append_start(bytes, DCM_VectorGridData, "OF", kVectorBytes * static_cast<std::uint64_t>(voxel_count(grid)));
  return bytes;
}

ByteBuffer registration_end(const DicomDerivation& derivation) {
  ByteBuffer bytes;
  close_item_and_sequence(bytes);
  append(bytes, source_item_end());
  close_item_and_sequence(bytes);
  append(bytes, tail_of(derivation));
  return bytes;
}

class RegistrationWriter final : public ImageWriter {
 public:
  RegistrationWriter(const std::filesystem::path& path, const Geometry& grid, Registration registration)
      : ImageWriter(path, grid, VoxelType::f32, 3),
        registration_(std::move(registration)),
        out_(path, std::ios::binary | std::ios::trunc),
        vectors_(path, ".vectors") {
    if (!out_) fail();
    hash_.add("tetwarp registration");
  }

 private:
  static_assert(std::endian::native == std::endian::little);

  void append(const ConstVolumeView& slices) override {
    const std::size_t bytes = static_cast<std::size_t>(voxel_count(slices.buffered)) * kVectorBytes;
    hash_.add(std::span(slices.voxels, bytes));
    vectors_.out().write(reinterpret_cast<const char*>(slices.voxels), static_cast<std::streamsize>(bytes));
    if (!vectors_.out()) fail();
  }

  void close() override {
    const std::vector<ReferencedImage> derived = derived_images(registration_.instances());
    const ByteBuffer start = registration_start(registration_, derived, grid_),
                     end = registration_end(registration_.derivation);
    DcmDataset head = head_of(registration_, derived);
    const std::string uid = uid_from_digest(hash_.add(encoded(head)).add(start).add(end).digest());
    put(head, DCM_SOPInstanceUID, uid);
    write(encoded_meta(UID_DeformableSpatialRegistrationStorage, uid, UID_LittleEndianExplicitTransferSyntax));
    write(encoded(head));
    write(start);
    vectors_.copy_to(out_);
    write(end);
    out_.close();
    if (!out_) fail();
  }

  void write(const ByteBuffer& bytes) {
    out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  Registration registration_;
  std::ofstream out_;
  Spool vectors_;
  Sha256 hash_;
};

}  // namespace

void require_registration_fits(const Geometry& grid) {
  const std::uint64_t bytes = kVectorBytes * static_cast<std::uint64_t>(voxel_count(grid));
  require(bytes <= kLargestValue, to_string(grid.size) + " vectors are " + std::to_string(bytes) +
                                      " bytes, a DICOM attribute holds at most " + std::to_string(kLargestValue) +
                                      "; write the inverse as .mha, .nrrd, .nii or .nii.gz");
}

std::unique_ptr<ImageWriter> create_registration(const std::filesystem::path& path, const Geometry& grid,
                                                 Registration registration) {
  require_registration_fits(grid);
  return std::make_unique<RegistrationWriter>(path, grid, std::move(registration));
}

}  // namespace tetwarp
