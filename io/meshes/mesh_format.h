// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the seam between mesh_file.cpp and the formats that it reads. A format is a pair of files, a word of
// CMake and a test.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh_file.h"

namespace tetwarp {

/// Three numbers at each vertex of a mesh file.
struct MeshVectors {
  std::string name;
  std::optional<std::int64_t> step;  ///< of the time, where the format has steps

  bool operator==(const MeshVectors&) const = default;
};

/// The lattice that a mesh was made of, as a file of ours states it.
struct MeshLattice {
  Geometry geometry;
  std::vector<std::int64_t> vertex;  ///< TetrahedralMesh::lattice_vertex, one for each of the file's points
};

/// A mesh file that was read and checked: vertices and cells, as they are in the file. mesh_file.cpp drops vertices
/// that no cell uses, applies frame and units, and looks for numbers that are not finite.
class MeshReader {
 public:
  explicit MeshReader(const std::filesystem::path& file) : cells(file.string()) {}
  virtual ~MeshReader() = default;

  /// The vectors number `n` of `arrays`, one a vertex of `points`, in the file's frame and units; NaN where the file
  /// has none. @throws InputError for a file that is damaged
  virtual std::vector<glm::dvec3> vectors(std::size_t n) const = 0;

  std::string format;                       ///< "Gmsh MSH 4.1, binary"
  std::vector<glm::dvec3> points;           ///< at most 2^32 - 1
  std::vector<std::uint64_t> tags;          ///< the file's numbers of the points, rising; empty: 0, 1, 2, ...
  MeshCells cells;                          ///< their corners are checked: below points.size()
  std::vector<MeshVectors> arrays;          ///< only those of three components
  std::optional<std::string> frame, units;  ///< LPS or RAS, mm or m, where this file states them
  std::vector<std::string> notes;           ///< without the file's name: "20 triangles are left out"
  std::optional<MeshLattice> lattice;       ///< where this file states one, as `write_mesh_file` does
};

struct MeshFormat {
  const char* suffixes;  ///< for people: ".msh"
  /// Whether the file is of this format, by its suffix or its first bytes (up to 64; fewer where it cannot be read).
  bool (*claims)(const std::filesystem::path& path, std::string_view first_bytes);
  /// Whether a claimed file holds volume cells, by a quick look; null: always. Does not throw for a file that `open`
  /// refuses.
  bool (*holds_mesh)(const std::filesystem::path& path);
  /// Allocates nothing that the file's length does not warrant. @throws InputError naming the file
  std::unique_ptr<MeshReader> (*open)(const std::filesystem::path& path);
};

/// Of all formats, in the order of io/CMakeLists.txt (the file is made there), the first that claims the file; null:
/// none.
const MeshFormat* find_mesh_format(const std::filesystem::path& path, std::string_view first_bytes);
/// For people: ".msh .vtu".
std::string mesh_suffixes();

}  // namespace tetwarp
