// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"
#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

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

}  // namespace tetwarp::apps
