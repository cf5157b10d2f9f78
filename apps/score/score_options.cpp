// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

void add_score(CLI::App& app, ScoreOptions& options) {
  CLI::App* command = app.add_subcommand("score", "Say how far registrations of a set of known truth are off");
  command->add_option("SET", options.set, "Folder that tetwarp truth made")->required();
  command
      ->add_option("-r,--results", options.results,
                   "Folder with a result of each case, named CASE and a suffix: a displacement field or transform from "
                   "fixed to moving, or CASE.csv, the landmarks of the fixed volume taken to the moving one; of a set "
                   "with one case also a file. What a file does not say stands behind the folder's name, as for "
                   "--pull-field: warps:values=positions,frame=ras. May be repeated: results side by side")
      ->type_name("RESULTS")
      ->required();
  command
      ->add_option_function<std::string>(
          "--direction", [&](const std::string& text) { options.forward = text == "forward"; },
          "pull: results lead from fixed to moving, as registrations give them; forward: from moving to fixed, "
          "compared "
          "with the exact forward map at the voxels of the moving volume")
      ->check(CLI::IsMember({"pull", "forward"}))
      ->type_name("pull|forward")
      ->default_str("pull");
  command
      ->add_option("--back", options.back,
                   "Folder with the results of the other direction, for inverse consistency; one for each -r")
      ->type_name("FOLDER");
  command
      ->add_option(
          "--triples", options.triples,
          "Folder with results between the fixed volumes of two cases, named CASE--CASE and a suffix, from the "
          "first to the second, for transitivity; with one -r")
      ->type_name("FOLDER");
  command
      ->add_option(
          "--limits", options.limits,
          "Limits to pass, as JSON: {\"landmarks_mean_mm\": {\"most\": 2, \"source\": \"...\"}, ...}; those that are "
          "left out keep their defaults")
      ->type_name("FILE.json");
  command->add_option("--json", options.json, "All numbers")->type_name("FILE.json");
  command->add_option("--csv", options.csv, "A row for each case and label")->type_name("FILE.csv");
  command->add_option("--html", options.html, "One page with tables and pictures, complete in itself")
      ->type_name("FILE.html");
  add_backend(*command, options.backend, options.device);
  add_common(*command, options.common, true);
  command->footer(
      "Exit status 0: all cases pass; 3: some do not, or have no result.\n\nExample: tetwarp score set -r elastix "
      "--html elastix.html");
}

}  // namespace tetwarp::apps
