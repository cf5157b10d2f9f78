// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// tetwarp-bench: what the paper compares, what a deformation and its inverse cost on a GPU and on the CPU, simulations,
// files, and filters beside ITK's.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <list>
#include <new>

#include "bench/harness/options.h"
#include "deform/render/transfer_function.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

constexpr int kFailed = 1, kWrongCommandLine = 2, kInputRefused = 4;
constexpr int kMost = 1000000;

class Command;

/// What a subcommand is made of.
struct Family {
  const char *name, *text, *example;
  int (*measure)(const Options&);
  void (*add_options)(Command&);
};

/// A subcommand, whose options are entered into `options` when the command line is read.
class Command {
 public:
  Command(CLI::App& app, const Family& family)
      : options(default_options(family.name)),
        run_(family.measure),
        command_(*app.add_subcommand(family.name, family.text)) {
    command_.footer(std::string("Example: tetwarp bench ") + family.example);
    family.add_options(*this);
  }
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  template <class Value>
  CLI::Option* add(const std::string& name, Value& value, const std::string& text, const CLI::Validator& allowed) {
    return command_.add_option(name, value, text)->check(allowed)->capture_default_str();
  }
  /// An option of several values, as in wave,twist.
  template <class Value>
  void list(const std::string& name, std::vector<Value>& values, const std::string& text,
            const CLI::Validator& allowed) {
    add(name, values, text, allowed)->delimiter(',')->allow_extra_args(false);
  }
  /// Names of those that there are unless told otherwise.
  void names(const std::string& name, std::vector<std::string>& values, const std::string& text) {
    list(name, values, text, CLI::IsMember(values));
  }
  /// "4,8,16", "none" or nothing.
  void cells_or_none(const std::string& text) {
    for (const std::int64_t size : options.cell_sizes) cells_ += (cells_.empty() ? "" : ",") + std::to_string(size);
    command_.add_option("--cell-sizes", cells_, text)->capture_default_str();
  }
  /// Those of the fields; there is one at least.
  void cells(const std::string& text) { list("--cell-sizes", options.cell_sizes, text, CLI::Range(1, 1000)); }
  void phantom(const std::string& what, int least_width, int most_width, int least_slices = 2,
               const std::string& slices = "Slices of the phantom") {
    add("--slices", options.input.slices.front(), slices, CLI::Range(least_slices, 100000));
    add("--width", options.input.width, "Columns and rows of the " + what, CLI::Range(least_width, most_width));
  }
  void input() {
    auto* path =
        command_.add_option("INPUT", options.input.path,
                            "Folder of DICOM files, or .nii .nii.gz .nrrd .mha, int16, instead of the phantom");
    command_
        .add_option("--series", options.input.series, "Series Instance UID, or the number that `tetwarp info` prints")
        ->type_name("UID")
        ->needs(path);
    auto* raw = command_.add_option("--raw", options.input.raw, "int16 voxels, little endian, no header")
                    ->type_name("FILE")
                    ->excludes(path);
    auto* size = command_.add_option("--size", options.input.size, "Columns, rows and slices of --raw")
                     ->expected(3)
                     ->delimiter(',')
                     ->check(CLI::PositiveNumber)
                     ->needs(raw);
    raw->needs(size);
    list("--slices", options.input.slices, "Slices of the phantoms", CLI::Range(2, 100000));
    add("--width", options.input.width, "Columns and rows of the phantoms", CLI::Range(2, 100000));
  }
  void frames() {
    add("--frames", options.frames, "Timed frames", CLI::Range(1, kMost));
    add("--warmup", options.warmup, "Frames before them", CLI::Range(0, kMost));
  }
  void repeats(const std::string& text) { add("--repeats", options.repeats, text, CLI::Range(1, kMost)); }
  void threads(const std::string& text) { add("--threads", options.threads, text, CLI::NonNegativeNumber); }
  void device() { add("--device", options.device, "CUDA device", CLI::NonNegativeNumber); }
  void folder(const std::string& text) {
    command_.add_option("--folder", options.folder, text)->type_name("DIR")->check(CLI::ExistingDirectory);
  }
  void file(const std::string& name, std::filesystem::path& path, const std::string& text) {
    command_.add_option(name, path, text)->type_name("FILE");
  }
  void flag(const std::string& name, bool& value, const std::string& text) { command_.add_flag(name, value, text); }
  /// What comes of the numbers. @param every  that --verbose tells of
  void results(const std::string& every, bool has_floors = true) {
    file("--json", options.json, "Every number, as JSON");
    if (has_floors) flag("--check", options.check, "Exit with 1 where a floor is missed");
    flag("--verbose", options.verbose, "A line on standard error for every " + every);
  }
  CLI::App& cli() { return command_; }

  int run() {
    if (!cells_.empty()) options.cell_sizes = parse_cells();
    return run_(options);
  }

  Options options;

 private:
  std::vector<std::int64_t> parse_cells() const {
    std::vector<std::int64_t> sizes;
    if (cells_ == "none") return sizes;
    for (const std::string& word : CLI::detail::split(cells_, ',')) {
      std::int64_t size = 0;
      if (!CLI::detail::lexical_cast(word, size) || size < 2 || size > 1000)
        throw UsageError("--cell-sizes " + cells_ + "; expected whole numbers from 2 to 1000, as in 4,8,16");
      sizes.push_back(size);
    }
    return sizes;
  }

  int (*run_)(const Options&);
  CLI::App& command_;
  std::string cells_;  ///< as they were typed
};

void add_paper(Command& command) {
  Options& options = command.options;
  command.input();
  command.names("--fields", options.fields,
                "Deformations. The paper's as written (-paper-) run on one volume, their waves on all, in the kernel");
  command.names("--methods", options.methods,
                "Methods on cells of one voxel; -per-voxel: the compiler may not move the inverse out of the loop over "
                "voxels");
  command.cells_or_none("Cells of the coarse table (paper, gascon, tetwarp); none: no such table");
  command.frames();
  command.add("--backend", options.backend, "cpu: the same loops in plain C++, sampling in software",
              CLI::IsMember({"auto", "cuda", "cpu"}));
  command.device();
  command.threads("Threads; 0 is all");
  command.results("run", false);
  command.file("--csv", options.csv, "Every number, a line a run");
}

void add_gpu(Command& command) {
  command.input();
  command.names("--fields", command.options.fields, "Deformations");
  command.cells_or_none("Larger cells, voxels; none: cells of one voxel only");
  command.frames();
  command.device();
  command.results("step");
}

void add_cpu(Command& command) {
  Options& options = command.options;
  command.names("--fields", options.fields, "Deformations");
  command.list("--peers", options.peers, "What is measured beside Tetwarp; none: nothing",
               CLI::IsMember({"paper", "itk-warp", "itk-invert", "vtk-probe", "none"}));
  command.cells_or_none("Larger cells, voxels; none: cells of one voxel only");
  command.phantom("phantoms", 8, 100000);
  command.add("--slow-slices", options.slow_slices, "Slices of the phantom for itk-invert and vtk-probe",
              CLI::Range(2, 100000));
  command.threads("Threads of everything; 0 is all");
  command.repeats("Timed repeats; itk-invert and vtk-probe run once");
  command.results("step");
}

void add_invert(Command& command) {
  command.names("--fields", command.options.fields,
                "Fields with a known inverse, and one that folds: what has no source there is known");
  command.list("--peers", command.options.peers,
               "InvertDisplacementField with its defaults, without its boundary condition, "
               "IterativeInverseDisplacementField; none: nothing beside Tetwarp",
               CLI::IsMember({"itk-invert", "itk-invert-free", "itk-iterative", "none"}));
  command.phantom("field", 8, 100000, 2, "Slices of the field, a vertex on every voxel");
  command.threads("Threads of everything; 0 is all");
  command.repeats("Timed repeats; the median counts");
  command.results("run");
}

void add_io(Command& command) {
  command.phantom("phantom", 2, 4096);
  command.names("--steps", command.options.steps, "DICOM series in and out, .nii.gz, the whole job");
  command.cells("Cells of the fields of the whole jobs, voxels");
  command.threads("Threads; 0 is all");
  command.repeats("Repeats; the median counts");
  command.folder(
      "Where a folder for about 12 bytes a voxel of files is made, removed at the end (default: the "
      "system's folder for temporary files)");
  command.results("step");
}

void add_itk(Command& command) {
  command.names("--tasks", command.options.tasks, "Warps by pull and forward fields, inverses, and so on");
  command.names("--fields", command.options.fields, "Fields whose inverse and determinant are known");
  command.cells("Cells of the fields of pull, forward and invert, voxels");
  command.phantom("phantom", 8, 100000, 8);
  command.threads("Threads of everything; 0 is all");
  command.repeats("Repeats; the median counts");
  command.folder(
      "Where a folder for the files is made, and removed at the end (2.1 GB by default; the system's "
      "folder for temporary files)");
  command.results("run");
}

void add_simulate(Command& command) {
  Options& options = command.options;
  command.cli()
      .add_option("SCENARIO", options.scenario, "JSON; its first phase is simulated, by every method")
      ->required();
  command.names("--methods", options.methods, "Methods");
  command.list("--backends", options.backends, "Where: cpu, cuda", CLI::IsMember({"cpu", "cuda"}));
  command.phantom("phantom", 2, 100000);
  command.frames();
  command.add("--steps", options.steps_a_frame, "Steps that a frame may take", CLI::Range(0, kMost));
  command.add("--deadband", options.deadband_mm, "Vertices that move less stay where they are shown, mm",
              CLI::Range(0.0, 10.0));
  command.cli()
      .add_option("--render", options.render, "Make a picture of each frame, of W,H pixels")
      ->expected(2)
      ->delimiter(',')
      ->check(CLI::Range(16, 8192))
      ->type_name("W,H");
  command.add("--transfer", options.transfer, "Transfer function of the pictures",
              CLI::IsMember(transfer_function_names()));
  command.threads("Threads of the CPU; 0 is all");
  command.device();
  command.results("step");
}

constexpr Family kFamilies[] = {
    {"paper", "The tables of the paper, with Tetwarp beside its methods",
     "paper --slices 300 --fields twist --json twist.json", run_paper, add_paper},
    {"gpu", "What a frame costs on a GPU, and the floors that it should reach",
     "gpu --slices 300 --fields wave,elastic --json gpu.json", run_gpu, add_gpu},
    {"cpu", "What a deformation costs on the CPU, and the floors that it should reach",
     "cpu --slices 100 --fields wave,elastic --threads 2 --json cpu.json", run_cpu, add_cpu},
    {"invert", "The inverse displacement field on the CPU against ITK's inverters, and the floors to reach",
     "invert --fields wave,bubble --repeats 1 --json invert.json", run_invert, add_invert},
    {"io", "What files cost beside ITK and DCMTK, and the floors to reach", "io --repeats 5 --json io.json", run_io,
     add_io},
    {"itk", "Filters for ITK's pipelines beside ITK's own: time, memory and error, and in pieces",
     "itk --slices 60 --repeats 1 --json itk.json", run_itk, add_itk},
    {"simulate", "What chainmail and mass-spring cost on a phantom: until they have settled, and frame by frame",
     "simulate examples/scenarios/diaphragm_push.json --json simulate.json", run_simulate, add_simulate},
};

int run_command_line(int argc, char** argv) {
  CLI::App app("Time Tetwarp and what it is compared with, and say what each result is worth");
  app.name("tetwarp-bench");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("tetwarp-bench ") + version() + " (" + commit() + ")");
  std::list<Command> commands;
  for (const Family& family : kFamilies) commands.emplace_back(app, family);
  // How `itk` runs this program again. In no help: it asks for what `itk` alone can write.
  std::filesystem::path alone;
  CLI::App* itk_alone = app.add_subcommand("itk-alone")->group("");
  itk_alone->add_option("FOLDER", alone)->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::Error& error) {
    throw UsageError(std::string(error.what()) + "; see tetwarp-bench --help");
  }
  if (itk_alone->parsed()) return run_itk_alone(alone);
  for (Command& command : commands)
    if (command.cli().parsed()) return command.run();
  throw UsageError("no subcommand");
}

int fail(int status, const char* what) {
  std::fprintf(stderr, "tetwarp-bench: error: %s\n", what);
  return status;
}

}  // namespace

}  // namespace tetwarp::bench

int main(int argc, char** argv) {
  using namespace tetwarp;
  using namespace tetwarp::bench;
  try {
    const int status = run_command_line(argc, argv);
    std::cout.flush();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) || !std::cout) {
      throw Error("standard output cannot be written; is the disk full?");
    }
    return status;
  } catch (const UsageError& error) {
    return fail(kWrongCommandLine, error.what());
  } catch (const InputError& error) {
    return fail(kInputRefused, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kFailed, "not enough memory; try smaller --slices or --width");
  } catch (const std::exception& error) {
    return fail(kFailed, error.what());
  }
}
