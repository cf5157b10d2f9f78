// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// tetwarp-bench: what the paper compares, what a deformation and its inverse cost on a GPU and on the CPU, simulations,
// files, and filters beside ITK's.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

#include "bench/harness/options.h"
#include "deform/render/transfer_function.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

std::vector<std::string> names_of(const std::vector<Method>& methods) {
  std::vector<std::string> names;
  for (const Method method : methods) names.push_back(name_of(method));
  return names;
}

constexpr int kFailed = 1, kWrongCommandLine = 2, kInputRefused = 4;

/// As they were typed; `run` makes methods and numbers of them.
struct Words {
  std::vector<std::string> methods = names_of(PaperOptions{}.methods);
  std::string cell_sizes = "4,8,16", gpu_cell_sizes = cell_sizes, cpu_cell_sizes = cell_sizes;
};

/// What every subcommand was given.
struct Commands {
  PaperOptions paper;
  GpuOptions gpu;
  CpuOptions cpu;
  InvertOptions invert;
  IoOptions io;
  ItkOptions itk;
  std::filesystem::path itk_alone;
  SimulateOptions simulate;
  Words words;
};

/// An option of several values, as in wave,twist.
template <class Value>
void add_list(CLI::App& command, const std::string& name, std::vector<Value>& values, const std::string& text,
              const CLI::Validator& allowed) {
  command.add_option(name, values, text)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(allowed)
      ->capture_default_str();
}

void add_input(CLI::App& command, InputOptions& input) {
  auto* path = command.add_option("INPUT", input.path,
                                  "Folder of DICOM files, or .nii .nii.gz .nrrd .mha, int16, instead of the phantom");
  command.add_option("--series", input.series, "Series Instance UID, or the number that `tetwarp info` prints")
      ->type_name("UID")
      ->needs(path);
  auto* raw = command.add_option("--raw", input.raw, "int16 voxels, little endian, no header")
                  ->type_name("FILE")
                  ->excludes(path);
  auto* size = command.add_option("--size", input.size, "Columns, rows and slices of --raw")
                   ->expected(3)
                   ->delimiter(',')
                   ->check(CLI::PositiveNumber)
                   ->needs(raw);
  raw->needs(size);
  add_list(command, "--slices", input.slices, "Slices of the phantoms", CLI::Range(2, 100000));
  command.add_option("--width", input.width, "Columns and rows of the phantoms")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
}

void add_frames(CLI::App& command, int& frames, int& warmup) {
  command.add_option("--frames", frames, "Timed frames")->check(CLI::Range(1, 1000000))->capture_default_str();
  command.add_option("--warmup", warmup, "Frames before them")->check(CLI::Range(0, 1000000))->capture_default_str();
}

void add_paper(CLI::App& app, PaperOptions& options, Words& words) {
  CLI::App* command = app.add_subcommand("paper", "The tables of the paper, with Tetwarp beside its methods");
  add_input(*command, options.input);
  add_list(*command, "--fields", options.fields,
           "Deformations. The paper's as written (-paper-) run on one volume, their waves on all, in the kernel",
           CLI::IsMember(options.fields));
  add_list(
      *command, "--methods", words.methods,
      "Methods on cells of one voxel; -per-voxel: the compiler may not move the inverse out of the loop over voxels",
      CLI::IsMember(words.methods));
  command
      ->add_option("--cell-sizes", words.cell_sizes,
                   "Cells of the coarse table (paper, gascon, tetwarp); none: no such table")
      ->capture_default_str();
  add_frames(*command, options.frames, options.warmup);
  command->add_option("--backend", options.backend, "cpu: the same loops in plain C++, sampling in software")
      ->check(CLI::IsMember({"auto", "cuda", "cpu"}))
      ->capture_default_str();
  command->add_option("--device", options.device, "CUDA device")->check(CLI::NonNegativeNumber)->capture_default_str();
  command->add_option("--threads", options.threads, "Threads; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_option("--csv", options.csv, "Every number, a line a run")->type_name("FILE");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every run");
  command->footer("Example: tetwarp bench paper --slices 300 --fields twist --json twist.json");
}

void add_cpu(CLI::App& app, CpuOptions& options, std::string& cell_sizes) {
  CLI::App* command =
      app.add_subcommand("cpu", "What a deformation costs on the CPU, and the floors that it should reach");
  add_list(*command, "--fields", options.fields, "Deformations", CLI::IsMember(options.fields));
  add_list(*command, "--peers", options.peers, "What is measured beside Tetwarp; none: nothing",
           CLI::IsMember({"paper", "itk-warp", "itk-invert", "vtk-probe", "none"}));
  command->add_option("--cell-sizes", cell_sizes, "Larger cells, voxels; none: cells of one voxel only")
      ->capture_default_str();
  command->add_option("--slices", options.slices, "Slices of the phantom")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--slow-slices", options.slow_slices, "Slices of the phantom for itk-invert and vtk-probe")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--width", options.width, "Columns and rows of the phantoms")
      ->check(CLI::Range(8, 100000))
      ->capture_default_str();
  command->add_option("--threads", options.threads, "Threads of everything; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--repeats", options.repeats, "Timed repeats; itk-invert and vtk-probe run once")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every step");
  command->footer("Example: tetwarp bench cpu --slices 100 --fields wave,elastic --threads 2 --json cpu.json");
}

void add_invert(CLI::App& app, InvertOptions& options) {
  CLI::App* command = app.add_subcommand(
      "invert", "The inverse displacement field on the CPU against ITK's inverters, and the floors to reach");
  add_list(*command, "--fields", options.fields,
           "Fields with a known inverse, and one that folds: what has no source there is known",
           CLI::IsMember(options.fields));
  add_list(*command, "--peers", options.peers,
           "InvertDisplacementField with its defaults, without its boundary condition, "
           "IterativeInverseDisplacementField; none: nothing beside Tetwarp",
           CLI::IsMember({"itk-invert", "itk-invert-free", "itk-iterative", "none"}));
  command->add_option("--slices", options.slices, "Slices of the field, a vertex on every voxel")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--width", options.width, "Columns and rows of the field")
      ->check(CLI::Range(8, 100000))
      ->capture_default_str();
  command->add_option("--threads", options.threads, "Threads of everything; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--repeats", options.repeats, "Timed repeats; the median counts")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every run");
  command->footer("Example: tetwarp bench invert --fields wave,bubble --repeats 1 --json invert.json");
}

void add_gpu(CLI::App& app, GpuOptions& options, std::string& cell_sizes) {
  CLI::App* command = app.add_subcommand("gpu", "What a frame costs on a GPU, and the floors that it should reach");
  add_input(*command, options.input);
  add_list(*command, "--fields", options.fields, "Deformations", CLI::IsMember(options.fields));
  command->add_option("--cell-sizes", cell_sizes, "Larger cells, voxels; none: cells of one voxel only")
      ->capture_default_str();
  add_frames(*command, options.frames, options.warmup);
  command->add_option("--device", options.device, "CUDA device")->check(CLI::NonNegativeNumber)->capture_default_str();
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every step");
  command->footer("Example: tetwarp bench gpu --slices 300 --fields wave,elastic --json gpu.json");
}

void add_io(CLI::App& app, IoOptions& options) {
  CLI::App* command = app.add_subcommand("io", "What files cost beside ITK and DCMTK, and the floors to reach");
  command->add_option("--slices", options.slices, "Slices of the phantom")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--width", options.width, "Columns and rows of the phantom")
      ->check(CLI::Range(2, 4096))
      ->capture_default_str();
  add_list(*command, "--steps", options.steps, "DICOM series in and out, .nii.gz, the whole job",
           CLI::IsMember(options.steps));
  add_list(*command, "--cell-sizes", options.cell_sizes, "Cells of the fields of the whole jobs, voxels",
           CLI::Range(1, 1000));
  command->add_option("--threads", options.threads, "Threads; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--repeats", options.repeats, "Repeats; the median counts")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command
      ->add_option("--folder", options.folder,
                   "Where a folder for about 12 bytes a voxel of files is made, removed at the end (default: the "
                   "system's folder for temporary files)")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every step");
  command->footer("Example: tetwarp bench io --repeats 5 --json io.json");
}

void add_itk(CLI::App& app, ItkOptions& options) {
  CLI::App* command =
      app.add_subcommand("itk", "Filters for ITK's pipelines beside ITK's own: time, memory and error, and in pieces");
  add_list(*command, "--tasks", options.tasks, "Warps by pull and forward fields, inverses, and so on",
           CLI::IsMember(options.tasks));
  add_list(*command, "--fields", options.fields, "Fields whose inverse and determinant are known",
           CLI::IsMember(options.fields));
  add_list(*command, "--cell-sizes", options.cell_sizes, "Cells of the fields of pull, forward and invert, voxels",
           CLI::Range(1, 1000));
  command->add_option("--slices", options.slices, "Slices of the phantom")
      ->check(CLI::Range(8, 100000))
      ->capture_default_str();
  command->add_option("--width", options.width, "Columns and rows of the phantom")
      ->check(CLI::Range(8, 100000))
      ->capture_default_str();
  command->add_option("--threads", options.threads, "Threads of everything; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--repeats", options.repeats, "Repeats; the median counts")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command
      ->add_option("--folder", options.folder,
                   "Where a folder for the files is made, and removed at the end (2.1 GB by default; the system's "
                   "folder for temporary files)")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every run");
  command->footer("Example: tetwarp bench itk --slices 60 --repeats 1 --json itk.json");
}

/// How `itk` runs this program again. In no help: it asks for what `itk` alone can write.
void add_itk_alone(CLI::App& app, std::filesystem::path& folder) {
  app.add_subcommand("itk-alone")->group("")->add_option("FOLDER", folder)->required();
}

void add_simulate(CLI::App& app, SimulateOptions& options) {
  CLI::App* command = app.add_subcommand(
      "simulate", "What chainmail and mass-spring cost on a phantom: until they have settled, and frame by frame");
  command->add_option("SCENARIO", options.scenario, "JSON; its first phase is simulated, by every method")->required();
  add_list(*command, "--methods", options.methods, "Methods", CLI::IsMember(options.methods));
  add_list(*command, "--backends", options.backends, "Where: cpu, cuda", CLI::IsMember({"cpu", "cuda"}));
  command->add_option("--slices", options.slices, "Slices of the phantom")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--width", options.width, "Columns and rows of the phantom")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  add_frames(*command, options.frames, options.warmup);
  command->add_option("--steps", options.steps, "Steps that a frame may take")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  command->add_option("--render", options.render, "Make a picture of each frame, of W,H pixels")
      ->expected(2)
      ->delimiter(',')
      ->check(CLI::Range(16, 8192))
      ->type_name("W,H");
  command->add_option("--transfer", options.transfer, "Transfer function of the pictures")
      ->check(CLI::IsMember(transfer_function_names()))
      ->capture_default_str();
  command->add_option("--threads", options.threads, "Threads of the CPU; 0 is all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--device", options.device, "CUDA device")->check(CLI::NonNegativeNumber)->capture_default_str();
  command->add_option("--json", options.json, "Every number, as JSON")->type_name("FILE");
  command->add_flag("--check", options.check, "Exit with 1 where a floor is missed");
  command->add_flag("--verbose", options.verbose, "A line on standard error for every step");
  command->footer("Example: tetwarp bench simulate examples/scenarios/diaphragm_push.json --json simulate.json");
}

/// "4,8,16", "none" or nothing.
std::vector<std::int64_t> parse_cell_sizes(const std::string& text) {
  std::vector<std::int64_t> sizes;
  if (text.empty() || text == "none") return sizes;
  for (const std::string& word : CLI::detail::split(text, ',')) {
    std::int64_t size = 0;
    if (!CLI::detail::lexical_cast(word, size) || size < 2 || size > 1000) {
      throw UsageError("--cell-sizes " + text + "; expected whole numbers from 2 to 1000, as in 4,8,16");
    }
    sizes.push_back(size);
  }
  return sizes;
}

void add_subcommands(CLI::App& app, Commands& commands) {
  add_paper(app, commands.paper, commands.words);
  add_gpu(app, commands.gpu, commands.words.gpu_cell_sizes);
  add_cpu(app, commands.cpu, commands.words.cpu_cell_sizes);
  add_invert(app, commands.invert);
  add_io(app, commands.io);
  add_itk(app, commands.itk);
  add_itk_alone(app, commands.itk_alone);
  add_simulate(app, commands.simulate);
}

/// Runs the subcommand that was given.
int run(const CLI::App& app, Commands& commands) {
  const Words& words = commands.words;
  if (app.got_subcommand("cpu")) {
    commands.cpu.cell_sizes = parse_cell_sizes(words.cpu_cell_sizes);
    return run_cpu(commands.cpu);
  }
  if (app.got_subcommand("invert")) return run_invert(commands.invert);
  if (app.got_subcommand("io")) return run_io(commands.io);
  if (app.got_subcommand("itk")) return run_itk(commands.itk);
  if (app.got_subcommand("itk-alone")) return run_itk_alone(commands.itk_alone);
  if (app.got_subcommand("simulate")) return run_simulate(commands.simulate);
  if (app.got_subcommand("gpu")) {
    commands.gpu.cell_sizes = parse_cell_sizes(words.gpu_cell_sizes);
    return run_gpu(commands.gpu);
  }
  PaperOptions& paper = commands.paper;
  paper.methods.clear();
  for (const std::string& name : words.methods) paper.methods.push_back(parse_method(name));
  paper.cell_sizes = parse_cell_sizes(words.cell_sizes);
  return run_paper(paper);
}

int run_command_line(int argc, char** argv) {
  CLI::App app("Time Tetwarp and what it is compared with, and say what each result is worth");
  app.name("tetwarp-bench");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("tetwarp-bench ") + version() + " (" + commit() + ")");
  Commands commands;
  add_subcommands(app, commands);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::Error& error) {
    throw UsageError(std::string(error.what()) + "; see tetwarp-bench --help");
  }
  return run(app, commands);
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
