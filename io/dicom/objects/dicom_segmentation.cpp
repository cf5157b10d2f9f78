// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_segmentation.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>

#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/pixels/dicom_frame_pixels.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom_text.h"

namespace tetwarp {

namespace {

constexpr std::int64_t kMostSlices = 2500;
constexpr std::size_t kMostFrames = 1'000'000, kMostSegments = 65535;

bool agree(const std::vector<double>& a, const std::vector<double>& b, double tolerance) {
  return std::ranges::equal(a, b, [=](double x, double y) { return std::abs(x - y) <= tolerance; });
}

std::string in_frame(std::size_t frame) { return " in frame " + std::to_string(frame + 1); }

/// Which segment has a number: its index, or how many segments there are where none has it.
class LabelIndex {
 public:
  explicit LabelIndex(const DicomSegmentation& header) : index_(std::size_t{UINT16_MAX} + 1, header.segments.size()) {
    for (std::size_t n = 0; n < header.segments.size(); ++n)
      index_[static_cast<std::size_t>(header.segments[n].number)] = n;
  }
  std::size_t operator[](std::uint16_t number) const { return index_[number]; }

 private:
  std::vector<std::size_t> index_;
};

/// One Segmentation file, parsed.
class SegmentationFile {
 public:
  explicit SegmentationFile(const std::filesystem::path& path) : path_(path) {
    prepare_dcmtk();
    const OFCondition read = parse_dicom(format_, path, DCM_UndefinedTagKey).result;
    if (read.bad()) refuse(std::string("cannot be read as DICOM: ") + read.text());
    const std::string sop_class = text_of(data(), DCM_SOPClassUID);
    if (sop_class != UID_SegmentationStorage && sop_class != kLabelMapStorage) refuse("is no DICOM segmentation");
  }

  DicomSegmentation header(double otherwise_mm, const Geometry* volume);
  std::vector<AnyVolume> segments(const DicomSegmentation& header);

 private:
  DcmDataset& data() { return *format_.getDataset(); }
  [[noreturn]] void refuse(const std::string& what) const { throw InputError(shown(path_) + " " + what); }
  [[noreturn]] void refuse_segment(int number, std::size_t frame) const {
    refuse("shows segment " + std::to_string(number) + in_frame(frame) +
           ", which its Segment Sequence (0062,0002) does not describe");
  }

  int word(const DcmTagKey& tag);
  std::vector<double> numbers(DcmItem* group, const DcmTagKey& tag, std::size_t count);
  std::vector<DcmItem*> items(const DcmTagKey& sequence, std::size_t most);
  DcmItem* group(DcmItem& frame, const DcmTagKey& sequence);
  void read_bits(DicomSegmentation& seg);
  void read_segment_list(DicomSegmentation& seg);
  void read_plane(DicomSegmentation& seg);
  std::size_t segment_of(const DicomSegmentation& seg, std::size_t frame);
  void place_frames(DicomSegmentation& seg, double otherwise_mm);
  static void pad_cropped(DicomSegmentation& seg, const Geometry& volume);
  void require_dense(const DicomSegmentation& seg);
  double slice_distance(const std::vector<double>& places, double otherwise_mm);

  std::filesystem::path path_;
  DcmFileFormat format_;
  DcmItem* shared_ = nullptr;     ///< Shared Functional Groups
  std::vector<DcmItem*> frames_;  ///< Per-Frame Functional Groups
};

int SegmentationFile::word(const DcmTagKey& tag) {
  Uint16 value = 0;
  if (!is_at_most(data(), tag, kLongestValue) || data().findAndGetUint16(tag, value).bad())
    refuse("has no " + tag_name(tag));
  return value;
}

std::vector<double> SegmentationFile::numbers(DcmItem* group, const DcmTagKey& tag, std::size_t count) {
  const auto values = group ? numbers_of(*group, tag, count) : std::nullopt;
  if (!values) refuse("does not say " + tag_name(tag) + " of each frame");
  return *values;
}

std::vector<DcmItem*> SegmentationFile::items(const DcmTagKey& sequence, std::size_t most) {
  DcmSequenceOfItems* found = nullptr;
  if (data().findAndGetSequence(sequence, found).bad() || found->card() == 0) refuse("has no " + tag_name(sequence));
  if (found->card() > most) refuse("has more than " + std::to_string(most) + " items of " + tag_name(sequence));
  std::vector<DcmItem*> list;
  for (DcmObject* item = found->nextInContainer(nullptr); item; item = found->nextInContainer(item))
    list.push_back(dynamic_cast<DcmItem*>(item));
  return list;
}

/// A functional group of a frame, else the shared one; null if there is none (PS3.3 C.7.6.16).
DcmItem* SegmentationFile::group(DcmItem& frame, const DcmTagKey& sequence) {
  DcmItem* found = nullptr;
  if (frame.findAndGetSequenceItem(sequence, found, 0).good()) return found;
  if (shared_ && shared_->findAndGetSequenceItem(sequence, found, 0).good()) return found;
  return nullptr;
}

/// PS3.3 C.8.20.2: one bit a pixel, or eight, or in label maps sixteen.
void SegmentationFile::read_bits(DicomSegmentation& seg) {
  const std::string type = text_of(data(), DCM_SegmentationType);
  seg.label_map = text_of(data(), DCM_SOPClassUID) == kLabelMapStorage;
  if (seg.label_map ? type != "LABELMAP" : type != "BINARY" && type != "FRACTIONAL")
    refuse("has Segmentation Type (0062,0001) " + known_code(type, {"BINARY", "FRACTIONAL", "LABELMAP"}) +
           ", expected " + (seg.label_map ? "LABELMAP" : "BINARY or FRACTIONAL"));
  seg.fractional = type == "FRACTIONAL";
  const int bits = seg.label_map && word(DCM_BitsAllocated) == 16 ? 16 : seg.fractional || seg.label_map ? 8 : 1;
  for (const auto& [tag, expected] : std::initializer_list<std::pair<DcmTagKey, int>>{{DCM_BitsAllocated, bits},
                                                                                      {DCM_BitsStored, bits},
                                                                                      {DCM_HighBit, bits - 1},
                                                                                      {DCM_SamplesPerPixel, 1},
                                                                                      {DCM_PixelRepresentation, 0}}) {
    if (const int found = word(tag); found != expected)
      refuse("has " + tag_name(tag) + " " + std::to_string(found) + ", expected " + std::to_string(expected) +
             " of type " + type);
  }
  if (seg.fractional) seg.largest = word(DCM_MaximumFractionalValue);
  if (seg.largest < 1 || seg.largest > 255)
    refuse("has " + tag_name(DCM_MaximumFractionalValue) + " " + std::to_string(seg.largest) + ", expected 1 to 255");
}

void SegmentationFile::read_segment_list(DicomSegmentation& seg) {
  for (DcmItem* item : items(DCM_SegmentSequence, kMostSegments)) {
    Uint16 number = 0;
    const bool is_stated = item->findAndGetUint16(DCM_SegmentNumber, number).good();
    if (is_stated && number == 0 && seg.label_map) continue;  // the background
    if (!is_stated || number == 0) refuse("has a segment without " + tag_name(DCM_SegmentNumber));
    for (const auto& other : seg.segments) {
      if (other.number == number) refuse("has two segments of number " + std::to_string(number));
    }
    seg.segments.push_back({number, text_of(*item, DCM_SegmentLabel)});
  }
  if (seg.segments.empty()) refuse("has no segment but the background");
}

/// Rows and columns, the same in all frames.
void SegmentationFile::read_plane(DicomSegmentation& seg) {
  constexpr double kCosine = 1e-4, kSpacing = 1e-5;  // as slices of a series are compared
  std::vector<double> cosines, spacing;
  for (std::size_t n = 0; n < frames_.size(); ++n) {
    const auto here = numbers(group(*frames_[n], DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient, 6);
    const auto distances = numbers(group(*frames_[n], DCM_PixelMeasuresSequence), DCM_PixelSpacing, 2);
    if (n == 0) {
      cosines = here;
      spacing = distances;
    }
    if (!agree(here, cosines, kCosine) || !agree(distances, spacing, kSpacing * spacing[0]))
      refuse("has frames that are not parallel or of different Pixel Spacing: frame " + std::to_string(n + 1) +
             " differs from the first");
  }
  if (const std::string problem = rotation_problem(std::span<const double, 6>(cosines)); !problem.empty())
    refuse("has an Image Orientation (0020,0037) that is no rotation: " + problem);
  const glm::dvec3 row(cosines[0], cosines[1], cosines[2]), column(cosines[3], cosines[4], cosines[5]);
  seg.geometry.direction = glm::dmat3(row, column, glm::cross(row, column));
  seg.geometry.spacing = {spacing[1], spacing[0], 1};
  seg.geometry.size = {word(DCM_Columns), word(DCM_Rows), 1};
}

/// @param places  of frames along the normal, rising, each once
double SegmentationFile::slice_distance(const std::vector<double>& places, double otherwise_mm) {
  constexpr double kTolerance = 1e-2;  // of the distance, and 0.01 mm for digits that were not written
  const auto fits = [&](double step) {
    return step > 0 && std::ranges::all_of(places, [&](double place) {
             const double steps = (place - places.front()) / step;
             return std::abs(steps - std::round(steps)) * step <= kTolerance * step + 0.01;
           });
  };
  DcmItem* measures = group(*frames_.front(), DCM_PixelMeasuresSequence);
  if (const auto stated = numbers_of(*measures, DCM_SpacingBetweenSlices, 1)) {
    if (!fits(stated->front()))
      refuse("has frames that are not on an even grid of Spacing Between Slices (0018,0088), " +
             number(stated->front()) + " mm");
    return stated->front();
  }
  if (fits(otherwise_mm)) return otherwise_mm;
  double closest = places.size() > 1 ? places[1] - places[0] : 0;
  for (std::size_t n = 1; n < places.size(); ++n) closest = std::min(closest, places[n] - places[n - 1]);
  if (places.size() == 1) closest = numbers_of(*measures, DCM_SliceThickness, 1).value_or(std::vector{0.0}).front();
  if (!fits(closest)) refuse("has frames at uneven distances; the closest are " + number(closest) + " mm apart");
  return closest;
}

/// Index of the segment that a frame shows.
std::size_t SegmentationFile::segment_of(const DicomSegmentation& seg, std::size_t frame) {
  DcmItem* identification = group(*frames_[frame], DCM_SegmentIdentificationSequence);
  Uint16 number = 0;
  if (!identification || identification->findAndGetUint16(DCM_ReferencedSegmentNumber, number).bad())
    refuse("does not say the segment of frame " + std::to_string(frame + 1));
  const auto segment = std::ranges::find(seg.segments, int{number}, &DicomSegmentation::Segment::number);
  if (segment == seg.segments.end()) refuse_segment(number, frame);
  return static_cast<std::size_t>(segment - seg.segments.begin());
}

void SegmentationFile::place_frames(DicomSegmentation& seg, double otherwise_mm) {
  constexpr double kSamePlace = 1e-3, kOffLine = 0.01;  // mm
  const glm::dvec3 normal = seg.geometry.direction[2];
  std::vector<glm::dvec3> positions;
  std::vector<double> places;
  for (DcmItem* frame : frames_) {
    const auto p = numbers(group(*frame, DCM_PlanePositionSequence), DCM_ImagePositionPatient, 3);
    positions.emplace_back(p[0], p[1], p[2]);
    places.push_back(glm::dot(positions.back(), normal));
  }
  const auto first = static_cast<std::size_t>(std::ranges::min_element(places) - places.begin());
  std::vector<double> sorted = places;
  std::ranges::sort(sorted);
  const auto same = [](double a, double b) { return b - a <= kSamePlace; };
  sorted.erase(std::unique(sorted.begin(), sorted.end(), same), sorted.end());
  const double step = slice_distance(sorted, otherwise_mm);
  const double slices = std::round((sorted.back() - sorted.front()) / step) + 3;
  if (!(slices <= kMostSlices))
    refuse("has frames over " + number(slices) + " slices " + number(step) + " mm apart; at most " +
           std::to_string(kMostSlices) + " are taken");
  seg.geometry.spacing.z = step;
  seg.geometry.size.z = static_cast<std::int64_t>(slices);
  seg.geometry.origin = positions[first] - normal * step;
  require_valid(seg.geometry, ("the grid of " + shown(path_)).c_str());

  std::set<std::pair<std::size_t, std::int64_t>> seen;
  for (std::size_t n = 0; n < frames_.size(); ++n) {
    const double along = places[n] - places[first];
    const glm::dvec3 off = positions[n] - positions[first] - normal * along;
    if (!(glm::length(off) <= kOffLine + 1e-4 * along))
      refuse("has frames that do not lie above one another: frame " + std::to_string(n + 1) + " is " +
             number(glm::length(off)) + " mm off the line of the others");
    const std::size_t segment = seg.label_map ? 0 : segment_of(seg, n);
    seg.frames.push_back({segment, static_cast<std::int64_t>(std::round(along / step)) + 1});
    if (!seen.emplace(seg.frames.back().segment, seg.frames.back().slice).second)
      refuse("shows " + (seg.label_map ? "labels" : "segment " + std::to_string(seg.segments[segment].number)) +
             " twice at one place, the second time in frame " + std::to_string(n + 1));
  }
}

/// Adds an empty row or column at each border of the frames beyond which a volume goes on.
void SegmentationFile::pad_cropped(DicomSegmentation& seg, const Geometry& volume) {
  constexpr double kBorder = 0.5, kRounding = 1e-3;  // of a voxel
  const AffineMap index = index_from_point(seg.geometry), point = point_from_index(volume);
  for (int axis = 0; axis < 2; ++axis) {
    double low = 0, high = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
      const double at = index(point(side * glm::dvec3(volume.size - std::int64_t{1})))[axis];
      low = corner == 0 ? at : std::min(low, at);
      high = corner == 0 ? at : std::max(high, at);
    }
    const std::int64_t before = low < -kBorder - kRounding ? 1 : 0,
                       after = high > static_cast<double>(seg.last[axis]) + kBorder + kRounding ? 1 : 0;
    glm::dvec3 corner(0);
    corner[axis] = static_cast<double>(-before);
    seg.geometry.origin = point_from_index(seg.geometry)(corner);
    seg.geometry.size[axis] += before + after;
    seg.first[axis] += before;
    seg.last[axis] += before;
  }
}

/// A few frames far apart, and segments without any, can stand for far more memory than the file takes.
void SegmentationFile::require_dense(const DicomSegmentation& seg) {
  constexpr double kMost = 10'000;
  const double stored = static_cast<double>(seg.frames.size()) / (seg.fractional || seg.label_map ? 1 : 8),
               held = static_cast<double>(seg.segments.size()) * static_cast<double>(seg.geometry.size.z);
  if (held > kMost * stored)
    refuse("has " + plural(seg.frames.size(), "frame") + " for " + plural(seg.segments.size(), "segment") + " of " +
           std::to_string(seg.geometry.size.z) + " slices: read, it takes more than 10000 times its pixels");
}

DicomSegmentation SegmentationFile::header(double otherwise_mm, const Geometry* volume) {
  DicomSegmentation seg;
  seg.frame_of_reference_uid = text_of(data(), DCM_FrameOfReferenceUID);
  read_bits(seg);
  read_segment_list(seg);
  shared_ = items(DCM_SharedFunctionalGroupsSequence, 1).front();
  frames_ = items(DCM_PerFrameFunctionalGroupsSequence, kMostFrames);
  Sint32 stated = 0;
  if (data().findAndGetSint32(DCM_NumberOfFrames, stated).bad() || stated != std::ssize(frames_))
    refuse("has Number of Frames (0028,0008) " + stated_number(text_of(data(), DCM_NumberOfFrames)) +
           ", and functional groups of " + std::to_string(frames_.size()));
  read_plane(seg);
  place_frames(seg, otherwise_mm);
  seg.first = {0, 0, 1};
  seg.last = seg.geometry.size - std::int64_t{1} - seg.first;
  if (volume) pad_cropped(seg, *volume);
  require_dense(seg);
  return seg;
}

std::vector<AnyVolume> SegmentationFile::segments(const DicomSegmentation& header) {
  const glm::i64vec3 size = header.geometry.size, shown = header.last - header.first + std::int64_t{1};
  const FramePixels pixels(format_, path_, header.frames.size(), "a segmentation");
  // Decoded before anything is allocated that a damaged file may make large.
  std::vector<std::uint16_t> values = pixels.frame(0);
  std::vector<AnyVolume> volumes;
  for (std::size_t n = 0; n < header.segments.size(); ++n) {
    volumes.emplace_back(header.geometry, VoxelType::u8);
    std::ranges::fill(volumes.back().as<std::uint8_t>(), std::uint8_t{0});
  }
  std::vector<std::span<std::uint8_t>> voxels;
  for (AnyVolume& volume : volumes) voxels.push_back(volume.as<std::uint8_t>());
  const LabelIndex label_index(header);
  for (std::size_t n = 0; n < header.frames.size(); ++n) {
    if (n > 0) values = pixels.frame(n);
    const auto& [segment_of_frame, slice] = header.frames[n];
    const std::int64_t corner = header.first.x + size.x * (header.first.y + size.y * slice);
    for (std::size_t pixel = 0; pixel < values.size(); ++pixel) {
      const std::uint16_t value = values[pixel];
      if (value == 0) continue;
      const std::size_t segment = header.label_map ? label_index[value] : segment_of_frame;
      if (segment == volumes.size()) refuse_segment(value, n);
      if (!header.label_map && value > header.largest)
        refuse("has the value " + std::to_string(value) + in_frame(n) + ", above " +
               tag_name(DCM_MaximumFractionalValue) + " " + std::to_string(header.largest));
      const auto at = static_cast<std::int64_t>(pixel), row = at / shown.x, column = at % shown.x;
      voxels[segment][static_cast<std::size_t>(corner + row * size.x + column)] =
          static_cast<std::uint8_t>(header.label_map ? 1 : value);
    }
  }
  return volumes;
}

}  // namespace

bool is_dicom_segmentation(const std::filesystem::path& path) {
  const std::string sop_class = sop_class_of(path);
  return sop_class == UID_SegmentationStorage || sop_class == kLabelMapStorage;
}

DicomSegmentation read_segmentation_header(const std::filesystem::path& path, double otherwise_mm,
                                           const Geometry* volume) {
  return SegmentationFile(path).header(otherwise_mm, volume);
}

std::vector<AnyVolume> read_segments(const std::filesystem::path& path, const DicomSegmentation& header) {
  return SegmentationFile(path).segments(header);
}

}  // namespace tetwarp
