// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

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

}  // namespace tetwarp::apps
