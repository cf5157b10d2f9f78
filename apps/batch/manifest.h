// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// A row of a manifest, or one of its variants: one run of `deform`.
struct BatchCase {
  std::string id;
  std::size_t line = 0;  ///< line of the manifest, from 1
  /// Arguments of the `tetwarp deform` that makes the same outputs, INPUT first.
  std::vector<std::string> arguments;
  /// The same arguments, but with inputs as the manifest names them and outputs without their folder, so that they are
  /// equal wherever both lie.
  std::vector<std::string> row;
  DeformOptions options;  ///< the arguments as parsed; all outputs lie in OUTPUT_DIR/ID
};

/// What follows `tetwarp` on the command line that makes the outputs of a case.
std::vector<std::string> command_of(const BatchCase& of);

/// Reads a manifest (docs/reference/batch.md): `.csv`, or JSON Lines, `.jsonl` or `.ndjson`. A row with variants
/// becomes as many cases; what is random in it is drawn. Every file that is named has to exist. None is read, except
/// scenarios and files named by `--with` that may hold several volumes.
///
/// @throws InputError with all errors of the manifest, each "MANIFEST:LINE: ..." on a line of its own
std::vector<BatchCase> read_manifest(const std::filesystem::path& manifest, const std::filesystem::path& output_dir);

/// The keys that a row may have: long options of `deform`, and the manifest's own.
std::vector<std::string> manifest_keys();

}  // namespace tetwarp::apps
