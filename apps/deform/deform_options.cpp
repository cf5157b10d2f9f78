// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

namespace {

/// What a DICOM series says of itself.
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

/// --deidentify, --deidentify-key.
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

/// What the volume is deformed by.
void add_deformation(CLI::App& command, DeformOptions& options) {
  auto* field =
      command.add_option("-f,--field", options.field.forward, kFieldHelp)->allow_extra_args(false)->type_name("FIELD");
  command
      .add_option(
          "--pull-field", options.field.pull,
          "A field that maps output to input, as registration tools write it (files as for -f, and a "
          "DICOM Deformable Spatial Registration, FILE:item=N where it has several); NaN in it: no source. Or "
          "a transform as for -f: output p comes from T(p). Several compose in the order of antsApplyTransforms "
          "-t: p goes through the first, and from there on")
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->excludes(field);
  command
      .add_option(
          "--scenario", options.scenario,
          "Simulate the field as `simulate` does, of a page of scenario (docs/guide/simulate.md); INPUT is a CT in HU")
      ->type_name("FILE.json");
  command.add_option("--labels", options.labels, "Label volume on the grid of INPUT, for the tissues of --scenario")
      ->type_name("FILE");
  command
      .add_option("--write-field", options.write_field,
                  "The forward field that was used: .mha .nrrd .nii .nii.gz, or a mesh, .vtu .vtk")
      ->type_name("FILE");
}

/// Where the output lies, and how its values come about.
void add_sampling(CLI::App& command, DeformOptions& options) {
  command
      .add_option("--interpolation", options.interpolation, "linear (default), nearest or cubic; vote for label maps")
      ->transform(one_of<Interpolation>({{"nearest", Interpolation::nearest},
                                         {"linear", Interpolation::linear},
                                         {"cubic", Interpolation::cubic},
                                         {"vote", Interpolation::vote}}))
      ->type_name("NAME");
  add_outside(command, options.outside);
  command
      .add_option(
          "--background", options.background,
          "Value where nothing maps (default: DICOM padding value or -1024 HU; else the smallest value present)")
      ->check(finite_number());
  add_cell_size(command, options.field);
  command
      .add_option("--grid", options.grid,
                  "Output grid: INPUT's (same), INPUT's grown to hold the deformed lattice (fit), or that of a volume")
      ->type_name("same|fit|FILE")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--preserve", [&options](const std::string&) { options.preserve_mass = true; },
          "mass: INPUT is a CT in HU, and its density (HU + 1000) is divided by the Jacobian determinant")
      ->check(CLI::IsMember({"mass"}))
      ->type_name("mass");
}

/// --with.
void add_volumes_along(CLI::App& command, DeformOptions& options) {
  command
      .add_option(
          "--with", options.with,
          "Another volume through the same field, from its own grid onto the output grid, or back onto its own. An "
          "RTDOSE or SEG comes out as one where OUT is .dcm, an RT Structure Set always does; they refer to the series "
          "that OUTPUT receives. May be repeated")
      ->allow_extra_args(false)
      ->type_name("IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]");
}

/// --memory.
void add_memory(CLI::App& command, DeformOptions& options) {
  command
      .add_option(
          "--memory", options.memory_bytes,
          "8G, 2.5G, 500M. On the CPU: refuse to start if more is needed. On a CUDA device: volumes and field there "
          "take no more, what does not fit is streamed in slabs; 10 % or 128 MB of working space come on top")
      ->transform(size_in_bytes())
      ->type_name("SIZE");
}

/// What the files of volumes hold beside their values.
void add_form_of_files(CLI::App& command, DeformOptions& options) {
  command.add_option("--compress", options.compression, "Level 0 to 9 for .nii.gz (default 1) .nrrd .mha (default 0)")
      ->check(whole_number(0, 9));
  add_dicom_form(command, options.dicom);
  add_deidentify(command, options);
  command.add_flag(
      "--bids", options.bids,
      "Write STEM.json beside OUTPUT STEM.nii.gz or STEM.nii, of a CT series: scanner and protocol with the "
      "names of BIDS, without patient, institution and dates");
}

/// --points.
void add_points_along(CLI::App& command, DeformOptions& options) {
  command
      .add_option("--points", options.points,
                  "Landmarks or a surface, moved as the voxels under them: .csv (header x,y,z; LPS mm), .mrk.json, "
                  ".fcsv, .stl, .obj or .vtk, OUT of the same form and frame. :lps or :ras is the frame of a file "
                  "that does not say. May be repeated; not with --pull-field")
      ->allow_extra_args(false)
      ->type_name("IN=OUT[:lps|:ras]");
}

/// Volumes of what the field does at each voxel.
void add_maps(CLI::App& command, DeformOptions& options) {
  command.add_option("--coverage", options.maps.coverage, "Mask of the voxels that got a value through the field")
      ->type_name("FILE");
  command
      .add_option("--inverse", options.maps.inverse,
                  "Inverse displacement, LPS mm, for ITK's and other warps; NaN where nothing maps. FILE.dcm, where "
                  "OUTPUT is a DICOM series: a Deformable Spatial Registration from it to INPUT")
      ->type_name("FILE");
  command
      .add_option("--jacobian", options.maps.jacobian,
                  "Jacobian determinant of the forward map, negative where it folds; NaN where nothing maps")
      ->type_name("FILE");
  command.add_option("--folds", options.maps.folds, "How many tetrahedra own each voxel: more than 1 is a fold")
      ->type_name("FILE");
}

}  // namespace

void add_deform(CLI::App& app, DeformOptions& options) {
  CLI::App& command = *app.add_subcommand("deform", "Deform a volume");
  command.add_option("INPUT", options.input.path, kInputHelp)->required();
  add_deformation(command, options);
  command
      .add_option("-o,--output", options.output,
                  "A folder (DICOM series; INPUT must be DICOM), or .nii .nii.gz .nrrd .mha")
      ->required();
  add_series(command, options.input);
  add_nifti_frame(command, options.common, options.input);
  add_backend(command, options.backend, options.device);
  add_sampling(command, options);
  add_volumes_along(command, options);
  add_memory(command, options);
  add_form_of_files(command, options);
  add_points_along(command, options);
  add_maps(command, options);
  command.add_option("--report", options.report, "What happened, with times, as JSON")->type_name("FILE.json");
  command.add_option("--preview", options.preview, "Three slices before, after and their difference")
      ->type_name("FILE.png");
  command.add_flag("--dry-run", options.dry_run, "Check everything and say what would be done");
  add_common(command, options.common, true);
  command.footer(
      "Example: tetwarp deform ct_folder -f wave:amplitude=8,wavelength=64 -o deformed_dicom --preview look.png");
}

}  // namespace tetwarp::apps
