// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

namespace {

constexpr int kMostPixels = 8192, kMostPictures = 10000;

void add_looks(CLI::App& command, RenderOptions& options) {
  command
      .add_option("--view", options.view,
                  "volume (rays through it), or slices: axial, coronal, sagittal, or montage of all three")
      ->check(CLI::IsMember({"volume", "axial", "coronal", "sagittal", "montage"}))
      ->capture_default_str();
  command
      .add_option("--transfer", options.transfer,
                  "What values look like: ct-bone (default for a CT), ct-skin, ct-lung, ct-vessel, mip (default for "
                  "others) or xray, or a JSON file (docs/reference/transfer-functions.md)")
      ->type_name("NAME|FILE.json");
  command
      .add_option("--angle", options.angle,
                  "Degrees around the patient's long axis: 0 from the front, 90 from the patient's left")
      ->check(finite_number())
      ->capture_default_str();
  command.add_option("--elevation", options.elevation, "Degrees: 90 from above the head, -90 from below the feet")
      ->check(finite_number())
      ->capture_default_str();
  command.add_option("--zoom", options.zoom, "1: the whole volume is in the picture")
      ->check(positive_number())
      ->capture_default_str();
  command.add_option("--size", options.size, "Pixels of the picture, W,H; of slices: at most")
      ->expected(2)
      ->delimiter(',')
      ->check(whole_number(16, kMostPixels))
      ->capture_default_str();
  command
      .add_option("--step", options.step,
                  "Between samples of a ray, 0.01 to 1, in the smallest spacing (default: half a pixel, but 0.5 to 1; "
                  "1 for xray)")
      ->check(real_number(0.01, 1))
      ->type_name("VOXELS");
  command.add_option("--background", options.background, "Colour behind the volume")
      ->type_name("#RRGGBB")
      ->capture_default_str();
  command
      .add_option(
          "--window", options.window,
          "Of slices and mip: width of the values from black to white (default: 1500 for a CT, else 1 % to 99 %)")
      ->check(positive_number())
      ->type_name("WIDTH");
  command.add_option("--level", options.level, "Of slices and mip: value of middle grey (default: -200 for a CT)")
      ->check(finite_number());
  command
      .add_option("--position", options.position,
                  "LPS mm of a point that the slices go through, or that is in the middle of the picture (default: the "
                  "volume's middle)")
      ->expected(3)
      ->delimiter('/')
      ->check(finite_number())
      ->type_name("X/Y/Z");
  command
      .add_option("--overlay", options.overlays,
                  "coverage, folds, jacobian or lattice of the field of -f; or =FILE: a map that `deform` wrote, "
                  "on the grid of VOLUME, lattice=FIELD the field that made it. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME[=FILE]");
  command.add_flag("--plain", options.plain, "The volume or the slices alone: no text, no letters, no bar");
}

void add_deformation(CLI::App& command, RenderOptions& options) {
  auto* field = command
                    .add_option("-f,--field", options.field.forward,
                                "Deform VOLUME first, as `deform` does: a forward field or formula. May be repeated")
                    ->allow_extra_args(false)
                    ->type_name("FIELD");
  auto* pull = command.add_option("--pull-field", options.field.pull, "The same by a field that maps output to input")
                   ->allow_extra_args(false)
                   ->type_name("FILE")
                   ->excludes(field);
  add_sequence(
      command, options.sequence,
      "A picture for each of these fields, as `simulate --every` writes them: a name a word, up to the next option",
      {field, pull});
  add_cell_size(command, options.field);
  add_outside(command, options.outside);
  command.add_option("--fill", options.fill, "Value where nothing maps (default: as --background of `deform`)")
      ->check(finite_number());
}

}  // namespace

void add_render(CLI::App& app, RenderOptions& options) {
  CLI::App* command = app.add_subcommand("render", "Make pictures of a volume, deformed or as it is");
  command->add_option("VOLUME", options.input.path, kInputHelp)->required();
  command
      ->add_option("-o,--output", options.output,
                   ".png; of several pictures numbered, NAME.0001.png; or a film of them, .mp4 .gif (needs ffmpeg)")
      ->required();
  add_looks(*command, options);
  add_deformation(*command, options);
  command->add_option("--turntable", options.turntable, "Once around the patient in N pictures")
      ->check(whole_number(2, kMostPictures))
      ->type_name("N");
  command->add_option("--frames", options.frames, "N pictures in which the field grows from nothing to its whole")
      ->check(whole_number(2, kMostPictures))
      ->type_name("N");
  command->add_option("--rate", options.rate, "Pictures a second of a film")
      ->check(real_number(0.1, 120))
      ->capture_default_str();
  add_series(*command, options.input);
  add_nifti_frame(*command, options.common, options.input);
  add_backend(*command, options.backend, options.device);
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp render ct_folder -o bones.png --transfer ct-bone --angle 30 -f twist:angle=20");
}

}  // namespace tetwarp::apps
