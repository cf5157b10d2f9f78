// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/errors.h"

namespace tetwarp::bench {

/// The command line is wrong: exit status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

constexpr std::uint64_t kPhantomSeed = 1;

/// The volume that is deformed, or phantoms of several lengths.
struct InputOptions {
  std::filesystem::path path = {};           ///< DICOM folder, .nii .nii.gz .nrrd .mha; empty: phantom or `raw`
  std::string series = {};                   ///< UID, or the number that `tetwarp info` prints
  std::filesystem::path raw = {};            ///< int16, little endian, no header
  std::vector<std::int64_t> size = {};       ///< of `raw`
  std::int64_t width = 512;                  ///< columns and rows of the phantom
  std::vector<std::int64_t> slices = {300};  ///< of the phantoms

  bool is_phantom() const { return path.empty() && raw.empty(); }
  glm::i64vec3 phantom_size() const { return {width, width, slices.front()}; }
};

/// What the command line says. Every family of measurements reads what is its own, and begins with `default_options`.
struct Options {
  InputOptions input = {};
  std::vector<std::string> fields = {}, methods = {}, peers = {}, steps = {}, tasks = {}, backends = {};
  std::vector<std::int64_t> cell_sizes = {};
  std::int64_t slow_slices = 40;  ///< of the volume for peers that take minutes
  int frames = 50, warmup = 3;    ///< timed, and before them
  int repeats = 3;
  int steps_a_frame = 2;  ///< that a simulation may take
  double deadband_mm = 0;
  std::string backend = "auto";
  int threads = 0;  ///< 0: all
  int device = 0;   ///< of CUDA
  std::filesystem::path scenario = {};
  std::vector<int> render = {};  ///< pixels of the picture of each frame, W and H; empty: none is rendered
  std::string transfer = "ct-bone";
  std::filesystem::path folder = {};  ///< where a folder for files is made, and removed at the end; empty: the system's
  std::filesystem::path json = {}, csv = {};
  bool check = false;    ///< a missed floor is a failure
  bool verbose = false;  ///< a line to standard error for every step

  bool has_field(const std::string& name) const;
  bool has_peer(const std::string& name) const;
  /// Tells of a step, where that is asked for.
  void say(const std::string& line) const;
};

/// What `tetwarp-bench FAMILY` does unless it is told otherwise.
Options default_options(const std::string& family);

// One function a family, which measures, prints and writes. @return the exit status

/// The tables of the paper.
int run_paper(const Options& options);
/// What a frame costs on a CUDA device, against other methods, copies and memory.
int run_gpu(const Options& options);
/// Files in and out beside ITK and DCMTK, from and to the page cache.
int run_io(const Options& options);
/// What a new field costs on the CPU, against the paper, ITK, VTK and memory.
int run_cpu(const Options& options);
/// The inverse displacement field on the CPU, against ITK's inverters: time, error and what has no source.
int run_invert(const Options& options);
/// Filters for ITK's pipelines beside ITK's own: time, memory and error, each in a process of its own.
int run_itk(const Options& options);
/// One measurement of `run_itk`: what `folder` asks for is run in this process, and answered there.
int run_itk_alone(const std::filesystem::path& folder);
/// What a scenario costs until it has settled, and frame by frame with resampling.
int run_simulate(const Options& options);

}  // namespace tetwarp::bench
