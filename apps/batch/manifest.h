// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// A row of a manifest, or one of its variants: a `deform`.
struct BatchCase {
  std::string id;
  std::size_t line = 0;                ///< of the manifest
  std::vector<std::string> arguments;  ///< of the `tetwarp deform` that repeats it, INPUT first
  /// The arguments with inputs as the manifest names them, and outputs without their folder, so that they are equal
  /// wherever both lie.
  std::vector<std::string> row;
  DeformOptions options;  ///< as parsed from them; all outputs lie in OUTPUT_DIR/ID
};

/// What follows `tetwarp` on the command line that repeats a case.
std::vector<std::string> command_of(const BatchCase& of);

/// Reads a manifest (docs/reference/batch.md): `.csv`, or JSON Lines, `.jsonl` or `.ndjson`. Rows with variants become
/// as many cases; what is random is drawn. Every file that is named has to exist; none is read but scenarios and what
/// `--with` may hold.
///
/// @throws InputError with every error of it, "MANIFEST:LINE: ..." each on a line of its own
std::vector<BatchCase> read_manifest(const std::filesystem::path& manifest, const std::filesystem::path& output_dir);

/// The keys that a row may have: long options of `deform`, and the manifest's own.
std::vector<std::string> manifest_keys();

}  // namespace tetwarp::apps
