// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what mesh_file.cpp knows of the formats that it reads. A format is a pair of files, a word of CMake
// and a test.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh_file.h"

namespace tetwarp {

/// Three numbers at each vertex of a mesh file, under a name.
struct MeshVectors {
  std::string name;
  std::optional<std::int64_t> step;  ///< step of time, where the format has steps
  /// By which they can be asked for as well, where no name is that: DEPL of RESU____DEPL. Empty: none.
  std::string short_name{};

  bool operator==(const MeshVectors&) const = default;
};

/// The lattice that a mesh was made of, where a file that Tetwarp wrote states it.
struct MeshLattice {
  Geometry geometry;
  /// By point of the file: see TetrahedralMesh::lattice_vertex.
  std::vector<std::int64_t> vertex;
};

/// A mesh file that was read and checked: vertices and cells, as they are in the file. mesh_file.cpp drops vertices
/// that no cell uses, applies frame and units, and looks for numbers that are not finite.
class MeshReader {
 public:
  explicit MeshReader(const std::filesystem::path& file) : cells(file.string()) {}
  virtual ~MeshReader() = default;

  /// The vectors of `arrays[n]`, one for each vertex of `points`, in the file's frame and units; NaN where the file has
  /// none.
  /// @throws InputError for a file that is damaged
  virtual std::vector<glm::dvec3> vectors(std::size_t n) const = 0;

  std::string format;               ///< the format, with its version: "Gmsh MSH 4.1, binary"
  std::vector<glm::dvec3> points;   ///< at most 2^32 - 1
  std::vector<std::uint64_t> tags;  ///< the file's numbers of the points, rising; empty: 0, 1, 2, ...
  MeshCells cells;                  ///< all corners are below points.size()
  std::vector<MeshVectors> arrays;  ///< vectors at the points; arrays of other than three components are left out
  std::optional<std::string> frame, units;  ///< LPS or RAS, mm or m, where the file states them
  std::vector<std::string> notes;           ///< what was left out, without the file's name: "20 triangles are left out"
  std::optional<MeshLattice> lattice;       ///< where the file states it, as `write_mesh_file` does
};

struct MeshFormat {
  const char* suffixes;  ///< suffixes of files for messages: ".msh"
  /// Whether a file is of this format, by its suffix or its first bytes (up to 64; fewer where it cannot be read).
  bool (*recognizes)(const std::filesystem::path& path, std::string_view first_bytes);
  /// Whether a recognized file holds volume cells, by a quick look; null: it always does. It does not throw for a file
  /// that `open` refuses.
  bool (*holds_mesh)(const std::filesystem::path& path);
  /// Reads a file. It allocates no more than the file's length warrants. @throws InputError naming the file
  std::unique_ptr<MeshReader> (*open)(const std::filesystem::path& path);
};

/// The first format that recognizes the file, in the order of io/CMakeLists.txt, from which this function is made;
/// null: none does.
const MeshFormat* find_mesh_format(const std::filesystem::path& path, std::string_view first_bytes);
/// The suffixes of all formats for messages: ".msh .vtu".
std::string mesh_suffixes();

}  // namespace tetwarp
