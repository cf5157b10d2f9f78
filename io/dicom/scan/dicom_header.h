// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what scanning and loading need to know of one DICOM file, and the functions that read its tags.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "deform/geometry.h"
#include "deform/resampler.h"
#include "io/shown_text.h"

namespace tetwarp {

/// How stored values are laid out and what they mean (PS3.3 C.7.6.3.1, C.7.5.1.1.2, C.11.1).
struct PixelFormat {
  int rows = 0, columns = 0, samples = 1;  ///< 0: the attribute is missing
  int frames = 1;                          ///< how many the file has; -1: not a number
  int bits_allocated = 0, bits_stored = 0, high_bit = 0;
  bool is_signed = false;
  /// Pixel Representation as read, from which `is_signed` was made; none: missing
  std::optional<int> sign_word = 0;
  std::string photometric;
  std::optional<double> slope, intercept;
  std::string rescale_type;
  bool has_modality_lut = false;  ///< Modality LUT Sequence (0028,3000), another way from stored values to HU
  std::optional<int> padding_word, padding_limit_word;  ///< the 16 bits as read, whatever VR the file gave them

  friend bool operator==(const PixelFormat&, const PixelFormat&) = default;
};

/// What is known of a DICOM file, or of one frame of a file that holds several slices.
struct DicomFileHeader {
  std::filesystem::path file;
  std::optional<int> frame;    ///< number of the frame from 0; none: the file is one slice
  std::string skip;            ///< why the file is no DICOM object at all; empty: it is one
  bool broken = false;         ///< skipped although it may have been a slice: unreadable, empty, cut short or damaged
  std::string damage;          ///< why the data set could not be read to its end; empty: it was read to its end
  std::string no_frames = {};  ///< for files of several frames, why these cannot be told apart; else empty
  E_TransferSyntax encoding = EXS_Unknown;
  std::string transfer_syntax_uid;  ///< as the file states it, or as found where it has no meta header
  std::string sop_class_uid, sop_instance_uid, series_uid, study_uid, frame_of_reference_uid, modality;
  std::vector<std::string> image_type;
  std::string character_set;        ///< Specific Character Set of the texts in `traits`
  std::string traits;               ///< values that may tell volumes of a series apart: see trait_of (dicom_traits.h)
  std::uint32_t secret_traits = 0;  ///< one bit a trait that holds the patient's name or ID and is not shown
  std::optional<int> series_number;
  int instance_number = 0;
  std::optional<glm::dvec3> position;                ///< Image Position (Patient), LPS mm
  std::array<int, 3> position_decimals{};            ///< digits after the point of each component as written
  std::optional<std::array<double, 6>> orientation;  ///< Image Orientation (Patient)
  std::optional<glm::dvec2> spacing;                 ///< along i (second value of Pixel Spacing), then along j, mm
  /// (0018,0050), (0018,0088); they give the geometry of a lone slice only
  std::optional<double> thickness, slice_spacing;
  std::string private_compression;  ///< Private attribute (07a1,xx11) of ELSCINT1: the vendor's own coding of pixels
  PixelFormat pixels;
  /// Bytes of the file from the value of Pixel Data on, or, if that is not compressed, from this frame on, up to the
  /// end; none: no Pixel Data
  std::optional<std::uint64_t> pixel_bytes;
  std::uint64_t file_bytes = 0;
};

/// Registers DCMTK's decoders and turns off its messages (a library does not print). It does so once in a process.
/// @throws Error without DCMTK's data dictionary
void prepare_dcmtk();

/// Makes a header from a file that was read, wholly or up to Pixel Data.
DicomFileHeader header_of(DcmFileFormat& format, const std::filesystem::path& file);
/// Makes a header, without a name of a file, from a data set that has no meta header.
DicomFileHeader header_of(DcmDataset& data);

/// Reads a file up to Pixel Data. @return one header, or one for each frame of multi-frame CT. Whatever the file holds,
/// nothing is thrown: see `skip`, `damage` and `no_frames`.
std::vector<DicomFileHeader> read_dicom_headers(const std::filesystem::path& file);

/// The header of a frame.
/// @param slice  the frame's attributes, as a file of this slice alone would have them (EnhancedFrames)
/// @param whole  the header of the file
DicomFileHeader frame_header(DcmDataset& slice, const DicomFileHeader& whole, int frame);

inline std::string shown(const DicomFileHeader& header) { return shown(header.file, header.frame); }

/// Whether the value of an attribute, if there is one, has at most `bytes` bytes. A damaged file may state any length,
/// and DCMTK allocates it before it looks whether the file holds so much.
bool is_at_most(DcmItem& item, const DcmTagKey& tag, std::uint64_t bytes);
/// The most bytes of the value of an attribute that is read here, except Pixel Data.
constexpr std::uint64_t kLongestValue = 1 << 20;

/// Text of an attribute without padding, its values separated by backslashes; empty if it is missing.
std::string text_of(DcmItem& item, const DcmTagKey& tag);

/// The decimal strings of an attribute as numbers: exactly `count` of them, or none.
std::optional<std::vector<double>> numbers_of(DcmItem& item, const DcmTagKey& tag, std::size_t count);

/// SOP Class of Label Map Segmentations (PS3.4 B.5), which DCMTK 3.6.7 does not know.
inline constexpr const char* kLabelMapStorage = "1.2.840.10008.5.1.4.1.1.66.7";

/// The name of a UID, followed by the UID: "JPEG 2000 (Lossless only) (1.2.840.10008.1.2.4.90)"; the UID alone if it
/// has no name.
std::string uid_with_name(const std::string& uid);

/// A SOP Class in plain words, with its name and UID: "an MR image, MRImageStorage (1.2.840.10008.5.1.4.1.1.4)".
std::string kind_name(const std::string& sop_class_uid);

/// Why this object is no slice of a CT volume by its kind (localizer, dose, MR, ...); empty if it may be one.
std::string other_kind(const DicomFileHeader& header);

/// Why the direction cosines of a row and a column (Image Orientation) are no rotation, "expected X, found Y"; empty:
/// they are one.
std::string rotation_problem(std::span<const double, 6> cosines);

/// Why the Image Plane attributes of a slice cannot be used, "WHAT, FILE; WHAT TO DO"; empty if they can.
std::string geometry_problem(const DicomFileHeader& header);

/// Why the pixels of a slice cannot be turned into HU; empty if they can, as far as the header tells.
std::string pixel_problem(const DicomFileHeader& header);

/// Why Pixel Data of a file that was read to its end are of another image than the header's, with more rows or frames:
/// at least a row is left over. A smaller remainder counts as filling, which some writers add. Empty: nothing is left
/// over, or Pixel Data are compressed.
std::string excess_problem(const DicomFileHeader& header);

/// Padding in HU, rounded half to even and saturated to int16; none if the slice has no usable Pixel Padding Value.
std::optional<PaddingRange> padding_hu(const PixelFormat& pixels);

/// Padding as stored values, low <= high.
struct StoredRange {
  int low = 0, high = 0;
};
/// The padding of a slice as stored values. Its words are read as signed or unsigned as the pixels are: 63536 of signed
/// 16-bit pixels is -2000. None where the value cannot occur among the pixels.
std::optional<StoredRange> stored_padding(const PixelFormat& pixels);

/// The HU of a stored value, slope * stored + intercept, not rounded.
double hu_of(const PixelFormat& pixels, int stored);

/// The stored value in a word of Pixel Data: see StoredBits.
int stored_value(const PixelFormat& pixels, unsigned word);

/// Bytes of one uncompressed frame.
std::uint64_t slice_bytes(const PixelFormat& pixels);

/// Rows and columns for messages, "512 x 512", rows first.
std::string size_text(const PixelFormat& pixels);

}  // namespace tetwarp
