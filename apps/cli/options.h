// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "backend/backend.h"
#include "deform/errors.h"
#include "deform/resampler.h"
#include "deform/text/enum_names.h"
#include "io/dicom_series.h"
#include "io/image_file.h"

namespace tetwarp::apps {

/// The command line is wrong: exit status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// What every subcommand takes.
struct CommonOptions {
  bool quiet = false, verbose = false, overwrite = false;
  int threads = 0;
  NiftiFrame nifti_frame = NiftiFrame::sform;  ///< of every file that is read
};

/// A volume to read: a file, or a DICOM series of a folder.
struct InputOptions {
  std::filesystem::path path;
  std::string series;              ///< UID, or the number that `info` prints; empty: the only one
  bool single = false;             ///< read the one DICOM file alone
  bool uneven = false;             ///< take slices at uneven distances, each where it is
  FileHash hash = FileHash::made;  ///< of a DICOM series
  NiftiFrame nifti_frame = NiftiFrame::sform;
  bool has_options = false;  ///< a command has --series and --uneven for it (add_series), so messages may name them

  /// Whether both read the same. What messages may name does not matter for that.
  friend bool operator==(const InputOptions& a, const InputOptions& b) {
    const auto read = [](const InputOptions& one) {
      return std::tie(one.path, one.series, one.single, one.uneven, one.hash, one.nifti_frame);
    };
    return read(a) == read(b);
  }
};

/// Fields as a command line names them. They are parsed once, by parse_field (apps/fields/field_choice.h); nothing else
/// looks into the texts.
struct FieldArguments {
  std::vector<std::string> forward;       ///< formulas and files, the first applied first
  std::vector<std::string> pull;          ///< instead: fields that map output to input, the first applied first
  std::optional<std::int64_t> cell_size;  ///< of forward ones

  bool is_given() const { return !forward.empty() || !pull.empty(); }
};

struct PhantomOptions {
  CommonOptions common;
  std::filesystem::path output;
  std::vector<std::int64_t> size{512, 512, 300};
  std::vector<double> spacing{0.8, 0.8, 1.0};
  std::uint64_t seed = 1;
  double noise_hu = 12;
  std::filesystem::path labels;
};

/// A volume that is named by its path alone, such as labels.
inline InputOptions volume_named(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform) {
  InputOptions volume;
  volume.path = path;
  volume.nifti_frame = frame;
  return volume;
}

struct InfoOptions {
  CommonOptions common;
  InputOptions input;
  bool json = false;
};

struct FieldCommandOptions {
  CommonOptions common;
  FieldArguments field;  ///< forward
  InputOptions like;
  std::filesystem::path output;
};

struct InvertOptions {
  CommonOptions common;
  FieldArguments field;
  InputOptions like;
  std::filesystem::path output, report;
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
};

/// Files for maps of the output. A map with an empty path is not written.
struct MapOptions {
  std::filesystem::path coverage, inverse, jacobian, folds;
};

struct DeformOptions {
  CommonOptions common;
  InputOptions input;
  FieldArguments field;
  std::filesystem::path scenario, labels;  ///< instead of a field: a simulation, and its labels on the grid of INPUT
  std::filesystem::path write_field;       ///< where the forward field that was used goes
  std::filesystem::path output;
  std::filesystem::path folder;  ///< that all outputs lie in and that appears as a whole; empty: each by itself
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
  Interpolation interpolation = Interpolation::linear;
  Outside outside = Outside::refuse;
  std::optional<double> background;
  std::optional<int> compression;
  DicomForm dicom;                       ///< of OUTPUT, where it is a series
  std::filesystem::path deidentify_key;  ///< the file that its key was read from
  std::optional<std::uint64_t> memory_bytes;
  bool bids = false;              ///< a sidecar for BIDS beside OUTPUT
  std::string grid = "same";      ///< same, fit, or a file or folder
  std::vector<std::string> with;  ///< IN=OUT...
  bool preserve_mass = false;
  MapOptions maps;
  std::filesystem::path report, preview;
  std::vector<std::string> points;  ///< IN=OUT[:lps|:ras]
  bool dry_run = false;
};

struct SimulateOptions {
  CommonOptions common;
  std::filesystem::path scenario;
  InputOptions input;
  std::filesystem::path labels;  ///< on the grid of INPUT
  std::filesystem::path output, report;
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
  int every = 0;   ///< frames; 0: none on the way
  bool dry_run = false;
};

struct BatchOptions {
  CommonOptions common;
  std::filesystem::path manifest;
  std::filesystem::path init;    ///< a folder of DICOM of which a manifest is made; empty: a batch is run
  std::filesystem::path output;  ///< folder of the results, or the manifest
  std::string field = "identity";
  bool resume = false, merge = false, log_json = false, dry_run = false;
  std::string shard;  ///< "I/N"; empty: all
  std::optional<std::uint64_t> memory_bytes;
  int jobs = 0;
  BackendChoice backend = BackendChoice::automatic;
};

struct TruthOptions {
  CommonOptions common;
  InputOptions input;
  std::filesystem::path output;    ///< folder of the set
  std::vector<std::string> cases;  ///< KIND[:KEY=VALUE,...]
  std::filesystem::path labels;    ///< on the grid of INPUT
  std::vector<std::string> roles;  ///< ROLE=N,...
  std::vector<std::string> with;   ///< files that go along
  std::filesystem::path dose;      ///< one more, which is scored
  std::int64_t cell_size = 4;
  double body_above_hu = -400;
  std::int64_t landmarks = 1000;
  std::string noise = "0";  ///< standard deviation, HU, or "measured"
  std::uint64_t seed = 1;
  int compression = 1;
  bool dense = false, resume = false;
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
};

struct ScoreOptions {
  CommonOptions common;
  std::filesystem::path set;         ///< folder of a set of known truth
  std::vector<std::string> results;  ///< folders, or one file for a set of one case, with options behind
  bool forward = false;              ///< results lead from moving to fixed
  std::vector<std::string> back;     ///< results of the other direction, as many as results, or none
  std::string triples;               ///< folder of results between two fixed volumes
  std::filesystem::path limits, json, csv, html;
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
};

struct RenderOptions {
  CommonOptions common;
  InputOptions input;
  FieldArguments field;               ///< that deforms the volume
  std::vector<std::string> sequence;  ///< instead: field files, one a picture
  Outside outside = Outside::refuse;
  std::optional<double> fill;    ///< value where nothing maps
  std::filesystem::path output;  ///< .png; of several pictures with numbers; or .mp4 .gif
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;               ///< of CUDA
  std::string view = "volume";  ///< volume, axial, coronal, sagittal or montage
  std::string transfer;         ///< a name, or a JSON file; empty: ct-bone for values like HU, else mip
  double angle = 0, elevation = 0, zoom = 1;
  std::vector<int> size{768, 768};
  std::optional<double> step;  ///< voxels
  std::string background = "#000000";
  std::optional<double> window, level;
  std::vector<double> position;  ///< LPS mm that slices go through; empty: the middle
  std::vector<std::string> overlays;
  bool plain = false;
  int turntable = 0, frames = 0;  ///< pictures
  double rate = 12;               ///< of them a second, in .mp4 and .gif
};

/// Size, voxels, and spacing, mm, of the phantom that the viewer shows by itself: small enough for a laptop.
inline constexpr std::int64_t kDemoSize[] = {256, 256, 150};
inline constexpr double kDemoSpacing[] = {1.6, 1.6, 2};

struct ViewOptions {
  CommonOptions common;
  InputOptions input;
  bool demo = false;  ///< the built-in phantom instead of INPUT
  std::filesystem::path scenario, labels;
  /// Shown instead of what a hand does. Its cell size is that of the simulated lattice too; empty: that of the
  /// scenario, or as many voxels as is quick enough.
  FieldArguments field;
  std::vector<std::string> sequence;              ///< instead: fields, one a frame
  std::filesystem::path output = "tetwarp-view";  ///< folder of what is saved
  int port = 0;                                   ///< 0: one that is free
  bool no_open = false;
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;  ///< of CUDA
};

/// Parses the command line and runs the subcommand. @return the exit status (docs/reference/exit-status.md)
int run_command_line(int argc, char** argv);

int run_phantom(const PhantomOptions& options);
int run_info(const InfoOptions& options);
int run_field(const FieldCommandOptions& options);
int run_invert(const InvertOptions& options);
int run_deform(const DeformOptions& options);
int run_simulate(const SimulateOptions& options);
int run_batch(const BatchOptions& options);
int run_render(const RenderOptions& options);
int run_view(const ViewOptions& options);
int run_truth(const TruthOptions& options);
int run_score(const ScoreOptions& options);

/// Becomes the program tetwarp-bench that lies beside this one; returns only by an exception.
/// @param arguments  given to it as they are
/// @throws Error when it is not there or cannot be run
int run_bench(const std::vector<std::string>& arguments);

}  // namespace tetwarp::apps
