// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <map>
#include <string_view>

#include <tbb/global_control.h>

#include "apps/cli/command_line.h"
#include "apps/cli/option_groups.h"
#include "backend/backend.h"
#include "deform/version.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// A lattice with larger cells has one cell an axis, of whatever volume.
constexpr std::int64_t kMostCellSize = 65536;

/// The options of every subcommand; one of them was given.
struct Commands {
  PhantomOptions phantom;
  InfoOptions info;
  FieldCommandOptions field;
  InvertOptions invert;
  DeformOptions deform;
  SimulateOptions simulate;
  BatchOptions batch;
  RenderOptions render;
};

void add_dicom_form(CLI::App& command, DicomForm& form) {
  command
      .add_option("--transfer-syntax", form.encoding,
                  "Of a DICOM series: explicit (default), deflated, rle or jpeg-ls; all without loss")
      ->transform(one_of<DicomEncoding>({{"explicit", DicomEncoding::uncompressed},
                                         {"deflated", DicomEncoding::deflated},
                                         {"rle", DicomEncoding::rle},
                                         {"jpeg-ls", DicomEncoding::jpeg_ls}}))
      ->type_name("NAME");
  command.add_flag(
      "--keep-frame-of-reference", form.keep_frame_of_reference,
      "A DICOM series keeps INPUT's Frame of Reference UID although it is deformed: viewers overlay the two");
  command.add_option("--series-number", form.series_number, "Of a DICOM series (default: INPUT's + 1000)")
      ->check(whole_number(0, 2147483647));
  command
      .add_option("--series-description", form.series_description,
                  "Of a DICOM series, at most 64 characters (default: \"deformed: \" and INPUT's)")
      ->type_name("TEXT");
}

std::set<ConfidentialityOption> confidentiality_options_of(const std::string& text) {
  try {
    return confidentiality_options(text);
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

void add_deidentify(CLI::App& command, DeformOptions& options) {
  const auto chosen = [&form = options.dicom]() -> Deidentification& {
    if (!form.deidentification) form.deidentification.emplace();
    return *form.deidentification;
  };
  auto* what = command
                   .add_option_function<std::string>(
                       "--deidentify",
                       [chosen](const std::string& text) { chosen().options = confidentiality_options_of(text); },
                       "A DICOM series by the Basic Profile of PS3.15: basic, or retain-dates, shift-dates, "
                       "retain-device, retain-institution, retain-patient, retain-uids, separated by commas; looks "
                       "neither at text in pixels nor at faces")
                   ->type_name("OPTIONS");
  auto* key = command
                  .add_option_function<std::string>(
                      "--deidentify-key",
                      [chosen, &options](const std::string& file) {
                        options.deidentify_key = file;
                        chosen().key = read_deidentification_key(file);
                      },
                      "File with a secret of 16 bytes or more, of which new UIDs, patient IDs and dates are made: one "
                      "for all series that belong together")
                  ->type_name("FILE");
  what->needs(key);
  key->needs(what);
}

void add_phantom(CLI::App& app, PhantomOptions& options) {
  CLI::App* command = app.add_subcommand("phantom", "Make a CT of a trunk that never was");
  command->add_option("-o,--output", options.output, "A folder (DICOM series), or .nii .nii.gz .nrrd .mha")->required();
  command->add_option("--size", options.size, "Voxels along i, j, k")
      ->expected(3)
      ->delimiter(',')
      ->check(whole_number(2, 4096))
      ->capture_default_str();
  command->add_option("--spacing", options.spacing, "Millimetres along i, j, k")
      ->expected(3)
      ->delimiter(',')
      ->check(positive_number())
      ->capture_default_str();
  command->add_option("--seed", options.seed, "Noise and small variations of the anatomy")
      ->check(whole_number(0, INT64_MAX))
      ->capture_default_str();
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp phantom -o phantom_dicom --size 512,512,100 --spacing 0.8,0.8,3");
}

void add_info(CLI::App& app, InfoOptions& options) {
  CLI::App* command = app.add_subcommand("info", "Say what an input, a field, a mesh or a transform file holds");
  command->add_option("INPUT", options.input.path, std::string(kInputHelp) + ", or a field, mesh or transform file")
      ->required();
  command->add_flag("--single", options.input.single, "Look at the one DICOM file alone, not its series");
  add_nifti_frame(*command, options.common, options.input);
  command->add_flag("--json", options.json, "One JSON document on standard output");
  add_common(*command, options.common, false);
  command->footer("Example: tetwarp info study_folder");
}

void add_field(CLI::App& app, FieldCommandOptions& options) {
  CLI::App* command = app.add_subcommand("field", "Write a field as a file");
  command->add_option("FIELD", options.field.forward, kFieldHelp)->required();
  command->add_option("--like", options.like.path, "The volume that the field is for")->required();
  command->add_option("-o,--output", options.output, ".mha .nrrd .nii .nii.gz, three components, LPS mm")->required();
  command
      ->add_option("--cell-size", options.field.cell_size,
                   "Vertices every B voxels, for formulas and transforms only (default 1)")
      ->check(whole_number(1, kMostCellSize))
      ->type_name("B");
  add_series(*command, options.like);
  add_nifti_frame(*command, options.common, options.like);
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp field twist:angle=30 --like ct.nii.gz -o twist.mha --cell-size 4");
}

void add_invert(CLI::App& app, InvertOptions& options) {
  CLI::App* command = app.add_subcommand("invert", "Write the inverse of a field");
  auto* field = command->add_option("FIELD", options.field.forward, kFieldHelp);
  command
      ->add_option(
          "--pull-field", options.field.pull,
          "Instead of FIELD: a field that maps output to input. Its inverse is a forward field, with a vertex at "
          "every voxel of --like, the volume that the field takes values from; beyond its grid the field goes on "
          "with its outermost samples")
      ->type_name("FILE")
      ->excludes(field);
  command->add_option("--like", options.like.path, "The volume on whose grid the inverse is sampled")->required();
  command
      ->add_option("-o,--output", options.output,
                   ".mha .nrrd .nii .nii.gz: output to input, LPS mm, for ITK's and other warps; NaN where nothing "
                   "maps; or .dcm, where --like is a DICOM series: a Deformable Spatial Registration. Of a pull "
                   "field: forward, for -f")
      ->required();
  command
      ->add_option("--cell-size", options.field.cell_size,
                   "Vertices every B voxels, for formulas and transforms only (default 1)")
      ->check(whole_number(1, kMostCellSize))
      ->type_name("B");
  add_backend(*command, options.backend, options.device);
  command->add_option("--report", options.report, "Residuals both ways, with times, as JSON")->type_name("FILE.json");
  add_series(*command, options.like);
  add_nifti_frame(*command, options.common, options.like);
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp invert twist:angle=30 --like ct.nii.gz -o inverse.mha");
}

void add_deform(CLI::App& app, DeformOptions& options) {
  CLI::App* command = app.add_subcommand("deform", "Deform a volume");
  command->add_option("INPUT", options.input.path, kInputHelp)->required();
  auto* field =
      command->add_option("-f,--field", options.field.forward, kFieldHelp)->allow_extra_args(false)->type_name("FIELD");
  command
      ->add_option("--pull-field", options.field.pull,
                   "A field that maps output to input, as registration tools write it (files as for -f, and a "
                   "DICOM Deformable Spatial Registration, FILE:item=N where it has several); NaN in it: no source. Or "
                   "a transform of ITK, elastix, plastimatch (.h5 .tfm .txt) or NiftyReg (its B-spline): "
                   "output p comes from T(p)")
      ->type_name("FILE")
      ->excludes(field);
  command
      ->add_option(
          "--scenario", options.scenario,
          "Simulate the field as `simulate` does, of a page of scenario (docs/guide/simulate.md); INPUT is a CT in HU")
      ->type_name("FILE.json");
  command->add_option("--labels", options.labels, "Label volume on the grid of INPUT, for the tissues of --scenario")
      ->type_name("FILE");
  command
      ->add_option("--write-field", options.write_field,
                   "The forward field that was used: .mha .nrrd .nii .nii.gz, or a mesh, .vtu .vtk")
      ->type_name("FILE");
  command
      ->add_option("-o,--output", options.output,
                   "A folder (DICOM series; INPUT must be DICOM), or .nii .nii.gz .nrrd .mha")
      ->required();
  add_series(*command, options.input);
  add_nifti_frame(*command, options.common, options.input);
  add_backend(*command, options.backend, options.device);
  command
      ->add_option("--interpolation", options.interpolation, "linear (default), nearest or cubic; vote for label maps")
      ->transform(one_of<Interpolation>({{"nearest", Interpolation::nearest},
                                         {"linear", Interpolation::linear},
                                         {"cubic", Interpolation::cubic},
                                         {"vote", Interpolation::vote}}))
      ->type_name("NAME");
  add_outside(*command, options.outside);
  command
      ->add_option(
          "--background", options.background,
          "Value where nothing maps (default: DICOM padding value or -1024 HU; else the smallest value present)")
      ->check(finite_number());
  command
      ->add_option("--cell-size", options.field.cell_size,
                   "Vertices every B voxels, for formulas and transforms only (default 1)")
      ->check(whole_number(1, kMostCellSize))
      ->type_name("B");
  command
      ->add_option("--grid", options.grid,
                   "Output grid: INPUT's (same), INPUT's grown to hold the deformed lattice (fit), or that of a volume")
      ->type_name("same|fit|FILE")
      ->capture_default_str();
  command
      ->add_option_function<std::string>(
          "--preserve", [&options](const std::string&) { options.preserve_mass = true; },
          "mass: INPUT is a CT in HU, and its density (HU + 1000) is divided by the Jacobian determinant")
      ->check(CLI::IsMember({"mass"}))
      ->type_name("mass");
  command
      ->add_option(
          "--with", options.with,
          "Another volume through the same field, from its own grid onto the output grid, or back onto its own. An "
          "RTDOSE or SEG comes out as one where OUT is .dcm, an RT Structure Set always does; they refer to the series "
          "that OUTPUT receives. May be repeated")
      ->allow_extra_args(false)
      ->type_name("IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]");
  command
      ->add_option(
          "--memory", options.memory_bytes,
          "8G, 2.5G, 500M. On the CPU: refuse to start if more is needed. On a CUDA device: volumes and field there "
          "take no more, what does not fit is streamed in slabs; 10 % or 128 MB of working space come on top")
      ->transform(size_in_bytes())
      ->type_name("SIZE");
  command->add_option("--compress", options.compression, "Level 0 to 9 for .nii.gz (default 1) .nrrd .mha (default 0)")
      ->check(whole_number(0, 9));
  add_dicom_form(*command, options.dicom);
  add_deidentify(*command, options);
  command->add_flag(
      "--bids", options.bids,
      "Write STEM.json beside OUTPUT STEM.nii.gz or STEM.nii, of a CT series: scanner and protocol with the "
      "names of BIDS, without patient, institution and dates");
  command
      ->add_option("--points", options.points,
                   "Landmarks or a surface, moved as the voxels under them: .csv (header x,y,z; LPS mm), .mrk.json, "
                   ".fcsv, .stl, .obj or .vtk, OUT of the same form and frame. :lps or :ras is the frame of a file "
                   "that does not say. May be repeated; not with --pull-field")
      ->allow_extra_args(false)
      ->type_name("IN=OUT[:lps|:ras]");
  command->add_option("--coverage", options.maps.coverage, "Mask of the voxels that got a value through the field")
      ->type_name("FILE");
  command
      ->add_option("--inverse", options.maps.inverse,
                   "Inverse displacement, LPS mm, for ITK's and other warps; NaN where nothing maps. FILE.dcm, where "
                   "OUTPUT is a DICOM series: a Deformable Spatial Registration from it to INPUT")
      ->type_name("FILE");
  command
      ->add_option("--jacobian", options.maps.jacobian,
                   "Jacobian determinant of the forward map, negative where it folds; NaN where nothing maps")
      ->type_name("FILE");
  command->add_option("--folds", options.maps.folds, "How many tetrahedra own each voxel: more than 1 is a fold")
      ->type_name("FILE");
  command->add_option("--report", options.report, "What happened, with times, as JSON")->type_name("FILE.json");
  command->add_option("--preview", options.preview, "Three slices before, after and their difference")
      ->type_name("FILE.png");
  command->add_flag("--dry-run", options.dry_run, "Check everything and say what would be done");
  add_common(*command, options.common, true);
  command->footer(
      "Example: tetwarp deform ct_folder -f wave:amplitude=8,wavelength=64 -o deformed_dicom --preview look.png");
}

void add_simulate(CLI::App& app, SimulateOptions& options) {
  CLI::App* command = app.add_subcommand("simulate", "Make a field: what happens to a volume in a scenario");
  command->add_option("SCENARIO", options.scenario, "What is held, moved and cut, as JSON (docs/reference/scenario.md)")
      ->required();
  command->add_option("INPUT", options.input.path, std::string(kInputHelp) + "; a CT in HU")->required();
  command->add_option("-o,--output", options.output, ".mha .nrrd .nii .nii.gz: a forward field, for -f of deform")
      ->required();
  command->add_option("--labels", options.labels, "Label volume on the grid of INPUT, for tissues and regions by label")
      ->type_name("FILE");
  command
      ->add_option("--every", options.every,
                   "Write the field of every Nth frame too, with its number before the suffix of the output")
      ->check(whole_number(1, INT32_MAX))
      ->type_name("N");
  command->add_option("--report", options.report, "What happened, with times, as JSON")->type_name("FILE.json");
  add_series(*command, options.input);
  add_nifti_frame(*command, options.common, options.input);
  add_backend(*command, options.backend, options.device,
              "auto, cuda or cpu: of chainmail the bits are the same, of mass-spring the equilibrium");
  command->add_flag("--dry-run", options.dry_run, "Check everything and say what would be done");
  add_common(*command, options.common, true);
  command->footer(
      "Example: tetwarp simulate examples/scenarios/diaphragm_push.json ct_folder -o push.mha --report push.json");
}

void add_batch(CLI::App& app, BatchOptions& options) {
  CLI::App* command = app.add_subcommand("batch", "Deform many volumes, unattended");
  auto* manifest = command->add_option("MANIFEST", options.manifest,
                                       "The cases: .csv or JSON Lines, .jsonl .ndjson (docs/reference/batch.md)");
  auto* init = command
                   ->add_option("--init", options.init,
                                "Write a manifest instead, to be edited: a row for every volume of a folder of DICOM")
                   ->type_name("FOLDER")
                   ->excludes(manifest);
  command->add_option("-o,--output", options.output, "The folder of the results; with --init, the manifest, .csv")
      ->required();
  command->add_option("--field", options.field, "With --init: the field of every row")
      ->type_name("FIELD")
      ->needs(init)
      ->capture_default_str();
  command->add_flag("--resume", options.resume,
                    "Continue a batch: cases that are finished and whole are kept, all others are made");
  auto* shard = command->add_option("--shard", options.shard, "Make every Nth case alone, from the Ith on: 2/8")
                    ->type_name("I/N");
  command->add_flag("--merge", options.merge, "Join what all shards have recorded; nothing is deformed")
      ->excludes(shard);
  command
      ->add_option("--memory", options.memory_bytes,
                   "8G, 2.5G, 500M: what all cases in work may hold (default: four fifths of what is available)")
      ->transform(size_in_bytes())
      ->type_name("SIZE");
  command->add_option("--jobs", options.jobs, "Cases in work at once; 0: eight for each CUDA device, or three")
      ->check(whole_number(0, 65536))
      ->capture_default_str();
  add_backend_choice(*command, options.backend,
                     "auto (all CUDA devices where one works, otherwise the CPU), cuda or cpu; the bits are the same");
  command->add_flag("--log-json", options.log_json, "Say what happens as JSON Lines on standard error");
  command->add_flag("--dry-run", options.dry_run, "Check the manifest and say what would be done");
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp batch cohort.csv -o results --memory 8G");
}

/// Only for `tetwarp --help`: what follows `bench` is never parsed here.
void add_bench(CLI::App& app) {
  app.add_subcommand("bench", "Time the paper's methods and Tetwarp (runs tetwarp-bench, see `tetwarp bench --help`)");
}

std::string version_text() {
  std::string text = std::string("tetwarp ") + version() + " (" + commit() + ")";
  for (const std::string& line : describe_backends()) text += "\n  " + line;
  return text;
}

template <class Options>
int run(int (*command)(const Options&), const Options& options) {
  std::optional<tbb::global_control> limit;
  if (options.common.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.common.threads));
  }
  return command(options);
}

/// Words before the command, or in its place, that are none. CLI11 looks at --help, and at whether there is a command,
/// before it looks at them. @throws UsageError for the first
void refuse_unknown_words(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining();
  if (!unknown.empty()) throw UsageError("no command or option \"" + shown(unknown.front()) + "\"; see tetwarp --help");
}

/// No option takes an empty text: it is what an unset variable of a script leaves, and would count as no option at all.
void refuse_empty_values(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& value : option->results()) {
        if (value.empty() && option->get_expected_max() > 0)
          throw UsageError(option->get_name() + " is empty; give a value, or leave it out");
      }
    }
  }
}

/// CLI11's words for a command line that is wrong.
void parse(CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<const char*> texts;
  for (const std::string& argument : arguments) texts.push_back(argument.c_str());
  try {
    app.parse(static_cast<int>(texts.size()), texts.data());
  } catch (const CLI::Success&) {
    refuse_unknown_words(app);
    throw;
  } catch (const CLI::Error& error) {
    refuse_unknown_words(app);
    throw UsageError(std::string(error.what()) + "; see tetwarp --help");
  }
  refuse_empty_values(app);
}

}  // namespace

std::vector<OptionKind> deform_options() {
  CLI::App app;
  DeformOptions options;
  add_deform(app, options);
  std::vector<OptionKind> kinds;
  for (const CLI::Option* option : app.get_subcommand("deform")->get_options()) {
    for (const std::string& name : option->get_lnames()) {
      if (name != "help")
        kinds.push_back({name, option->get_expected_max() == 0, option->get_items_expected_max() > 1});
    }
  }
  return kinds;
}

DeformOptions parse_deform(const std::vector<std::string>& arguments) {
  CLI::App app;
  DeformOptions options;
  add_deform(app, options);
  std::vector<std::string> all = {"tetwarp", "deform"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  parse(app, all);
  return options;
}

int run_command_line(int argc, char** argv) {
  // Ahead of CLI11, which takes words such as `--` and `--help` away even from a prefix command.
  if (argc > 1 && argv[1] == std::string_view("bench")) return run_bench({argv + 2, argv + argc});
  CLI::App app("Deform medical volumes exactly: CT series in, deformed series out");
  app.name("tetwarp");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text);
  Commands commands;
  add_phantom(app, commands.phantom);
  add_info(app, commands.info);
  add_deform(app, commands.deform);
  add_field(app, commands.field);
  add_invert(app, commands.invert);
  add_simulate(app, commands.simulate);
  add_render(app, commands.render);
  add_batch(app, commands.batch);
  add_bench(app);
  try {
    parse(app, {argv, argv + argc});
  } catch (const CLI::Success& help) {
    return app.exit(help);
  }
  if (app.got_subcommand("phantom")) return run(run_phantom, commands.phantom);
  if (app.got_subcommand("info")) return run(run_info, commands.info);
  if (app.got_subcommand("field")) return run(run_field, commands.field);
  if (app.got_subcommand("invert")) return run(run_invert, commands.invert);
  if (app.got_subcommand("render")) return run(run_render, commands.render);
  if (app.got_subcommand("batch")) return run(run_batch, commands.batch);
  if (app.got_subcommand("simulate")) return run(run_simulate, commands.simulate);
  return run(run_deform, commands.deform);
}

}  // namespace tetwarp::apps
