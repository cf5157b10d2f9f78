// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "deform/resampler.h"
#include "deform/volume.h"
#include "io/deidentification.h"

namespace tetwarp {

class ImageWriter;

/// One slice of a series, a file or a frame of it, from its header alone.
struct DicomSlice {
  std::filesystem::path file;
  std::string sop_instance_uid;
  std::string transfer_syntax_uid;
  int instance_number = 0;
  double position_mm = 0;         ///< Image Position (Patient) along the slice normal
  std::optional<int> frame = {};  ///< of a multi-frame file, from 0
};

/// A file, or a frame of it, that was met and is no slice.
struct LeftOutFile {
  std::filesystem::path file;
  std::string reason;             ///< without the name of the file: many have the same
  std::optional<int> frame = {};  ///< as in DicomSlice
};
/// "FILE: reason", "FILE, frame 17: reason".
std::string to_string(const LeftOutFile& left_out);

/// "axial", "coronal" or "sagittal" where slices of this normal are that within a degree; "oblique, nearly axial" else.
std::string plane_name(const glm::dvec3& normal);

/// The files that share a Series Instance UID and make one volume, if they do. A series that holds several volumes
/// (phases, acquisitions, reconstructions) is several of these, in the natural order of what tells them apart.
/// Files of the series that cannot belong to a CT volume (localizers, secondary captures, dose, structures) are set
/// aside.
struct DicomSeries {
  std::string series_uid, study_uid, frame_of_reference_uid, modality;
  std::optional<int> series_number;
  std::string description;         ///< Series Description, as messages show it; empty if it names the patient
  std::size_t volumes = 1;         ///< in the series; of several each has:
  std::string label;               ///< what people call it: "phase 50 %", "acquisition 3"
  std::string split_by;            ///< the attribute that tells it from the others: "Acquisition Number (0020,0012)"
  std::vector<DicomSlice> slices;  ///< sorted by position along the normal, row x column
  Geometry geometry;               ///< from Image Position and Orientation (Patient) and Pixel Spacing alone, sheared
                                   ///< and uneven as they say; of a refused series: size 0, or as far as it is known
  std::vector<LeftOutFile> set_aside;  ///< of the whole series; of several volumes the first has them
  std::optional<std::string> refusal;  ///< why the slices are not a volume: what, where, expected and found
  std::optional<std::string> uneven;   ///< how the slice distances differ; `geometry.slices` has them exactly, for who
                                       ///< takes such a volume
  std::vector<std::string> warnings;   ///< worth knowing, harmless to the volume
};

struct DicomScan {
  std::vector<DicomSeries>
      series;  ///< in the order of Series Number, then UID: the numbers that `--series` takes, from 1
  std::vector<LeftOutFile> skipped;  ///< files that are not DICOM images at all
  std::size_t files = 0;             ///< that were looked at
};

/// Reads the headers of every file under a folder, once (sub-folders included, symbolic links followed, each real
/// folder once); or of one file and the series beside it; or, with `single`, of that file alone; or of the files that a
/// DICOMDIR names. Pixels are read only of files that have the same SOP Instance UID.
/// @throws InputError when the path does not exist or cannot be read, Cancelled
DicomScan scan_dicom(const std::filesystem::path& path, bool single = false, const Control& control = {});

/// The headers of a series' slices, k-th slice first to last: what a derived series carries over. Hides DCMTK.
struct DicomHeaders;
/// DCMTK's data sets remember where they were read last: headers are for one thread at a time, each other needs its
/// copy.
std::shared_ptr<const DicomHeaders> copy_headers(const DicomHeaders& headers);

struct DicomVolume {
  Volume<std::int16_t> volume;          ///< HU, each slice through its own Rescale Slope and Intercept
  std::optional<PaddingRange> padding;  ///< Pixel Padding Value and Range Limit in HU, when all slices agree
  std::uint64_t rounded = 0;            ///< voxels whose HU was fractional and was rounded half to even
  std::string series_uid;
  /// Of the SHA-256 digests of the files, each once, in the order of their first slices; empty where it was left out.
  std::string sha256;
  std::shared_ptr<const DicomHeaders> headers;
};

/// Whether a reader hashes the files, which takes as long as reading them where they are not compressed.
enum class FileHash : std::uint8_t { made, left_out };

/// Reads and decodes the slices in parallel; each file is parsed once. Of a file of several frames no more is in memory
/// than the header and the frames that are being decoded, unless its data set is deflated.
/// @throws InputError for a series with a refusal, a file that changed or is truncated, a transfer syntax that cannot
/// be
///         decoded, HU beyond int16: naming the file, the tag, expected and found
DicomVolume load_dicom(const DicomSeries& series, int threads = 0, const Control& control = {},
                       FileHash hash = FileHash::made);

/// `DicomVolume::sha256` without reading voxels. @throws InputError for a file that cannot be read, Cancelled
std::string hash_files(const DicomSeries& series, int threads = 0, const Control& control = {});

/// How a derived series keeps its pixels, always without loss: a transfer syntax of PS3.5.
enum class DicomEncoding : std::uint8_t {
  uncompressed,  ///< Explicit VR Little Endian
  deflated,      ///< Deflated Explicit VR Little Endian: the header too
  rle,           ///< RLE Lossless
  jpeg_ls,       ///< JPEG-LS Lossless
};

/// The word of the command line: explicit, deflated, rle, jpeg-ls.
const char* name_of(DicomEncoding encoding);

/// What may be chosen of a derived series.
struct DicomForm {
  DicomEncoding encoding = DicomEncoding::uncompressed;
  bool keep_frame_of_reference = false;                ///< also of what was deformed
  std::optional<int> series_number = {};               ///< instead of the source's + 1000
  std::optional<std::string> series_description = {};  ///< UTF-8; instead of "deformed: " and the source's
  std::optional<Deidentification> deidentification = {};

  friend bool operator==(const DicomForm&, const DicomForm&) = default;
};

/// What a derived series says of how it came to be.
struct DicomDerivation {
  std::string field_sha256;  ///< hex: the frame of reference depends on it and on the source's frame alone
  std::string parameters;    ///< the options that decide voxels, in one canonical line
  std::string description;   ///< Derivation Description: "Deformed by ..."; no paths, no names
  bool deformed = true;      ///< false for identity: the frame of reference is kept
  double background_hu = -1024;
  DicomForm form = {};
};

/// What the writer had to add or could not carry over, for the report.
struct DicomWriteReport {
  std::string study_uid, series_uid, frame_of_reference_uid;
  std::vector<std::string> added_empty;        ///< missing type 2 attributes: "(0008,0090) ReferringPhysicianName"
  std::vector<std::string> sop_instance_uids;  ///< of the output's slices, k-th first to last; empty: not yet written
  bool says_who = false;  ///< the source says that pixels show text or a face that can be recognised
};

/// Writes a derived CT series (PS3.3 A.3; docs/reference/dicom.md has the table of attributes) of one file a slice into
/// the folder `folder`, which exists and is empty. Reads no clock: the same input gives the same bytes and the same
/// UIDs.
class DerivedSeriesWriter {
 public:
  /// The source's headers must outlive the writer. Where the derived volume has as many slices as the source, each
  /// takes over the header of its own; otherwise that of the source slice nearest to it along the stack.
  /// @param geometry  of the derived volume, straight and even
  /// @throws InputError
  DerivedSeriesWriter(std::filesystem::path folder, const Geometry& geometry, const DicomHeaders& source,
                      DicomDerivation derivation);
  ~DerivedSeriesWriter();
  DerivedSeriesWriter(const DerivedSeriesWriter&) = delete;
  DerivedSeriesWriter& operator=(const DerivedSeriesWriter&) = delete;

  /// Writes some slices of a volume of int16 HU, in parallel; of the others nothing is read. Each slice once, in any
  /// order, by several threads at a time if need be.
  /// @param sampled  per slice of the volume: the source slices that it was interpolated from; or empty
  /// @throws InputError, Error when a file cannot be written, Cancelled
  void write(const ConstVolumeView& volume, std::int64_t begin, std::int64_t end, std::span<const SliceRange> sampled,
             int threads = 0, const Control& control = {});
  /// Of what was written so far.
  DicomWriteReport report() const;

  /// Begins a Deformable Spatial Registration object (PS3.3 A.39.2): from points p of the derived series' frame of
  /// reference to those of the source's that they come from. It takes displacements x0 - p (3 x float32, LPS mm; NaN:
  /// undefined) on the grid of the series, and names the slices that are written when it is finished; of a series of
  /// which none is, the frame of reference alone. Must not outlive this writer.
  /// @throws what `require_registration_fits` throws, and Error when the file cannot be written
  std::unique_ptr<ImageWriter> create_registration(const std::filesystem::path& path) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// @throws InputError where the vectors of a grid are more bytes than an attribute of DICOM holds, 2^32 - 2
void require_registration_fits(const Geometry& grid);

/// A whole series at once.
DicomWriteReport write_derived_series(const std::filesystem::path& folder, const ConstVolumeView& volume,
                                      const DicomHeaders& source, const DicomDerivation& derivation,
                                      std::span<const SliceRange> sampled = {}, int threads = 0,
                                      const Control& control = {});

/// Writes a made-up CT series for a volume of int16 HU that never was a patient (tetwarp phantom).
void write_phantom_series(const std::filesystem::path& folder, const ConstVolumeView& volume, std::uint64_t seed,
                          const Control& control = {});

/// Whether a DICOM file says that Tetwarp wrote it (Contributing Equipment or Manufacturer).
bool is_tetwarp_dicom(const std::filesystem::path& file);

}  // namespace tetwarp
