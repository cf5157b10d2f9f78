// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

namespace tetwarp::apps {

/// An option or argument of a command, as its `--help` has it.
struct ManualOption {
  std::vector<std::string> names;    ///< with their dashes, short ones first; the one name of an argument without
  std::string value;                 ///< what it takes, such as FILE; empty for a flag
  std::string description;           ///< a sentence
  std::string by_default;            ///< value where it is not given; empty where there is none
  std::vector<std::string> choices;  ///< the words that it takes; empty where others are taken, too
  bool required = false;
};

/// A command of the program.
struct ManualCommand {
  std::string name;
  std::string description;
  std::vector<ManualOption> arguments, options;
  std::string example;  ///< a command line; empty where there is none
};

/// All that is said of the program in man pages and completions: the description of the command line that `--help`
/// prints.
struct Manual {
  std::string description;
  std::vector<ManualCommand> commands;
};
Manual describe_program();

/// A file of the manual.
struct ManualFile {
  std::string path;  ///< below the folder `share` of an installation
  std::string text;
};

/// Pages of section 1 of the manual, in roff: one of the program, one of each command.
/// @param version  of the program
std::vector<ManualFile> man_pages(const Manual& manual, const std::string& version);

/// What bash, zsh and fish need to complete commands, options and their values.
std::vector<ManualFile> completions(const Manual& manual);

}  // namespace tetwarp::apps
