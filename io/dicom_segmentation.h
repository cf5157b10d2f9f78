// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deform/volume.h"
#include "io/dicom_along.h"

namespace tetwarp {

/// Header of a Segmentation or a Label Map Segmentation object (DICOM PS3.3 A.51): masks on one grid in one file.
struct DicomSegmentation {
  /// One mask.
  struct Segment {
    int number = 0;     ///< Segment Number (0062,0004)
    std::string label;  ///< Segment Label (0062,0005)
  };
  /// One slice of one mask, or of a label map.
  struct Frame {
    std::size_t segment = 0;  ///< index into `segments`; of a label map 0
    std::int64_t slice = 0;   ///< index k in `geometry`
  };
  /// Grid of all frames, with one empty slice before and one after them, and an empty row or column where the volume
  /// reaches beyond them. A frame that is missing is empty.
  Geometry geometry;
  glm::i64vec3 first{0};    ///< first voxel of `geometry` that frames show, or would
  glm::i64vec3 last{0};     ///< the last one
  bool fractional = false;  ///< whether Segmentation Type (0062,0001) is FRACTIONAL
  bool label_map = false;   ///< whether it is LABELMAP: pixels are Segment Numbers, or 0
  /// Value of a voxel that belongs wholly to a segment: Maximum Fractional Value (0062,000E), or 1.
  int largest = 1;
  std::vector<Segment> segments;       ///< in the order of the file; of a label map without number 0, the background
  std::vector<Frame> frames;           ///< in the order of Pixel Data
  std::string frame_of_reference_uid;  ///< Frame of Reference UID (0020,0052)
};

/// Whether a file is a DICOM Segmentation object; false for a file that cannot be read.
bool is_dicom_segmentation(const std::filesystem::path& path);

/// Reads all but the pixels.
/// Slices are as far apart as Spacing Between Slices (0018,0088) says. If it is missing, they are `otherwise_mm` apart
/// where the frames lie on such a grid, else as far as the two closest frames.
/// @param path          file to read
/// @param otherwise_mm  mm; 0: unknown
/// @param volume        grid of the volume that it goes with; null: unknown. Frames that were cropped are empty beyond
///         their border where it goes on.
/// @throws InputError for a number of bits that does not fit Segmentation Type, frames that lie on no even grid or
///         occur twice, or segments that are not described
DicomSegmentation read_segmentation_header(const std::filesystem::path& path, double otherwise_mm = 0,
                                           const Geometry* volume = nullptr);

/// Reads the pixels: one uint8 volume for each segment, with values 0 to `DicomSegmentation::largest`. Segments may
/// overlap.
/// @param path    file to read
/// @param header  from `read_segmentation_header` of this file
/// @throws InputError as `read_segmentation_header`, and for Pixel Data that are damaged or of another size than the
///         header states, or show a segment that is not described
std::vector<AnyVolume> read_segments(const std::filesystem::path& path, const DicomSegmentation& header);

/// What was written of a segmentation.
struct SegmentationReport : AlongReport {
  std::vector<std::uint64_t> frames;  ///< number of frames of each segment
  bool empty = false;  ///< whether no voxel is left, so that one empty frame of the first segment was written
};

/// Writes segments that went through a field as a Segmentation object of the type and segments of the source; those of
/// a label map, which may overlap by then, as BINARY. docs/reference/dicom.md lists what it takes over. Frames without
/// a voxel are left out. On the grid of the series each frame names the slice on which it lies.
/// @param path      file to write
/// @param segments  uint8, in the order of the source's segments, all on one straight and even grid
/// @param header    header of the source
/// @param along     the source, and what was done
/// @param series    the derived series to which the object refers
/// @throws InputError for the segmentation of another patient
/// @throws Error when the file cannot be written
SegmentationReport write_derived_segmentation(const std::filesystem::path& path,
                                              const std::vector<ConstVolumeView>& segments,
                                              const DicomSegmentation& header, const DicomAlong& along,
                                              const WrittenSeries& series);

}  // namespace tetwarp
