// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

void add_view(CLI::App& app, ViewOptions& options) {
  CLI::App* command = app.add_subcommand("view", "Look at a CT in the browser, take hold of tissue and pull");
  auto* input = command->add_option("INPUT", options.input.path, std::string(kInputHelp) + "; a CT in HU");
  command->add_flag("--demo", options.demo, "The built-in phantom instead of INPUT")->excludes(input);
  auto* scenario =
      command
          ->add_option("--scenario", options.scenario,
                       "Tissues, method, what is held and cuts, of a scenario file, whose phases a button plays")
          ->type_name("FILE.json");
  auto* field = command
                    ->add_option("-f,--field", options.field.forward,
                                 "Shown instead of what a hand does, and how it grows: a forward field or formula as "
                                 "for `deform`. May be repeated")
                    ->allow_extra_args(false)
                    ->excludes(scenario)
                    ->type_name("FIELD");
  auto* pull =
      command->add_option("--pull-field", options.field.pull, "Shown so, too: a field that maps output to input")
          ->allow_extra_args(false)
          ->excludes(scenario)
          ->excludes(field)
          ->type_name("FILE");
  add_sequence(*command, options.sequence,
               "Shown so, too: fields one after the other, as `simulate --every` writes them: a name a word, up to the "
               "next option",
               {scenario, field, pull});
  command
      ->add_option("--labels", options.labels,
                   "Label volume on the grid of INPUT, to be seen, and for tissues and regions by label")
      ->type_name("FILE");
  command
      ->add_option("--cell-size", options.field.cell_size,
                   "Distance of lattice vertices, voxels (default: of the scenario; without one, as many as can be "
                   "simulated in time; 1 for a formula of -f)")
      ->check(whole_number(1, 4096))
      ->type_name("B");
  command->add_option("-o,--output", options.output, "Folder for what is saved; made when the first file is")
      ->type_name("FOLDER")
      ->capture_default_str();
  command->add_option("--port", options.port, "Port on this machine (default: one that is free)")
      ->check(whole_number(1, 65535));
  command->add_flag("--no-open", options.no_open, "Print the address, and open no browser");
  add_series(*command, options.input);
  add_nifti_frame(*command, options.common, options.input);
  add_backend(*command, options.backend, options.device);
  add_common(*command, options.common, false);
  command->footer(
      "Examples: tetwarp view --demo\n          tetwarp view ct_folder -o pulled\n"
      "          tetwarp view ct.nii.gz -f breath.mha --labels organs.nii.gz");
}

}  // namespace tetwarp::apps
