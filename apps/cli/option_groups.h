// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/options.h"

namespace tetwarp::apps {

// Options that several subcommands have.

extern const char* const kInputHelp;
extern const char* const kFieldHelp;

// Checks of numbers; a value that is none, not finite, or outside its range is refused, and the refusal names both.

/// A whole number from `least` to `most`.
CLI::Validator whole_number(std::int64_t least, std::int64_t most);
/// A finite number from `least` to `most`.
CLI::Validator real_number(double least, double most);
/// A finite number, of any size that a float has.
CLI::Validator finite_number();
/// A finite number greater than 0.
CLI::Validator positive_number();
/// Turns a name into the value of an enumeration that it stands for, as CLI11 reads it. Any other word is refused,
/// numbers too, which CLI11's own transformers let through. The check's name is the names, "a,b".
template <class Choice>
CLI::Validator one_of(std::initializer_list<std::pair<const char*, Choice>> choices) {
  std::string names;
  for (const auto& [name, value] : choices) names += (names.empty() ? "" : ",") + std::string(name);
  return CLI::Validator(
             [choices = std::vector(choices), names](std::string& text) {
               for (const auto& [name, value] : choices) {
                 if (text != name) continue;
                 text = std::to_string(static_cast<int>(value));
                 return std::string();
               }
               return text + " not in {" + names + "}";
             },
             "")
      .name(names);
}
/// Turns a size in memory, such as 8G, 2.5G, 500M or 512MiB, into bytes.
CLI::Validator size_in_bytes();

/// --threads, --quiet, --verbose, and --overwrite of a command that writes.
void add_common(CLI::App& command, CommonOptions& common, bool writes);
/// --series, --single, --uneven.
void add_series(CLI::App& command, InputOptions& input);
/// --nifti-frame, for `input` and all else that the command reads.
void add_nifti_frame(CLI::App& command, CommonOptions& common, InputOptions& input);
/// --backend.
void add_backend_choice(CLI::App& command, BackendChoice& backend, const char* help);
/// --backend, --device.
void add_backend(CLI::App& command, BackendChoice& backend, int& device,
                 const char* help = "auto, cuda or cpu: the bits are the same");
/// --sequence, which excludes the options that give one field.
CLI::Option* add_sequence(CLI::App& command, std::vector<std::string>& sequence, const char* help,
                          std::initializer_list<CLI::Option*> excluded);
/// --cell-size.
void add_cell_size(CLI::App& command, FieldArguments& field);
/// --outside.
void add_outside(CLI::App& command, Outside& outside);

}  // namespace tetwarp::apps
