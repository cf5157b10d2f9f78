// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "apps/cli/options.h"

namespace CLI {
class App;
}

namespace tetwarp::apps {

// Each adds one subcommand, whose options are entered into `options` when the command line is read.

void add_phantom(CLI::App& app, PhantomOptions& options);
void add_info(CLI::App& app, InfoOptions& options);
void add_deform(CLI::App& app, DeformOptions& options);
void add_field(CLI::App& app, FieldCommandOptions& options);
void add_invert(CLI::App& app, InvertOptions& options);
void add_simulate(CLI::App& app, SimulateOptions& options);
void add_render(CLI::App& app, RenderOptions& options);
void add_view(CLI::App& app, ViewOptions& options);
void add_batch(CLI::App& app, BatchOptions& options);
void add_truth(CLI::App& app, TruthOptions& options);
void add_score(CLI::App& app, ScoreOptions& options);

/// The options of every subcommand; of one command line those of one subcommand are set.
struct AllOptions {
  PhantomOptions phantom;
  InfoOptions info;
  FieldCommandOptions field;
  InvertOptions invert;
  DeformOptions deform;
  SimulateOptions simulate;
  BatchOptions batch;
  RenderOptions render;
  ViewOptions view;
  TruthOptions truth;
  ScoreOptions score;
};
/// Describes the program: its name, its version and all its subcommands.
void add_commands(CLI::App& app, AllOptions& options);

}  // namespace tetwarp::apps
