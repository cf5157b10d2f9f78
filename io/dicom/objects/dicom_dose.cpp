// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_dose.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/pixels/dicom_plain_pixels.h"
#include "io/dicom/pixels/dicom_samples.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom_text.h"

namespace tetwarp {

namespace {

/// One RT Dose file, parsed.
class DoseFile {
 public:
  explicit DoseFile(const std::filesystem::path& path) : path_(path) {
    prepare_dcmtk();
    const OFCondition read = parse_dicom(format_, path, DCM_UndefinedTagKey).result;
    if (read.bad()) refuse(std::string("cannot be read as DICOM: ") + read.text());
    if (text_of(data(), DCM_SOPClassUID) != UID_RTDoseStorage) refuse("is no RT Dose object");
  }

  DicomDose header() {
    DicomDose dose;
    dose.units = text_of(data(), DCM_DoseUnits);
    if (!dose.units.empty()) dose.units = known_code(dose.units, {"GY", "RELATIVE"});
    dose.frame_of_reference_uid = text_of(data(), DCM_FrameOfReferenceUID);
    Geometry& grid = dose.geometry;
    grid.size = {word(DCM_Columns), word(DCM_Rows), std::max<std::int64_t>(1, whole_number(DCM_NumberOfFrames))};
    std::array<double, 6> cosines;
    for (unsigned long n = 0; n < 6; ++n) cosines[n] = number(DCM_ImageOrientationPatient, n);
    if (const std::string problem = rotation_problem(cosines); !problem.empty())
      refuse("has an Image Orientation (0020,0037) that is no rotation: " + problem);
    const glm::dvec3 row(cosines[0], cosines[1], cosines[2]), column(cosines[3], cosines[4], cosines[5]);
    const glm::dvec3 normal = glm::cross(row, column);
    grid.direction = glm::dmat3(row, column, normal);
    grid.origin = {number(DCM_ImagePositionPatient, 0), number(DCM_ImagePositionPatient, 1),
                   number(DCM_ImagePositionPatient, 2)};
    grid.spacing = {number(DCM_PixelSpacing, 1), number(DCM_PixelSpacing, 0), 1};
    place_frames(grid);
    require_valid(grid, ("the dose grid of " + path_.string()).c_str());
    return dose;
  }

  AnyVolume doses(const Geometry& grid) {
    const double scaling = number(DCM_DoseGridScaling, 0);
    if (!(scaling > 0))
      refuse("has " + tag_name(DCM_DoseGridScaling) + " " + tetwarp::number(scaling) + ", expected more than 0");
    const int bits = static_cast<int>(word(DCM_BitsAllocated));
    const StoredBits stored_bits = stored_bits_of(bits);
    const auto voxels = static_cast<std::size_t>(voxel_count(grid));
    // Whole words of 16 bits, the low one of a value first, on this machine's order of bytes.
    Uint16* words = nullptr;
    DcmElement& pixels = plain_pixels(data(), path_, voxels * static_cast<std::size_t>(bits / 8), "a dose");
    if (pixels.getUint16Array(words).bad() || words == nullptr)
      refuse("has no Pixel Data (7FE0,0010) that can be read as words of 16 bits");
    AnyVolume volume(grid, VoxelType::f32);
    const std::span<float> doses = volume.as<float>();
    for (std::size_t n = 0; n < voxels; ++n) {
      const std::uint32_t value =
          bits == 16 ? words[n] : words[2 * n] | static_cast<std::uint32_t>(words[2 * n + 1]) << 16;
      doses[n] = static_cast<float>(static_cast<double>(stored_bits.value(value)) * scaling);
    }
    return volume;
  }

 private:
  DcmDataset& data() { return *format_.getDataset(); }
  [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_.string() + " " + what); }

  StoredBits stored_bits_of(int allocated) {
    if (allocated != 16 && allocated != 32)
      refuse("has Bits Allocated (0028,0100) " + std::to_string(allocated) + ", expected 16 or 32");
    const std::int64_t samples = word(DCM_SamplesPerPixel), sign = word(DCM_PixelRepresentation);
    if (samples != 1) refuse("has Samples per Pixel (0028,0002) " + std::to_string(samples) + ", expected 1");
    if (sign > 1) refuse("has Pixel Representation (0028,0103) " + std::to_string(sign) + ", expected 0 or 1");
    const int stored = static_cast<int>(word(DCM_BitsStored)), high_bit = static_cast<int>(word(DCM_HighBit));
    const std::string problem = stored_bits_problem(allocated, stored, high_bit);
    if (!problem.empty()) refuse("has other bits than a dose can have: " + problem);
    return {stored, high_bit, sign == 1};
  }

  double number(const DcmTagKey& tag, unsigned long n) {
    double value = 0;
    if (!is_at_most(data(), tag, kLongestValue) || data().findAndGetFloat64(tag, value, n).bad() ||
        !std::isfinite(value)) {
      refuse("has no value " + std::to_string(n + 1) + " of " + tag_name(tag));
    }
    return value;
  }
  std::int64_t word(const DcmTagKey& tag) {
    Uint16 value = 0;
    if (!is_at_most(data(), tag, kLongestValue) || data().findAndGetUint16(tag, value).bad())
      refuse("has no " + tag_name(tag));
    return value;
  }
  std::int64_t whole_number(const DcmTagKey& tag) {
    Sint32 value = 0;
    if (!is_at_most(data(), tag, kLongestValue) || data().findAndGetSint32(tag, value).bad())
      refuse("has no " + tag_name(tag));
    return value;
  }

  /// Grid Frame Offset Vector (PS3.3 C.8.8.3.2): from the first frame along the normal where it begins with 0, else
  /// the patient's z of every frame.
  void place_frames(Geometry& grid) {
    constexpr double kTolerance = 1e-3;  // mm
    if (grid.size.z < 2) refuse("has one frame, which says no distance between frames; expected 2 or more");
    const double first = number(DCM_GridFrameOffsetVector, 0), step = number(DCM_GridFrameOffsetVector, 1) - first;
    for (std::int64_t k = 1; k < grid.size.z; ++k) {
      const double offset = number(DCM_GridFrameOffsetVector, static_cast<unsigned long>(k));
      if (std::abs(offset - first - static_cast<double>(k) * step) > kTolerance) {
        refuse("has frames at uneven distances, Grid Frame Offset Vector (3004,000C): frame " + std::to_string(k + 1) +
               " at " + std::to_string(offset) + " mm, expected " +
               std::to_string(first + static_cast<double>(k) * step));
      }
    }
    const bool absolute = first != 0;
    if (absolute && std::abs(first - grid.origin.z) > kTolerance) {
      refuse("begins at " + std::to_string(grid.origin.z) + " mm by Image Position (Patient), and at " +
             std::to_string(first) + " mm by Grid Frame Offset Vector (3004,000C)");
    }
    // An absolute offset grows with z, whichever way the normal points.
    const double along = absolute && grid.direction[2].z < 0 ? -step : step;
    if (along < 0) grid.direction[2] = -grid.direction[2];
    grid.spacing.z = std::abs(along);
  }

  std::filesystem::path path_;
  DcmFileFormat format_;
};

}  // namespace

bool is_dicom_dose(const std::filesystem::path& path) { return sop_class_of(path) == UID_RTDoseStorage; }

DicomDose read_dose_header(const std::filesystem::path& path) { return DoseFile(path).header(); }

AnyVolume read_dose(const std::filesystem::path& path) {
  DoseFile file(path);
  return file.doses(file.header().geometry);
}

}  // namespace tetwarp
