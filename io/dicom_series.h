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

/// One slice of a series, as its header describes it: a file, or a frame of a file.
struct DicomSlice {
  std::filesystem::path file;       ///< the file
  std::string sop_instance_uid;     ///< SOP Instance UID (0008,0018)
  std::string transfer_syntax_uid;  ///< Transfer Syntax UID (0002,0010)
  int instance_number = 0;          ///< Instance Number (0020,0013)
  double position_mm = 0;           ///< Image Position (Patient) along the slice normal, mm
  std::optional<int> frame = {};    ///< number of the frame in a multi-frame file, from 0
};

/// A file, or a frame of it, that was found and is not a slice.
struct LeftOutFile {
  std::filesystem::path file;     ///< the file
  std::string reason;             ///< why, without the name of the file, so that equal reasons are equal texts
  std::optional<int> frame = {};  ///< number of the frame in a multi-frame file, from 0
};
/// The text "FILE: reason" or "FILE, frame 17: reason".
std::string to_string(const LeftOutFile& left_out);

/// The plane of slices with this normal (LPS): "axial", "coronal" or "sagittal" to within a degree, otherwise such as
/// "oblique, nearly axial".
std::string plane_name(const glm::dvec3& normal);

/// Files with one Series Instance UID that make one volume, if they do.
/// A series that contains several volumes (phases, acquisitions, reconstructions) becomes several objects, in the
/// natural order of the attribute that tells them apart. Files of the series that cannot belong to a CT volume
/// (localizers, secondary captures, doses, structures) are set aside.
struct DicomSeries {
  std::string series_uid,            ///< Series Instance UID (0020,000E)
      study_uid,                     ///< Study Instance UID (0020,000D)
      frame_of_reference_uid,        ///< Frame of Reference UID (0020,0052)
      modality;                      ///< Modality (0008,0060)
  std::optional<int> series_number;  ///< Series Number (0020,0011)
  std::string description;  ///< Series Description (0008,103E) as messages show it; empty if it names the patient
  std::size_t volumes = 1;  ///< number of volumes in the series; `label` and `split_by` are set if there are several
  std::string label;        ///< what people call this volume: "phase 50 %", "acquisition 3"
  std::string split_by;     ///< the attribute that tells it from the other volumes: "Acquisition Number (0020,0012)"
  std::vector<DicomSlice> slices;  ///< ordered by position along the normal, row x column
  /// Grid from Image Position and Orientation (Patient) and Pixel Spacing alone, sheared and uneven if they say so. Of
  /// a refused series it has size 0, or what is known of it.
  Geometry geometry;
  std::vector<LeftOutFile> set_aside;  ///< of the whole series; if it has several volumes the first one has this list
  std::optional<std::string> refusal;  ///< why the slices are no volume: what, where, expected and found
  std::optional<std::string> uneven;   ///< how distances of slices differ; `geometry.slices` has the exact positions
  std::vector<std::string> warnings;   ///< remarks that do not affect the volume
};

/// What was found in a folder.
struct DicomScan {
  /// Ordered by Series Number, then by UID. Option `--series` counts them from 1.
  std::vector<DicomSeries> series;
  std::vector<LeftOutFile> skipped;  ///< files that are no DICOM images
  std::size_t files = 0;             ///< number of files that were looked at
};

/// Names a file with DCMTK's data dictionary for machines without one. It is loaded with the first DICOM file where
/// DCMTK finds none at its own place and DCMDICTPATH is not set. To be called before.
void set_dicom_dictionary(const std::filesystem::path& path);

/// Reads the headers of all files in a folder and its sub-folders; symbolic links are followed, and each real folder is
/// read once. Pixels are read only of files with equal SOP Instance UIDs.
/// @param path     a folder; a DICOMDIR, which names files; or a file, whose folder is searched for its series
/// @param single   of a file: read that file alone
/// @param control  progress and stop
/// @throws InputError when the path does not exist or cannot be read
/// @throws Cancelled
DicomScan scan_dicom(const std::filesystem::path& path, bool single = false, const Control& control = {});

/// The headers of the slices of a series, in order of k, which a derived series takes over. The type hides DCMTK.
struct DicomHeaders;
/// A copy for another thread. Headers serve one thread at a time, because data sets of DCMTK remember where they were
/// read last.
std::shared_ptr<const DicomHeaders> copy_headers(const DicomHeaders& headers);

/// A CT series as a volume.
struct DicomVolume {
  Volume<std::int16_t> volume;          ///< HU: each slice through its own Rescale Slope and Intercept
  std::optional<PaddingRange> padding;  ///< Pixel Padding Value and Range Limit in HU, if all slices agree on them
  std::uint64_t rounded = 0;            ///< number of voxels whose HU was no whole number and was rounded half to even
  std::string series_uid;               ///< Series Instance UID
  /// SHA-256, hexadecimal, of the SHA-256 digests of the files, each file once, in the order of their first slices.
  /// Empty with FileHash::left_out.
  std::string sha256;
  std::shared_ptr<const DicomHeaders> headers;  ///< headers of its slices
};

/// Whether a reader hashes the files. Hashing takes about as long as reading uncompressed files.
enum class FileHash : std::uint8_t {
  made,     ///< files are hashed
  left_out  ///< files are not hashed
};

/// Reads and decodes the slices in parallel; each file is parsed once. Of a multi-frame file only the header and the
/// frames that are being decoded are in memory, unless its data set is deflated.
/// @param series   from `scan_dicom`
/// @param threads  0: all that this process may use
/// @param control  progress and stop
/// @param hash     whether `DicomVolume::sha256` is made
/// @throws InputError, which names file, tag, and what was expected and found: for a series with a refusal, a file that
///         changed or is truncated, a transfer syntax that cannot be decoded, or HU beyond int16
/// @throws Cancelled
DicomVolume load_dicom(const DicomSeries& series, int threads = 0, const Control& control = {},
                       FileHash hash = FileHash::made);

/// `DicomVolume::sha256` of a series without reading voxels.
/// @throws InputError for a file that cannot be read
/// @throws Cancelled
std::string hash_files(const DicomSeries& series, int threads = 0, const Control& control = {});

/// How a derived series stores its pixels, always without loss: a transfer syntax of DICOM PS3.5.
enum class DicomEncoding : std::uint8_t {
  uncompressed,  ///< Explicit VR Little Endian
  deflated,      ///< Deflated Explicit VR Little Endian, which compresses the header too
  rle,           ///< RLE Lossless
  jpeg_ls,       ///< JPEG-LS Lossless
};

/// The word of the command line: explicit, deflated, rle or jpeg-ls.
const char* name_of(DicomEncoding encoding);

/// Choices for the files of a derived series.
struct DicomForm {
  DicomEncoding encoding = DicomEncoding::uncompressed;  ///< transfer syntax
  /// Whether a deformed series, too, keeps the Frame of Reference UID of its source.
  bool keep_frame_of_reference = false;
  std::optional<int> series_number = {};  ///< Series Number (0020,0011); empty: that of the source plus 1000
  std::optional<std::string> series_description = {};     ///< UTF-8; instead of "deformed: " and the source's
  std::optional<Deidentification> deidentification = {};  ///< how the files are de-identified; empty: not at all

  /// Whether all choices are equal.
  friend bool operator==(const DicomForm&, const DicomForm&) = default;
};

/// What a derived series states about how it was made.
struct DicomDerivation {
  /// SHA-256 of the field, hexadecimal; it and the source's frame of reference decide the new frame of reference.
  std::string field_sha256;
  std::string parameters;        ///< the options that decide voxels, in one canonical line
  std::string description;       ///< Derivation Description (0008,2111): "Deformed by ..."; without paths and names
  bool deformed = true;          ///< false for the identity, which keeps the frame of reference
  double background_hu = -1024;  ///< HU of voxels where nothing maps
  DicomForm form = {};           ///< choices for the files
};

/// What was written, what had to be added, and what could not be taken over.
struct DicomWriteReport {
  std::string study_uid,                 ///< Study Instance UID of the output
      series_uid,                        ///< Series Instance UID of the output
      frame_of_reference_uid;            ///< Frame of Reference UID of the output
  std::vector<std::string> added_empty;  ///< type 2 attributes that were missing: "(0008,0090) ReferringPhysicianName"
  /// Of the output's slices in order of k; empty for a slice that is not yet written.
  std::vector<std::string> sop_instance_uids;
  /// Whether the source states that its pixels show text or a face by which the patient can be recognised.
  bool says_who = false;
};

/// Writes a derived CT series (DICOM PS3.3 A.3), one file a slice, into an existing empty folder.
/// docs/reference/dicom.md has the table of attributes. It reads no clock: equal input gives equal bytes and UIDs.
class DerivedSeriesWriter {
 public:
  /// Where the derived volume has as many slices as the source, each slice takes over the header of the slice with its
  /// index; otherwise that of the source slice nearest to it along the stack.
  /// @param folder      existing empty folder
  /// @param geometry    grid of the derived volume, straight and even
  /// @param source      headers of the source, which must outlive the writer
  /// @param derivation  how the volume was made
  /// @throws InputError for a grid or a derivation that cannot be written
  DerivedSeriesWriter(std::filesystem::path folder, const Geometry& geometry, const DicomHeaders& source,
                      DicomDerivation derivation);
  /// Frees the writer. Files that were written stay.
  ~DerivedSeriesWriter();
  DerivedSeriesWriter(const DerivedSeriesWriter&) = delete;
  DerivedSeriesWriter& operator=(const DerivedSeriesWriter&) = delete;

  /// Writes slices `begin` up to, not including, `end` of a volume of int16 HU, in parallel; other slices are not read.
  /// Each slice is written once, in any order; several threads may call at a time.
  /// @param volume   on the grid of the derived volume
  /// @param begin    first slice
  /// @param end      slice after the last
  /// @param sampled  for each slice of the volume, the source slices from which it was interpolated; or empty
  /// @param threads  0: all that this process may use
  /// @param control  progress and stop
  /// @throws InputError for a volume that does not fit
  /// @throws Error when a file cannot be written
  /// @throws Cancelled
  void write(const ConstVolumeView& volume, std::int64_t begin, std::int64_t end, std::span<const SliceRange> sampled,
             int threads = 0, const Control& control = {});
  /// What was written so far.
  DicomWriteReport report() const;

  /// Begins a Deformable Spatial Registration object (PS3.3 A.39.2), which maps points p in the frame of reference of
  /// the derived series to the points of the source from which they come.
  /// It takes displacements x0 - p (3 x float32, LPS mm; NaN: undefined) on the grid of the series. When finished it
  /// names the slices that are written by then; if there are none it names the frame of reference alone. It must not
  /// outlive this writer.
  /// @throws InputError as `require_registration_fits`
  /// @throws Error when the file cannot be written
  std::unique_ptr<ImageWriter> create_registration(const std::filesystem::path& path) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Checks that the vectors of a grid fit into an attribute of DICOM.
/// @throws InputError for a grid whose vectors have more than 2^32 - 2 bytes
void require_registration_fits(const Geometry& grid);

/// Writes a whole derived series by a `DerivedSeriesWriter`; parameters and exceptions are those of its members.
DicomWriteReport write_derived_series(const std::filesystem::path& folder, const ConstVolumeView& volume,
                                      const DicomHeaders& source, const DicomDerivation& derivation,
                                      std::span<const SliceRange> sampled = {}, int threads = 0,
                                      const Control& control = {});

/// Writes the CT series of a phantom, a volume of int16 HU that never was a patient, as `tetwarp phantom` does.
/// @param folder   existing empty folder
/// @param volume   int16 HU
/// @param seed     of the phantom
/// @param control  progress and stop
void write_phantom_series(const std::filesystem::path& folder, const ConstVolumeView& volume, std::uint64_t seed,
                          const Control& control = {});

/// Whether a DICOM file states that Tetwarp wrote it (Contributing Equipment Sequence or Manufacturer).
bool is_tetwarp_dicom(const std::filesystem::path& file);

}  // namespace tetwarp
