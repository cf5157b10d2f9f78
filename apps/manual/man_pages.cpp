// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Pages in the macros of man(7).

#include <algorithm>
#include <string_view>

#include "apps/manual/manual.h"

namespace tetwarp::apps {

namespace {

/// Text as roff prints it as it stands. A line may begin with it.
std::string plain(std::string_view text) {
  std::string out;
  if (text.starts_with('.') || text.starts_with('\'')) out += "\\&";
  for (const char c : text) {
    switch (c) {
      case '\\': out += "\\e"; break;
      case '-': out += "\\-"; break;
      case '\n': out += ' '; break;
      case '~': out += "\\(ti"; break;
      case '^': out += "\\(ha"; break;
      case '`': out += "\\(ga"; break;
      case '\'': out += "\\(aq"; break;
      default: out += c;
    }
  }
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + plain(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + plain(text) + "\\fR"; }

std::string heading(const std::string& name, const std::string& version) {
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(), [](unsigned char c) { return std::toupper(c); });
  // Neither hyphenated, for hyphens would be taken for those of options, nor stretched to the right margin.
  return ".TH " + plain(title) + " 1 \"\" \"Tetwarp " + plain(version) + "\" \"User Commands\"\n.nh\n.ad l\n.SH NAME\n";
}

/// What the paragraph of an option begins with: its names, and what it takes.
std::string tag_of(const ManualOption& option) {
  std::string tag;
  for (const std::string& name : option.names) tag += (tag.empty() ? "" : ", ") + bold(name);
  if (!option.value.empty() && option.names.front().starts_with('-')) tag += " " + italic(option.value);
  return tag;
}

std::string paragraph_of(const ManualOption& option) {
  std::string text = plain(option.description);
  if (!option.by_default.empty()) text += " [" + plain(option.by_default) + "]";
  if (option.required) text += " (required)";
  return ".TP\n" + tag_of(option) + "\n" + text + "\n";
}

std::string synopsis_of(const ManualCommand& command) {
  std::string text = ".B tetwarp " + plain(command.name) + "\n";
  for (const ManualOption& argument : command.arguments)
    text += argument.required ? italic(argument.names.front()) + "\n" : "[" + italic(argument.names.front()) + "]\n";
  for (const ManualOption& option : command.options)
    if (option.required) text += bold(option.names.front()) + " " + italic(option.value) + "\n";
  return text + (command.options.empty() ? "[" + italic("ARGUMENTS") + "]\n" : "[" + italic("OPTIONS") + "]\n");
}

/// As docs/reference/exit-status.md has it.
constexpr std::string_view kExitStatus =
    ".SH EXIT STATUS\n"
    ".TP\n0\nAll done.\n"
    ".TP\n1\nIt failed: the output exists, the disk is full, there is no such backend.\n"
    ".TP\n2\nThe command line is wrong, or an output is, is inside or is around what is read.\n"
    ".TP\n3\nSome or all cases of a batch failed.\n"
    ".TP\n4\nThe input is refused: it is not a usable series, volume or field.\n"
    ".TP\n130\nIt was interrupted; nothing unfinished is left.\n";

std::string page_name(const ManualCommand& command) { return "tetwarp-" + command.name; }

std::string page_of(const ManualCommand& command, const std::string& version) {
  std::string text = heading(page_name(command), version);
  text += plain(page_name(command)) + " \\- " + plain(command.description) + "\n";
  text += ".SH SYNOPSIS\n" + synopsis_of(command);
  if (!command.arguments.empty()) text += ".SH ARGUMENTS\n";
  for (const ManualOption& argument : command.arguments) text += paragraph_of(argument);
  if (!command.options.empty()) text += ".SH OPTIONS\n";
  for (const ManualOption& option : command.options) text += paragraph_of(option);
  text += kExitStatus;
  if (!command.example.empty()) text += ".SH EXAMPLE\n.nf\n" + plain(command.example) + "\n.fi\n";
  return text + ".SH SEE ALSO\n.BR tetwarp (1)\n";
}

std::string main_page(const Manual& manual, const std::string& version) {
  std::string text = heading("tetwarp", version);
  text += "tetwarp \\- " + plain(manual.description) + "\n";
  text += ".SH SYNOPSIS\n.B tetwarp\n" + italic("COMMAND") + " [" + italic("ARGUMENTS") +
          "]\n.br\n.B tetwarp \\-\\-version\n.br\n.B tetwarp\n[" + italic("COMMAND") + "] " + bold("--help") + "\n";
  text += ".SH COMMANDS\nEach has a page of its own.\n";
  for (const ManualCommand& command : manual.commands)
    text += ".TP\n" + bold(command.name) + "\n" + plain(command.description) + "\n";
  text += kExitStatus;
  text += ".SH SEE ALSO\n";
  for (const ManualCommand& command : manual.commands)
    text += ".BR " + plain(page_name(command)) + " (1)" + (&command == &manual.commands.back() ? "\n" : ",\n");
  return text;
}

}  // namespace

std::vector<ManualFile> man_pages(const Manual& manual, const std::string& version) {
  std::vector<ManualFile> pages = {{"man/man1/tetwarp.1", main_page(manual, version)}};
  for (const ManualCommand& command : manual.commands)
    pages.push_back({"man/man1/" + page_name(command) + ".1", page_of(command, version)});
  return pages;
}

}  // namespace tetwarp::apps
