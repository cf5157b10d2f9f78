// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/paper/method.h"
#include "deform/errors.h"

namespace tetwarp::bench {

/// The command line is wrong: exit status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

constexpr std::uint64_t kPhantomSeed = 1;

/// What `paper` deforms: one volume, or phantoms of several lengths.
struct InputOptions {
  std::filesystem::path path = {};      ///< DICOM folder, .nii .nii.gz .nrrd .mha; empty: phantom or `raw`
  std::string series = {};              ///< UID, or the number that `tetwarp info` prints
  std::filesystem::path raw = {};       ///< int16, little endian, no header
  std::vector<std::int64_t> size = {};  ///< of `raw`
  std::int64_t width = 512;             ///< columns and rows of the phantom
  std::vector<std::int64_t> slices{141, 300, 316, 600};

  bool is_phantom() const { return path.empty() && raw.empty(); }
};

struct PaperOptions {
  InputOptions input;
  /// Ours, and the paper's as they are written: bench/paper/fields.h.
  std::vector<std::string> fields{"identity",       "wave",           "twist",         "bubble",
                                  "wave-paper-1",   "wave-paper-16",  "twist-paper-1", "twist-paper-16",
                                  "bubble-paper-1", "bubble-paper-16"};
  std::vector<Method> methods{Method::inverse4x4_double,
                              Method::inverse3x3_double,
                              Method::inverse3x3_float,
                              Method::paper,
                              Method::inverse4x4_double_per_voxel,
                              Method::inverse3x3_double_per_voxel,
                              Method::inverse3x3_float_per_voxel,
                              Method::paper_per_voxel,
                              Method::tetwarp};
  std::vector<std::int64_t> cell_sizes{4, 8, 16};  ///< of the coarse table
  int frames = 50, warmup = 3;
  std::string backend = "auto";
  int device = 0, threads = 0;
  std::filesystem::path json, csv;
  bool verbose = false;  ///< a line to standard error for every run
};

struct CpuOptions {
  std::vector<std::string> fields{"identity", "wave", "twist", "bubble", "elastic", "local"};
  std::vector<std::string> peers{"paper", "itk-warp", "itk-invert", "vtk-probe"};
  std::vector<std::int64_t> cell_sizes{4, 8, 16};  ///< beside cells of one voxel, Tetwarp alone
  std::int64_t width = 512, slices = 300;          ///< of the phantom
  std::int64_t slow_slices = 40;                   ///< of the volume for peers that take minutes
  int threads = 0, repeats = 3;
  std::filesystem::path json;
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every step
};

struct InvertOptions {
  std::vector<std::string> fields{"wave", "twist", "bubble", "folds"};
  std::vector<std::string> peers{"itk-invert", "itk-invert-free", "itk-iterative"};
  std::int64_t width = 256, slices = 150;  ///< of the lattice, vertices
  int threads = 0, repeats = 3;
  std::filesystem::path json;
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every run
};

struct GpuOptions {
  InputOptions input{.slices = {300, 600}};  ///< everything on the first volume, one field on the others
  std::vector<std::string> fields{"identity", "wave",     "twist", "bubble", "elastic",
                                  "noise",    "rotation", "folds", "local"};
  std::vector<std::int64_t> cell_sizes{4, 8, 16};  ///< beside cells of one voxel
  int frames = 15, warmup = 3, device = 0;
  std::filesystem::path json;
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every step
};

struct IoOptions {
  std::int64_t width = 512, slices = 300;  ///< of the phantom
  std::vector<std::string> steps{"in", "out", "nifti", "job"};
  std::vector<std::int64_t> cell_sizes{1, 16};  ///< of the whole jobs' fields
  int threads = 0, repeats = 5;
  std::filesystem::path folder;  ///< where a folder for the files is made, and removed at the end; empty: the system's
  std::filesystem::path json;
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every step
};

struct ItkOptions {
  std::vector<std::string> tasks{"pull", "forward", "invert", "determinant", "transform", "stream"};
  std::vector<std::string> fields{"bubble", "elastic"};
  std::vector<std::int64_t> cell_sizes{1, 4};  ///< of pull, forward and invert; determinant has 1 alone
  std::int64_t width = 512, slices = 300;      ///< of the phantom
  int threads = 0, repeats = 3;
  std::filesystem::path folder;  ///< where a folder for the files is made, and removed at the end; empty: the system's
  std::filesystem::path json;
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every run
};

struct SimulateOptions {
  std::filesystem::path scenario;  ///< JSON; its first phase is simulated, by every method
  std::vector<int> render;         ///< pixels of the picture of each frame, W and H; empty: none is rendered
  std::string transfer = "ct-bone";
  std::vector<std::string> methods{"chainmail", "mass-spring"};
  std::vector<std::string> backends{"cpu"};
  std::int64_t width = 512, slices = 300;  ///< of the phantom
  int frames = 60, warmup = 3;             ///< timed, and before them
  int steps = 2;                           ///< that a frame may take
  int threads = 0;                         ///< 0: all
  int device = 0;                          ///< of CUDA
  std::filesystem::path json;
  bool check = false, verbose = false;
};

/// The tables of the paper, to standard output. @return the exit status
int run_paper(const PaperOptions& options);
/// What a frame costs on a CUDA device, against other methods, copies and memory. @return the exit status
int run_gpu(const GpuOptions& options);
/// Files in and out beside ITK and DCMTK, from and to the page cache. @return the exit status
int run_io(const IoOptions& options);
/// What a new field costs on the CPU, against the paper, ITK, VTK and memory. @return the exit status
int run_cpu(const CpuOptions& options);
/// The inverse displacement field on the CPU, against ITK's inverters: time, error and what has no source. @return the
/// exit status
int run_invert(const InvertOptions& options);
/// Filters for ITK's pipelines beside ITK's own: time, memory and error, each in a process of its own. @return the exit
/// status
int run_itk(const ItkOptions& options);
/// One measurement of `run_itk`: what `folder` asks for is run in this process, and answered there. @return the exit
/// status
int run_itk_alone(const std::filesystem::path& folder);
/// What a scenario costs until it has settled, and frame by frame with resampling. @return the exit status
int run_simulate(const SimulateOptions& options);

}  // namespace tetwarp::bench
