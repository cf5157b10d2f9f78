// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

void add_field(CLI::App& app, FieldCommandOptions& options) {
  CLI::App* command = app.add_subcommand("field", "Write a field as a file");
  command->add_option("FIELD", options.field.forward, kFieldHelp)->required();
  command->add_option("--like", options.like.path, "The volume that the field is for")->required();
  command->add_option("-o,--output", options.output, ".mha .nrrd .nii .nii.gz, three components, LPS mm")->required();
  add_cell_size(*command, options.field);
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
          "with its outermost samples. Several compose, the first is applied first")
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->excludes(field);
  command->add_option("--like", options.like.path, "The volume on whose grid the inverse is sampled")->required();
  command
      ->add_option("-o,--output", options.output,
                   ".mha .nrrd .nii .nii.gz: output to input, LPS mm, for ITK's and other warps; NaN where nothing "
                   "maps; or .dcm, where --like is a DICOM series: a Deformable Spatial Registration. Of a pull "
                   "field: forward, for -f")
      ->required();
  add_cell_size(*command, options.field);
  add_backend(*command, options.backend, options.device);
  command->add_option("--report", options.report, "Residuals both ways, with times, as JSON")->type_name("FILE.json");
  add_series(*command, options.like);
  add_nifti_frame(*command, options.common, options.like);
  add_common(*command, options.common, true);
  command->footer("Example: tetwarp invert twist:angle=30 --like ct.nii.gz -o inverse.mha");
}

}  // namespace tetwarp::apps
