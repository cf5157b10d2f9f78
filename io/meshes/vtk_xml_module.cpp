// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Loads the module that reads XML files of VTK. It is a library of its own, since loading VTK's libraries would slow
// every start of the program by 30 ms.
#include "io/files/module.h"
#include "io/meshes/vtk_file.h"

namespace tetwarp {

std::unique_ptr<VtkFile> open_vtk_xml(const std::filesystem::path& path) {
  using Open = VtkFile*(const char*);
  static Open* const open = function_in_module<Open>(TETWARP_VTK_MODULE, "tetwarp_open_vtk_xml", "XML files of VTK",
                                                     path.string(), ", or write a legacy file (.vtk)");
  return std::unique_ptr<VtkFile>(open(path.c_str()));
}

}  // namespace tetwarp
