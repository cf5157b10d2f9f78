// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/errors.h"
#include "io/meshes/vtk_file.h"

namespace tetwarp {

std::unique_ptr<VtkFile> open_vtk_xml(const std::filesystem::path& path) {
  throw NotCompiled("XML files of VTK need VTK, and this is built without VTK, " + path.string() +
                    "; build it with TETWARP_WITH_VTK=ON, or write a legacy file (.vtk)");
}

}  // namespace tetwarp
