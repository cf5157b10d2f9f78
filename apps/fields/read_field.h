// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/fields/any_field.h"
#include "apps/fields/field_choice.h"
#include "io/mesh_file.h"

namespace tetwarp::apps {

/// A field file that was read, and what its header says.
struct ReadFieldFile {
  std::string path;
  FieldFileHeader header;
  std::optional<MeshFileHeader> mesh = {};  ///< of a mesh: then `header` has no grid
};

/// What is said of a field that was read.
struct FieldOrigin {
  bool identity = false;             ///< nothing moves, by its formula
  std::vector<std::string> notes;    ///< for people: what was assumed
  std::vector<ReadFieldFile> files;  ///< those that were files of fields, in order
};

struct ReadForwardField {
  VertexField field;
  FieldOrigin origin;
};
struct ReadPullField {
  PullField field;
  FieldOrigin origin;
};

/// Fields composed vertex by vertex. The lattice is that of the first if it is a file of one, else one over `volume`
/// with a vertex every `cell_size` voxels, 1 if that is not said. If the first is a mesh, the vertices are the mesh's.
/// Formulas need no disk. @throws InputError for unusable files; Cancelled
ReadForwardField read_field(const ForwardChoice& choice, const Geometry& volume, int threads, const Control& control);
/// The pull fields of files, composed sample by sample: each point goes through the first, and from there on. The grid
/// is that of the first file of a field; if the first is a transform, `output`. Arrays without a place lie on `volume`.
/// @throws InputError for an unusable file; Cancelled
ReadPullField read_field(const PullChoice& choice, const Geometry& volume, const Geometry& output, int threads,
                         const Control& control);

/// The displacement field or transform of a registration, in either direction: it leads from the points of `grid` to
/// those of the volume with the grid `volume`. A field file that states a direction has to state this one.
/// @param forward  whether that is the direction from the moving to the fixed volume, the forward one
/// @throws InputError for an unusable file; Cancelled
ReadPullField read_point_map(const PullChoice& choice, const Geometry& volume, const Geometry& grid, bool forward,
                             int threads, const Control& control);

/// Memory of the field that `read_field` will give, with what a mesh needs for its own work. Transforms and meshes are
/// read, so that a bad one is known early.
std::uint64_t field_bytes(const ForwardChoice& choice, const Geometry& volume);
std::uint64_t field_bytes(const PullChoice& choice, const Geometry& output);

/// What a header says and how that is known, without the grid.
nlohmann::json to_json(const FieldFileHeader& header);
nlohmann::json to_json(const std::vector<ReadFieldFile>& files);

}  // namespace tetwarp::apps
