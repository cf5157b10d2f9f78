// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deform/volume.h"
#include "io/dicom_along.h"

namespace tetwarp {

/// A Segmentation object (PS3.3 A.51): masks on one grid, one file.
struct DicomSegmentation {
  struct Segment {
    int number = 0;  ///< Segment Number (0062,0004)
    std::string label;
  };
  struct Frame {
    std::size_t segment = 0;  ///< index into `segments`
    std::int64_t slice = 0;   ///< of `geometry`
  };
  Geometry geometry;  ///< of all frames, with an empty slice before and behind them: a frame that is missing is empty
  bool fractional = false;
  int largest = 1;  ///< what stands for "all of it": Maximum Fractional Value (0062,000E); of a binary one 1
  std::vector<Segment> segments;
  std::vector<Frame> frames;  ///< as they lie in Pixel Data
  std::string frame_of_reference_uid;
};

/// Whether a file is a DICOM Segmentation object; false for what cannot be read.
bool is_dicom_segmentation(const std::filesystem::path& path);

/// Reads all but the pixels. Slices are as far apart as Spacing Between Slices (0018,0088) says; where it is missing,
/// `otherwise_mm` apart, if the frames lie on such a grid, else as the closest frames are.
/// @throws InputError for bits that do not go with the Segmentation Type, frames that are not on one even grid or are
/// there twice, or segments that are not described
DicomSegmentation read_segmentation_header(const std::filesystem::path& path, double otherwise_mm = 0);

/// One uint8 volume a segment: 0 and 1, or 0 to `largest`. Segments may overlap.
/// @throws InputError as `read_segmentation_header`, and for compressed Pixel Data, or ones of another size than the
/// header says
std::vector<AnyVolume> read_segments(const std::filesystem::path& path, const DicomSegmentation& header);

/// What was written of a segmentation.
struct SegmentationReport : AlongReport {
  std::vector<std::uint64_t> frames;  ///< of each segment
  bool empty = false;                 ///< nothing is left: the one frame shows nothing of the first segment
};

/// Writes segments that went through a field as a Segmentation object of the source's type and segments
/// (docs/reference/dicom.md says what it takes over). Frames without a voxel are left out. On the grid of the series,
/// each frame names the slice on which it lies.
/// @param segments  uint8, in the order of the source's segments, all on one straight grid
/// @throws InputError for another patient's segmentation, Error when the file cannot be written
SegmentationReport write_derived_segmentation(const std::filesystem::path& path,
                                              const std::vector<ConstVolumeView>& segments,
                                              const DicomSegmentation& header, const DicomAlong& along,
                                              const WrittenSeries& series);

}  // namespace tetwarp
