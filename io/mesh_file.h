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

/// What `tetwarp info` shows of a mesh file. Mesh files are forward fields.
struct MeshFileHeader {
  std::string format;          ///< such as "Gmsh MSH 4.1, binary"
  std::uint64_t vertices = 0,  ///< number of vertices of the TetrahedralMesh
      tetrahedra = 0;          ///< number of its tetrahedra
  /// Number of cells of each shape in the file, in the order of kCellShapes.
  std::array<std::uint64_t, kCellShapes.size()> cells{};
  std::vector<std::string> arrays;   ///< vectors at the vertices: "U", or "U, step 3"
  std::string displacement;          ///< which of these is the displacement, or "positions of FILE"; empty: undecided
  std::optional<double> largest_mm;  ///< length of the longest displacement, mm; empty: undecided
  std::string frame = "LPS";         ///< coordinates of the file: LPS or RAS
  std::string units = "mm";          ///< unit of the file: mm or m
  FieldBasis frame_basis = FieldBasis::assumed,  ///< how `frame` is known
      units_basis = FieldBasis::assumed;         ///< how `units` is known
  /// Lattice from which Tetwarp made the mesh; vertices are rounded as those of the lattice.
  std::optional<Geometry> lattice;
  std::vector<std::string> notes;  ///< remarks for people: what was left out or simplified
};

/// A mesh file that was read.
struct MeshFile {
  MeshFileHeader header;  ///< what the file states
  Geometry lattice;       ///< lattice from which the mesh was made, if it has `TetrahedralMesh::lattice_vertex`
  TetrahedralMesh mesh;   ///< LPS mm; only vertices of tetrahedra, in the order of the file's vertex numbers
};

/// Checks the options of a mesh file.
/// @throws InputError for options that mesh files do not have, or with an unknown value
void check_mesh_options(const FieldSource& source);

/// Whether some mesh format reads the file, and it contains volume cells, not a surface.
bool is_mesh_file(const std::filesystem::path& path);

/// Reads a mesh of any format; docs/reference/fields.md lists them. Cells of all shapes are split into tetrahedra by
/// `MeshCells`, quadratic cells by their corners alone. Displacements are computed in double and rounded once to float.
///
/// Options of the source, all of them optional:
/// - displacement=NAME: the vectors that are displacements; otherwise the only vectors, or those called displacement,
///   Displacement, U, u, DISP or DEPL
/// - step=N: which of several time steps
/// - deformed=FILE: a second mesh with the same vertices and cells, whose positions are the deformed ones
/// - table=FILE: displacements by vertex number, a line each: number, ux, uy, uz
/// - frame=lps|ras and units=mm|m: of both files; LPS and mm if neither option nor file states them
///
/// @throws InputError for a file that is damaged or no mesh, a displacement that cannot be decided (the message lists
///         all), or a number that is not finite (the message names the first such vertex)
MeshFile read_mesh_file(const FieldSource& source);
/// Reads a whole mesh as `read_mesh_file` does and returns its header. If the displacement cannot be decided it is left
/// empty.
MeshFileHeader read_mesh_header(const FieldSource& source);

}  // namespace tetwarp
