// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"
#include "deform/phantom.h"

namespace tetwarp::apps {

namespace {

/// The labels of the phantom as help shows them: "0 nothing, 1 body, ...".
std::string phantom_labels() {
  std::string text;
  int value = 0;
  for (const std::string_view name : phantom_label_names())
    text += (value == 0 ? "" : ", ") + std::to_string(value) + " " + std::string(name), ++value;
  return text;
}

}  // namespace

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
  command->add_option("--noise", options.noise_hu, "Standard deviation of the noise, HU")
      ->check(CLI::Range(0.0, 1000.0))
      ->type_name("HU")
      ->capture_default_str();
  command
      ->add_option("--labels", options.labels,
                   "Write what each voxel belongs to as well: " + phantom_labels() + " (.nii .nii.gz .nrrd .mha)")
      ->type_name("FILE");
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp phantom -o phantom_dicom --size 512,512,100 --spacing 0.8,0.8,3");
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
  add_backend(*command, options.backend, options.device);
  command->add_flag("--dry-run", options.dry_run, "Check everything and say what would be done");
  add_common(*command, options.common, true);
  command->footer(
      "Example: tetwarp simulate examples/scenarios/diaphragm_push.json ct_folder -o push.mha --report push.json");
}

}  // namespace tetwarp::apps
