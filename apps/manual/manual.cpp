// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/manual/manual.h"

#include <CLI/CLI.hpp>

#include "apps/cli/subcommands.h"

namespace tetwarp::apps {

namespace {

std::vector<std::string> parts_of(const std::string& words, char between) {
  std::vector<std::string> parts;
  std::istringstream stream(words);
  for (std::string part; std::getline(stream, part, between);) parts.push_back(part);
  return parts;
}

/// The words that an option takes: of CLI11's IsMember, which describes itself as "{a,b}", or of `one_of`, whose name
/// they are.
std::vector<std::string> choices_of(CLI::Option& option) {
  const CLI::Validator* validator = nullptr;
  try {
    validator = option.get_validator(0);
  } catch (const CLI::OptionNotFound&) {
    return {};
  }
  const std::string description = validator->get_description();
  if (description.starts_with('{') && description.ends_with('}'))
    return parts_of(description.substr(1, description.size() - 2), ',');
  return parts_of(validator->get_name(), ',');
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

ManualOption describe(CLI::Option& option) {
  ManualOption about;
  for (const std::string& name : option.get_snames()) about.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) about.names.push_back("--" + name);
  if (option.get_positional()) about.names = {option.get_single_name()};
  about.description = option.get_description();
  about.by_default = option.get_default_str();
  about.required = option.get_required();
  if (option.get_expected_max() == 0) return about;
  about.choices = choices_of(option);
  const std::string type = option.get_type_name();
  about.value = type.substr(0, type.find(':'));  // behind the colon is how a check describes itself
  if (const bool is_any_word = about.value == "TEXT" || about.value == "NAME"; is_any_word && !about.choices.empty())
    about.value = joined(about.choices, "|");
  if (type.find('=') != std::string::npos) about.value = type;
  return about;
}

ManualCommand describe(CLI::App& command) {
  ManualCommand about;
  about.name = command.get_name();
  about.description = command.get_description();
  constexpr std::string_view kExample = "Example: ";
  if (const std::string footer = command.get_footer(); footer.starts_with(kExample))
    about.example = footer.substr(kExample.size());
  for (CLI::Option* option : command.get_options())
    (option->get_positional() ? about.arguments : about.options).push_back(describe(*option));
  return about;
}

}  // namespace

Manual describe_program() {
  CLI::App app;
  AllOptions options;
  add_commands(app, options);
  Manual manual;
  manual.description = app.get_description();
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    manual.commands.push_back(describe(*command));
  return manual;
}

}  // namespace tetwarp::apps
