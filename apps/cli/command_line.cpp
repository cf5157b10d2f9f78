// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <string_view>

#include <tbb/global_control.h>

#include "apps/cli/command_line.h"
#include "apps/cli/subcommands.h"
#include "backend/backend.h"
#include "deform/version.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// Only for `tetwarp --help`: what follows `bench` is never parsed here.
void add_bench(CLI::App& app) {
  app.add_subcommand("bench", "Time the paper's methods and Tetwarp (runs tetwarp-bench, see `tetwarp bench --help`)");
}

std::string version_text() {
  std::string text = std::string("tetwarp ") + version() + " (" + commit() + ")";
  for (const std::string& line : describe_backends()) text += "\n  " + line;
  return text;
}

template <class Options>
int run(int (*command)(const Options&), const Options& options) {
  std::optional<tbb::global_control> limit;
  if (options.common.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.common.threads));
  }
  return command(options);
}

/// Words before the command, or in its place, that are none. CLI11 looks at --help, and at whether there is a command,
/// before it looks at them. @throws UsageError for the first
void refuse_unknown_words(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining();
  if (!unknown.empty()) throw UsageError("no command or option \"" + shown(unknown.front()) + "\"; see tetwarp --help");
}

/// No option takes an empty text: it is what an unset variable of a script leaves, and would count as no option at all.
void refuse_empty_values(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& value : option->results()) {
        if (value.empty() && option->get_expected_max() > 0)
          throw UsageError(option->get_name() + " is empty; give a value, or leave it out");
      }
    }
  }
}

/// CLI11's words for a command line that is wrong.
void parse(CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<const char*> texts;
  for (const std::string& argument : arguments) texts.push_back(argument.c_str());
  try {
    app.parse(static_cast<int>(texts.size()), texts.data());
  } catch (const CLI::Success&) {
    refuse_unknown_words(app);
    throw;
  } catch (const CLI::Error& error) {
    refuse_unknown_words(app);
    throw UsageError(std::string(error.what()) + "; see tetwarp --help");
  }
  refuse_empty_values(app);
}

}  // namespace

void add_commands(CLI::App& app, AllOptions& options) {
  app.description("Deform medical volumes exactly: CT series in, deformed series out");
  app.name("tetwarp");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text);
  add_phantom(app, options.phantom);
  add_info(app, options.info);
  add_deform(app, options.deform);
  add_field(app, options.field);
  add_invert(app, options.invert);
  add_simulate(app, options.simulate);
  add_render(app, options.render);
  add_view(app, options.view);
  add_batch(app, options.batch);
  add_truth(app, options.truth);
  add_score(app, options.score);
  add_bench(app);
}

std::vector<OptionKind> deform_options() {
  CLI::App app;
  DeformOptions options;
  add_deform(app, options);
  std::vector<OptionKind> kinds;
  for (const CLI::Option* option : app.get_subcommand("deform")->get_options()) {
    for (const std::string& name : option->get_lnames()) {
      if (name != "help")
        kinds.push_back({name, option->get_expected_max() == 0, option->get_items_expected_max() > 1});
    }
  }
  return kinds;
}

DeformOptions parse_deform(const std::vector<std::string>& arguments) {
  CLI::App app;
  DeformOptions options;
  add_deform(app, options);
  std::vector<std::string> all = {"tetwarp", "deform"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  parse(app, all);
  return options;
}

int run_command_line(int argc, char** argv) {
  // Ahead of CLI11, which takes words such as `--` and `--help` away even from a prefix command.
  if (argc > 1 && argv[1] == std::string_view("bench")) return run_bench({argv + 2, argv + argc});
  CLI::App app;
  AllOptions commands;
  add_commands(app, commands);
  try {
    parse(app, {argv, argv + argc});
  } catch (const CLI::Success& help) {
    return app.exit(help);
  }
  if (app.got_subcommand("phantom")) return run(run_phantom, commands.phantom);
  if (app.got_subcommand("info")) return run(run_info, commands.info);
  if (app.got_subcommand("field")) return run(run_field, commands.field);
  if (app.got_subcommand("invert")) return run(run_invert, commands.invert);
  if (app.got_subcommand("render")) return run(run_render, commands.render);
  if (app.got_subcommand("view")) return run(run_view, commands.view);
  if (app.got_subcommand("batch")) return run(run_batch, commands.batch);
  if (app.got_subcommand("truth")) return run(run_truth, commands.truth);
  if (app.got_subcommand("score")) return run(run_score, commands.score);
  if (app.got_subcommand("simulate")) return run(run_simulate, commands.simulate);
  return run(run_deform, commands.deform);
}

}  // namespace tetwarp::apps
