// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/input.h"
#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"
#include "deform/truth/family.h"

namespace tetwarp::apps {

namespace {

/// Every kind of deformation with the labels and numbers that it takes, a line each.
std::string kinds_text() {
  std::string text = "Cases, KIND[:KEY=VALUE,...]:";
  for (const truth::Family& family : truth::families()) {
    text += "\n  " + std::string(family.name) + ": " + std::string(family.about);
    for (const std::string_view role : family.roles) text += "; needs --label " + std::string(role);
    for (const truth::Parameter& parameter : family.parameters) {
      text += "\n    " + std::string(parameter.name) + "=" + number_text(parameter.usual) + ": " +
              std::string(parameter.about);
    }
  }
  return text;
}

}  // namespace

void add_truth(CLI::App& app, TruthOptions& options) {
  CLI::App* command =
      app.add_subcommand("truth", "Make a set of deformed volumes whose truth is known, to test registrations");
  command
      ->add_option("INPUT", options.input.path,
                   std::string(kInputHelp) +
                       "; a CT in HU, the moving volume. Or a manifest, .csv or .jsonl: a row for each volume, "
                       "with the keys study, input, labels, label, case, dose, with, noise, series")
      ->required();
  command->add_option("-o,--output", options.output, "Folder of the set")->required();
  command
      ->add_option("--case", options.cases,
                   "A deformation, below; may be repeated. Default: elastic of five strengths, shift, rotation, and "
                   "each kind whose labels are known")
      ->type_name("KIND");
  command->add_option("--labels", options.labels, "Label volume on the grid of INPUT; goes along")->type_name("FILE");
  command->add_option("--label", options.roles, "Which labels are what a kind needs, lung=1,2; may be repeated")
      ->type_name("ROLE=N,...");
  command->add_option("--cell-size", options.cell_size, "Voxels between vertices of the fields")
      ->check(whole_number(1, 512))
      ->type_name("B")
      ->capture_default_str();
  command->add_option("--body-above", options.body_above_hu, "Cells with a higher mean may be of the body")
      ->check(finite_number())
      ->type_name("HU")
      ->capture_default_str();
  command->add_option("--landmarks", options.landmarks, "Most landmarks, at corners of texture")
      ->check(whole_number(0, 100000))
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--noise", options.noise,
                   "Standard deviation of noise that is added to the moving volume and to each fixed one, of its own "
                   "for each, because noise that moves with the tissue helps registrations; measured: as much as INPUT "
                   "has, with its grain, as differences of neighbouring slices show it")
      ->type_name("HU|measured")
      ->capture_default_str();
  command->add_option("--seed", options.seed, "Decides the noise")
      ->check(whole_number(0, INT64_MAX))
      ->capture_default_str();
  command
      ->add_option("--with", options.with,
                   "What goes along: RT Dose, RT Structure Set, SEG (.dcm), or a volume file; each case gets one of "
                   "the same name; may be repeated")
      ->type_name("FILE");
  command
      ->add_option("--dose", options.dose,
                   "RT Dose (.dcm) or volume file of the dose; goes along, and score compares it (gamma index)")
      ->type_name("FILE");
  command->add_flag(
      "--dense", options.dense,
      "Write the exact displacements at every voxel too, 12 bytes each: fixed to moving, moving to fixed");
  command->add_option("--compress", options.compression, "Level of .nii.gz; 0: .nii")
      ->check(whole_number(0, 9))
      ->type_name("LEVEL")
      ->capture_default_str();
  command->add_flag("--resume", options.resume, "Go on with a set that was not completed");
  add_series(*command, options.input);
  add_nifti_frame(*command, options.common, options.input);
  add_backend(*command, options.backend, options.device);
  add_common(*command, options.common, false);
  command->footer(kinds_text() +
                  "\n\nExample: tetwarp truth ct.nii.gz -o set --labels organs.nii.gz --label lung=2 --label bone=3");
}

}  // namespace tetwarp::apps
