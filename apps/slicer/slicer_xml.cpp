// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <iostream>

#include "apps/cli/console.h"
#include "apps/cli/markup.h"
#include "apps/cli/options.h"
#include "apps/cli/program.h"
#include "apps/slicer/slicer_module.h"
#include "deform/version.h"

namespace tetwarp::apps {

namespace {

std::string element(const std::string& name, const std::string& text) {
  return "      <" + name + ">" + escaped(text) + "</" + name + ">\n";
}

/// The parts of a parameter in the order of CTK's schema, which is the stricter one of those in use.
std::string xml_of(const SlicerParameter& parameter) {
  std::string text = "    <" + parameter.element;
  if (!parameter.attributes.empty()) text += " " + parameter.attributes;
  text += ">\n" + element("name", parameter.name);
  text += parameter.index < 0 ? element("longflag", "--" + parameter.name)
                              : element("index", std::to_string(parameter.index));
  text += element("description", parameter.description) + element("label", parameter.label);
  if (!parameter.by_default.empty()) text += element("default", parameter.by_default);
  if (!parameter.channel.empty()) text += element("channel", parameter.channel);
  for (const std::string& choice : parameter.choices) text += element("element", choice);
  return text + "    </" + parameter.element + ">\n";
}

}  // namespace

std::string xml_of(const SlicerModule& module, const std::string& version) {
  std::string text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n";
  const auto line = [&](const std::string& name, const std::string& value) {
    text += "  <" + name + ">" + escaped(value) + "</" + name + ">\n";
  };
  line("category", "Registration.Tetwarp");
  line("title", module.title);
  line("description", module.description);
  line("version", version);
  line("license", "Apache-2.0");
  line("contributor", "The Tetwarp authors");
  for (const SlicerGroup& group : module.groups) {
    text += "  <parameters>\n    <label>" + escaped(group.label) + "</label>\n    <description>" +
            escaped(group.description) + "</description>\n";
    for (const SlicerParameter& parameter : group.parameters) text += xml_of(parameter);
    text += "  </parameters>\n";
  }
  return text + "</executable>\n";
}

int run_slicer_module(const std::string& command, int argc, char** argv) {
  const SlicerModule& module = slicer_module(command);
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && arguments[0] == "--xml") {
    std::cout << xml_of(module, version()) << std::flush;
    return std::cout ? 0 : 1;
  }
  if (arguments.size() == 1 && arguments[0] == "--version") return run_program(argc, argv);
  std::vector<std::string> line;
  try {
    line = command_line_of(module, arguments);
  } catch (const UsageError& error) {
    std::fprintf(stderr, "tetwarp-slicer-%s: error: %s\n", command.c_str(), error.what());
    return 2;
  }
  line.insert(line.begin(), "tetwarp");
  std::vector<char*> words;
  for (std::string& word : line) words.push_back(word.data());
  print_filter_progress();
  return run_program(static_cast<int>(words.size()), words.data());
}

}  // namespace tetwarp::apps
