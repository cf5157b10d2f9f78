// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "deform/vertex_field.h"
#include "io/field_file.h"
#include "io/mesh_cells.h"

namespace tetwarp {

/// What `tetwarp info` tells of a mesh file. Its direction is forward, by the format.
struct MeshFileHeader {
  std::string format;                                     ///< "Gmsh MSH 4.1, binary"
  std::uint64_t vertices = 0, tetrahedra = 0;             ///< of the TetrahedralMesh
  std::array<std::uint64_t, kCellShapes.size()> cells{};  ///< in the file, in order of kCellShapes
  std::vector<std::string> arrays;                        ///< vectors at the vertices: "U", or "U, step 3"
  std::string displacement;                               ///< one of these, or "positions of FILE"; empty: undecided
  std::optional<double> largest_mm;                       ///< longest displacement; empty: undecided
  std::string frame = "LPS";                              ///< LPS or RAS, of the file
  std::string units = "mm";                               ///< mm or m, of the file
  FieldBasis frame_basis = FieldBasis::assumed, units_basis = FieldBasis::assumed;
  std::optional<Geometry> lattice;  ///< of which Tetwarp made the mesh; its vertices are snapped as the lattice's are
  std::vector<std::string> notes;   ///< for people: what was left out or made simpler
};

struct MeshFile {
  MeshFileHeader header;
  Geometry lattice;      ///< that the mesh was made of, where it has `lattice_vertex`
  TetrahedralMesh mesh;  ///< LPS mm; only vertices of tetrahedra, in the order of the file's vertex numbers
};

/// @throws InputError for options that mesh files have not, or with an unknown value
void check_mesh_options(const FieldSource& source);

/// Whether a format of io/meshes/mesh_format.h takes the file, and it holds volume cells (not a surface).
bool is_mesh_file(const std::filesystem::path& path);

/// Reads a whole mesh of any format of io/meshes/mesh_format.h (docs/reference/fields.md lists them), cells of all
/// shapes split into tetrahedra (MeshCells), quadratic ones by their corners. Displacements are computed in double and
/// rounded to float once.
///
/// Options of the source, all optional:
/// - displacement=NAME: the vectors to take; else the only ones, or those called displacement, Displacement, U or u
/// - step=N: of vectors with several time steps
/// - deformed=FILE: a second mesh with the same vertices and cells, whose positions are the deformed ones
/// - frame=lps|ras, units=mm|m: of both files; LPS mm unless given or stated
///
/// @throws InputError for a file that is damaged or no mesh, a displacement that cannot be decided (all are listed),
/// or a number that is not finite (the first such vertex is named)
MeshFile read_mesh_file(const FieldSource& source);
/// As `read_mesh_file`, the whole file is read; but where no displacement can be decided it is left empty.
MeshFileHeader read_mesh_header(const FieldSource& source);

}  // namespace tetwarp
