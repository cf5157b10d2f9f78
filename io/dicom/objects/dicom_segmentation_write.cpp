// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrat.h>

#include <algorithm>
#include <map>

#include "io/dicom/derive/dicom_carry.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_segmentation.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

std::span<const std::uint8_t> slice_of_segment(const ConstVolumeView& segment, std::int64_t slice) {
  const auto plane = static_cast<std::size_t>(segment.geometry->size.x * segment.geometry->size.y);
  return {reinterpret_cast<const std::uint8_t*>(segment.voxels) + static_cast<std::size_t>(slice) * plane, plane};
}

/// Slices of segments that show something, segment by segment; at least one.
std::vector<DicomSegmentation::Frame> frames_to_write(const std::vector<ConstVolumeView>& segments) {
  std::vector<DicomSegmentation::Frame> frames;
  for (std::size_t n = 0; n < segments.size(); ++n) {
    for (std::int64_t k = 0; k < segments[n].geometry->size.z; ++k) {
      if (std::ranges::any_of(slice_of_segment(segments[n], k), [](std::uint8_t value) { return value != 0; }))
        frames.push_back({n, k});
    }
  }
  if (frames.empty()) frames.push_back({0, 0});
  return frames;
}

/// Pixel Data: bytes, or bits that follow one another through all frames, the lowest first (PS3.5 8.1.1).
std::vector<std::byte> packed(const std::vector<ConstVolumeView>& segments,
                              const std::vector<DicomSegmentation::Frame>& frames, const DicomSegmentation& header) {
  std::vector<std::byte> bytes;
  std::size_t bit = 0;
  for (const auto& [segment, slice] : frames) {
    for (const std::uint8_t value : slice_of_segment(segments[segment], slice)) {
      if (header.fractional) {
        bytes.push_back(static_cast<std::byte>(std::min<int>(value, header.largest)));
        continue;
      }
      if (bit % 8 == 0) bytes.push_back(std::byte{0});
      if (value != 0) bytes.back() |= std::byte{1} << bit % 8;
      ++bit;
    }
  }
  return bytes;
}

bool overlap(const std::vector<ConstVolumeView>& segments) {
  const std::int64_t voxels = voxel_count(*segments.front().geometry);
  for (std::int64_t n = 0; n < voxels; ++n) {
    int here = 0;
    for (const ConstVolumeView& segment : segments) here += segment.voxels[n] != std::byte{0};
    if (here > 1) return true;
  }
  return false;
}

void put_tag(DcmItem& item, const DcmTagKey& tag, const DcmTagKey& value) {
  if (item.putAndInsertTagKey(tag, value).bad()) throw Error("cannot set attribute " + tag_name(tag));
}

/// Multi-frame Dimension (PS3.3 C.7.6.17): by segment, then by place.
void put_dimensions(DcmItem& target) {
  const std::string uid =
      uid_from_digest(Sha256().add("tetwarp dimensions").add(text_of(target, DCM_SeriesInstanceUID)).digest());
  for (const DcmTagKey& tag : {DCM_DimensionOrganizationSequence, DCM_DimensionIndexSequence}) drop(target, tag);
  drop(target, DCM_DimensionOrganizationType);
  put(append_item(target, DCM_DimensionOrganizationSequence), DCM_DimensionOrganizationUID, uid);
  const auto append = [&](const DcmTagKey& pointer, const DcmTagKey& group, const char* label) {
    DcmItem& index = append_item(target, DCM_DimensionIndexSequence);
    put(index, DCM_DimensionOrganizationUID, uid);
    put_tag(index, DCM_DimensionIndexPointer, pointer);
    put_tag(index, DCM_FunctionalGroupPointer, group);
    put(index, DCM_DimensionDescriptionLabel, label);
  };
  append(DCM_ReferencedSegmentNumber, DCM_SegmentIdentificationSequence, "Segment");
  append(DCM_ImagePositionPatient, DCM_PlanePositionSequence, "Position");
}

void put_shared_groups(DcmItem& target, const Geometry& grid) {
  DcmItem& shared = append_item(target, DCM_SharedFunctionalGroupsSequence);
  DcmItem& measures = append_item(shared, DCM_PixelMeasuresSequence);
  put_pixel_spacing(measures, grid);
  put_decimals(measures, DCM_SliceThickness, std::vector{grid.spacing.z}, 0);
  put_decimals(measures, DCM_SpacingBetweenSlices, std::vector{grid.spacing.z}, 0);
  put_orientation(append_item(shared, DCM_PlaneOrientationSequence), grid);
}

bool lies_on_slices(const Geometry& grid, const WrittenSeries& series) {
  return same_grid(grid, series.geometry, 1e-4);
}

/// Derivation Image (PS3.3 C.7.6.16.2.6): the slice on which a frame lies.
void put_slice(DcmItem& groups, const WrittenSeries& series, std::int64_t slice) {
  DcmItem& derivation = append_item(groups, DCM_DerivationImageSequence);
  append_code(derivation, DCM_DerivationCodeSequence, "113076", "Segmentation");
  DcmItem& image = append_slice_reference(derivation, DCM_SourceImageSequence, series, static_cast<std::size_t>(slice));
  append_code(image, DCM_PurposeOfReferenceCodeSequence, "121322", "Source image for image processing operation");
  put(image, DCM_SpatialLocationsPreserved, "YES");
}

/// Functional groups of each frame, and Number of Frames.
void put_frames(DcmItem& target, const std::vector<DicomSegmentation::Frame>& frames, const DicomSegmentation& header,
                const Geometry& grid, const WrittenSeries& series) {
  const bool on_slices = lies_on_slices(grid, series);
  std::map<std::int64_t, Uint32> place;  // of the slices that are shown, from 1
  for (const auto& frame : frames) place[frame.slice] = 0;
  for (Uint32 count = 0; auto& [slice, number] : place) number = ++count;
  for (const auto& [segment, slice] : frames) {
    DcmItem& groups = append_item(target, DCM_PerFrameFunctionalGroupsSequence);
    const Uint32 index[2] = {static_cast<Uint32>(segment + 1), place[slice]};
    DcmItem& content = append_item(groups, DCM_FrameContentSequence);
    if (content.putAndInsertUint32Array(DCM_DimensionIndexValues, index, 2).bad())
      throw Error("cannot set attribute " + tag_name(DCM_DimensionIndexValues));
    put_position(append_item(groups, DCM_PlanePositionSequence), grid, slice);
    put(append_item(groups, DCM_SegmentIdentificationSequence), DCM_ReferencedSegmentNumber,
        static_cast<std::uint16_t>(header.segments[segment].number));
    if (on_slices) put_slice(groups, series, slice);
  }
  put(target, DCM_NumberOfFrames, std::to_string(frames.size()));
}

/// Common Instance Reference (PS3.3 C.12.2): the derived series, which is of the same study. It lists what is referred
/// to elsewhere: by frames, or where these lie on no slices, by Referenced Image Sequence.
void put_series_reference(DcmItem& target, const Geometry& grid, const WrittenSeries& series) {
  for (std::size_t k = 0; k < series.report.sop_instance_uids.size() && !lies_on_slices(grid, series); ++k)
    append_slice_reference(target, DCM_ReferencedImageSequence, series, k);
  DcmItem& reference = append_item(target, DCM_ReferencedSeriesSequence);
  put(reference, DCM_SeriesInstanceUID, series.report.series_uid);
  for (std::size_t k = 0; k < series.report.sop_instance_uids.size(); ++k)
    append_slice_reference(reference, DCM_ReferencedInstanceSequence, series, k);
}

/// Leaves the background of a label map out of Segment Sequence (0062,0002), where a segmentation has none.
void drop_background(DcmItem& target) {
  DcmSequenceOfItems* segments = nullptr;
  if (target.findAndGetSequence(DCM_SegmentSequence, segments).bad()) return;
  for (unsigned long n = segments->card(); n-- > 0;) {
    Uint16 number = 0;
    DcmItem* segment = segments->getItem(n);
    if (segment->findAndGetUint16(DCM_SegmentNumber, number).good() && number == 0) delete segments->remove(segment);
  }
}

/// Segmentation Image (PS3.3 C.8.20.2) and Content Identification (10.9): as in the source; a label map becomes BINARY.
void put_segmentation(DcmItem& target, DcmDataset& source, const DicomSegmentation& header) {
  for (const DcmTagKey& tag :
       {DCM_SegmentationType, DCM_SegmentSequence, DCM_SegmentationFractionalType, DCM_MaximumFractionalValue,
        DCM_ContentLabel, DCM_ContentDescription, DCM_AlternateContentDescriptionSequence, DCM_ContentCreatorName,
        DCM_ContentCreatorIdentificationCodeSequence})
    carry_attribute(target, source, tag);
  if (header.label_map) {
    put(target, DCM_SegmentationType, "BINARY");
    drop_background(target);
  }
  if (text_of(target, DCM_LossyImageCompression).empty()) put(target, DCM_LossyImageCompression, "00");
}

const std::vector<DcmTagKey>& type_2_of_segmentation() {
  static const std::vector<DcmTagKey> tags = {
      DCM_StudyDate,   DCM_StudyTime,          DCM_AccessionNumber,    DCM_ReferringPhysicianName,
      DCM_PatientName, DCM_PatientID,          DCM_PatientBirthDate,   DCM_PatientSex,
      DCM_StudyID,     DCM_ContentDescription, DCM_ContentCreatorName, DCM_PositionReferenceIndicator};
  return tags;
}

}  // namespace

SegmentationReport write_derived_segmentation(const std::filesystem::path& path,
                                              const std::vector<ConstVolumeView>& segments,
                                              const DicomSegmentation& header, const DicomAlong& along,
                                              const WrittenSeries& series) {
  require(!segments.empty() && segments.size() == header.segments.size(),
          "a segmentation of " + std::to_string(header.segments.size()) + " segments, and " +
              std::to_string(segments.size()) + " volumes; give one a segment");
  for (const ConstVolumeView& segment : segments)
    require(segment.voxels && segment.type == VoxelType::u8 && segment.components == 1 &&
                segment.buffered == whole(*segment.geometry) && !is_sheared(*segment.geometry) &&
                *segment.geometry == *segments.front().geometry,
            "a DICOM segmentation needs whole straight volumes of uint8, all on one grid; convert them");
  prepare_dcmtk();
  const Geometry& grid = *segments.front().geometry;
  DcmFileFormat format;
  DcmDataset& source = read_source(format, along);
  const std::vector<DicomSegmentation::Frame> frames = frames_to_write(segments);
  const std::vector<std::byte> pixels = packed(segments, frames, header);

  DcmDataset target;
  put_segmentation(target, source, header);
  put_along(target, source, along, series, type_2_of_segmentation());
  put(target, DCM_SOPClassUID, UID_SegmentationStorage);
  put(target, DCM_Modality, "SEG");
  put(target, DCM_ImageType, "DERIVED\\PRIMARY");
  if (!header.fractional) put(target, DCM_SegmentsOverlap, overlap(segments) ? "YES" : "NO");
  put_series_reference(target, grid, series);
  put_dimensions(target);
  put_shared_groups(target, grid);
  put_frames(target, frames, header, grid, series);
  put_pixel_format(target, grid, header.fractional ? 8 : 1, false);
  SegmentationReport report;
  report.sop_instance_uid = write_dicom_file(path, target, pixels, DicomWords::bytes);
  report.series_uid = text_of(target, DCM_SeriesInstanceUID);
  report.frames.resize(segments.size());
  for (const auto& frame : frames) ++report.frames[frame.segment];
  report.empty = std::ranges::all_of(pixels, [](std::byte value) { return value == std::byte{0}; });
  if (report.empty) report.frames.front() = 0;
  return report;
}

}  // namespace tetwarp
