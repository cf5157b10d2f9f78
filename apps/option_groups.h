#pragma once

#include <CLI/CLI.hpp>

#include "apps/options.h"

namespace tetwarp::apps {

// Options that several subcommands have.

extern const char* const kInputHelp;
extern const char* const kFieldHelp;

/// --threads, --quiet, --verbose, and --overwrite of a command that writes.
void add_common(CLI::App& command, CommonOptions& common, bool writes);
/// --series, --single, --uneven.
void add_series(CLI::App& command, InputOptions& input);
/// --nifti-frame, for `input` and all else that the command reads.
void add_nifti_frame(CLI::App& command, CommonOptions& common, InputOptions& input);
/// --backend, --device.
void add_backend(CLI::App& command, std::string& backend, int& device,
                 const char* help = "auto, cuda or cpu: the bits are the same");
/// --outside.
void add_outside(CLI::App& command, Outside& outside);

/// The subcommand `render`.
void add_render(CLI::App& app, RenderOptions& options);

}  // namespace tetwarp::apps
