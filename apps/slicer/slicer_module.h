// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>
#include <vector>

namespace tetwarp::apps {

// Commands of tetwarp as command line modules of 3D Slicer, by the Slicer Execution Model
// (https://slicer.readthedocs.io/en/latest/developer_guide/modules/slicerexecutionmodel.html): a program that describes
// itself with --xml, takes files, and prints its progress.

/// A parameter, as the element of that name in the description.
struct SlicerParameter {
  std::string element;  ///< image, transform, file, boolean, integer, double, string or string-enumeration
  std::string name;     ///< of the parameter, and of its long flag; a name in capitals has its place by `index`
  std::string label, description;
  std::string channel = {};     ///< input or output, of a file
  std::string attributes = {};  ///< further ones of the element
  std::string by_default = {};
  std::vector<std::string> choices = {};
  int index = -1;  ///< place among the arguments; below 0 it has a flag
};

struct SlicerGroup {
  std::string label, description;
  std::vector<SlicerParameter> parameters;
};

struct SlicerModule {
  std::string command;  ///< of tetwarp
  std::string title, description;
  std::vector<SlicerGroup> groups;
};

/// The module of a command: deform, invert or simulate.
const SlicerModule& slicer_module(const std::string& command);

/// How the module describes itself. @param version  of the program
std::string xml_of(const SlicerModule& module, const std::string& version);

/// The arguments of tetwarp that do what the arguments of a module say. Values that are empty are left out.
/// @throws UsageError for an argument that the module does not have
std::vector<std::string> command_line_of(const SlicerModule& module, std::span<const std::string> arguments);

/// Runs a module: its description for --xml, else the command, with its progress on standard output.
/// @return the exit status (docs/reference/exit-status.md)
int run_slicer_module(const std::string& command, int argc, char** argv);

}  // namespace tetwarp::apps
