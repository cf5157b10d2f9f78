// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: functions in libraries ("modules") that are loaded when one of them is first called. Most runs need
// no module, and loading the libraries that it links would slow the start of each run.
#include <string>

namespace tetwarp {

/// Finds a function of a module and loads the module, which stays until the program ends. The module is looked for
/// where the dynamic linker looks for the libraries of the program: in `lib/tetwarp` of the build, or beside the
/// folder of the program.
/// @param module    file name
/// @param function  an extern "C" name
/// @return null if the module cannot be loaded, or has no such function
void* find_in_module(const char* module, const char* function);

/// Throws the error of a file whose module is missing.
/// @param what       what needs the module: "XML files of VTK"
/// @param path       of the file that was to be read
/// @param otherwise  what to do without the module, ", or ..."; empty: nothing
/// @throws NotCompiled, always
[[noreturn]] void refuse_without_module(const std::string& what, const std::string& module, const std::string& path,
                                        const std::string& otherwise);

/// Finds a function of a module as `find_in_module` does. @tparam Function  its type; the other parameters are those of
/// both functions above. @throws NotCompiled where it is not found
template <class Function>
Function* function_in_module(const char* module, const char* function, const std::string& what, const std::string& path,
                             const std::string& otherwise = "") {
  auto* const found = reinterpret_cast<Function*>(find_in_module(module, function));
  if (!found) refuse_without_module(what, module, path, otherwise);
  return found;
}

}  // namespace tetwarp
