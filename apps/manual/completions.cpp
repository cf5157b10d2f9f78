// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <string_view>

#include "apps/manual/manual.h"
#include "deform/fields/formula.h"

namespace tetwarp::apps {

namespace {

/// What may stand behind an option.
enum class Takes : std::uint8_t { nothing, choice, field, file, other };

Takes takes_of(const ManualOption& option) {
  if (option.value.empty()) return Takes::nothing;
  if (!option.choices.empty()) return Takes::choice;
  if (option.value == "FIELD") return Takes::field;
  // An output that is a folder or a file has CLI11's word for any text, and is wanted in any case.
  const bool is_file = option.value.find("FILE") != std::string::npos ||
                       option.value.find("FOLDER") != std::string::npos || option.value.starts_with("IN=") ||
                       (option.value == "TEXT" && option.required);
  return is_file ? Takes::file : Takes::other;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// A text between the quotes of a shell, which take all but themselves as it stands.
std::string quoted(std::string_view text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c == '\n' ? ' ' : c);
  return out + "'";
}

/// What a description begins with, as far as a line of choices has room for it: up to a mark behind which a blank or
/// the end follows, or to a parenthesis.
std::string short_text(const std::string& description) {
  for (std::size_t n = 1; n < description.size(); ++n) {
    const bool is_mark =
        description.find_first_of(":;.,", n) == n && (n + 1 == description.size() || description[n + 1] == ' ');
    if (is_mark || description.compare(n, 2, " (") == 0) return description.substr(0, n);
  }
  return description;
}

const std::string kFirstLine = "# Completion for tetwarp, made from its --help.\n";

std::string for_bash(const Manual& manual) {
  std::string commands, options, values;
  for (const ManualCommand& command : manual.commands) {
    commands += (commands.empty() ? "" : " ") + command.name;
    std::string names;
    for (const ManualOption& option : command.options) {
      names += (names.empty() ? "" : " ") + joined(option.names);
      std::string cases;
      for (const std::string& name : option.names) cases += (cases.empty() ? "" : "|") + command.name + ":" + name;
      switch (takes_of(option)) {
        case Takes::nothing: break;
        case Takes::choice: values += "    " + cases + ") words='" + joined(option.choices) + "' ;;\n"; break;
        case Takes::field: values += "    " + cases + ") words=$fields files=1 ;;\n"; break;
        case Takes::file: values += "    " + cases + ") files=1 ;;\n"; break;
        case Takes::other: values += "    " + cases + ") return ;;\n"; break;
      }
    }
    options += "    " + command.name + ") options='" + names + "' ;;\n";
  }
  return kFirstLine +
         "_tetwarp() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}\n"
         "  local - words= files= options= fields='" +
         joined(formula_names()) +
         "'\n"
         "  set -f  # names of files are no patterns\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -le 1 ]; then\n"
         "    COMPREPLY=($(compgen -W '" +
         commands +
         " --help --version' -- \"$current\"))\n"
         "    return\n"
         "  fi\n"
         "  case $command in\n" +
         options +
         "    *) return ;;\n"
         "  esac\n"
         "  case $command:$before in\n" +
         values +
         "    *) case $current in -*) words=$options ;; *) files=1 ;; esac ;;\n"
         "  esac\n"
         "  [ -z \"$words\" ] || COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  if [ -n \"$files\" ]; then\n"
         "    local IFS=$'\\n'\n"
         "    compopt -o filenames 2>/dev/null\n"
         "    COMPREPLY+=($(compgen -f -- \"$current\"))\n"
         "  fi\n"
         "}\n"
         "complete -F _tetwarp tetwarp\n";
}

/// A text inside a specification of zsh's _arguments, where brackets and colons mean something.
std::string for_arguments(const std::string& text) {
  std::string out;
  for (const char c : text) out += std::string(c == '[' || c == ']' || c == ':' || c == '\\' ? "\\" : "") + c;
  return out;
}

std::string for_zsh(const Manual& manual) {
  std::string commands, cases;
  for (const ManualCommand& command : manual.commands) {
    commands += "    " + quoted(command.name + ":" + short_text(command.description)) + "\n";
    cases += "    " + command.name + ") _arguments";
    for (const ManualOption& option : command.options) {
      std::string action;
      switch (takes_of(option)) {
        case Takes::nothing: break;
        case Takes::choice: action = ":value:(" + joined(option.choices) + ")"; break;
        case Takes::field: action = ":field:_tetwarp_fields"; break;
        case Takes::file: action = ":file:_files"; break;
        case Takes::other: action = ":" + for_arguments(option.value) + ": "; break;
      }
      for (const std::string& name : option.names)
        cases +=
            " \\\n      " + quoted("*" + name + "[" + for_arguments(short_text(option.description)) + "]" + action);
    }
    cases += " \\\n      '*:file:_files' ;;\n";
  }
  return "#compdef tetwarp\n" + kFirstLine + "_tetwarp_fields() { compadd -S '' -- " + joined(formula_names()) +
         "; _files }\n"
         "_tetwarp() {\n"
         "  local -a commands=(\n" +
         commands +
         "  )\n"
         "  if (( CURRENT == 2 )); then\n"
         "    _describe command commands\n"
         "    compadd -- --help --version\n"
         "    return\n"
         "  fi\n"
         "  local command=$words[2]\n"
         "  shift words; (( CURRENT-- ))\n"
         "  case $command in\n" +
         cases +
         "  esac\n"
         "}\n"
         "_tetwarp \"$@\"\n";
}

std::string for_fish(const Manual& manual) {
  std::string text = kFirstLine +
                     "complete -c tetwarp -n __fish_use_subcommand -f\n"
                     "complete -c tetwarp -n __fish_use_subcommand -l help -d 'Print help'\n"
                     "complete -c tetwarp -n __fish_use_subcommand -l version -d 'Print the version'\n";
  const std::string fields = joined(formula_names());
  for (const ManualCommand& command : manual.commands) {
    text += "complete -c tetwarp -n __fish_use_subcommand -f -a " + command.name + " -d " +
            quoted(short_text(command.description)) + "\n";
    for (const ManualOption& option : command.options) {
      std::string line = "complete -c tetwarp -n 'string match -q -- " + command.name + " (commandline -opc)[2]'";
      for (const std::string& name : option.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      switch (takes_of(option)) {
        case Takes::nothing: break;
        case Takes::choice: line += " -x -a '" + joined(option.choices) + "'"; break;
        case Takes::field: line += " -r -a '" + fields + "'"; break;
        case Takes::file: line += " -r"; break;
        case Takes::other: line += " -x"; break;
      }
      text += line + " -d " + quoted(short_text(option.description)) + "\n";
    }
  }
  return text;
}

}  // namespace

std::vector<ManualFile> completions(const Manual& manual) {
  return {{"bash-completion/completions/tetwarp", for_bash(manual)},
          {"zsh/site-functions/_tetwarp", for_zsh(manual)},
          {"fish/vendor_completions.d/tetwarp.fish", for_fish(manual)}};
}

}  // namespace tetwarp::apps
