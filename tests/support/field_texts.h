// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

/// The text of an elastix parameter file that moves by 1 mm along x. @param initial  the file of its initial transform
inline std::string translation(const std::string& initial) {
  return "(Transform \"TranslationTransform\")\n(NumberOfParameters 3)\n(TransformParameters 1 0 0)\n"
         "(InitialTransformParametersFileName \"" +
         initial + "\")\n(HowToCombineTransforms \"Compose\")\n";
}

/// The text of a Gmsh file, MSH 2.2: a tetrahedron around everything. @param x  moves one of its vertices, mm
inline std::string tetrahedron(int x) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 " + std::to_string(x - 1000) +
         " -1000 -1000\n2 3000 -1000 -1000\n3 -1000 3000 -1000\n4 -1000 -1000 3000\n$EndNodes\n"
         "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n";
}
