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
#include "io/transform_file.h"

namespace tetwarp::apps {

/// What was read of a field that is a file.
struct ReadFieldFile {
  struct Part {
    std::string path, sha256;
  };
  std::vector<Part> parts;                      ///< the file, then those that it or its options name
  FieldFileHeader header;                       ///< of a transform nothing but what `transform` says too
  std::optional<MeshFileHeader> mesh = {};      ///< of a mesh: then `header` has no grid
  std::optional<TransformFile> transform = {};  ///< of a transform
};

/// What is said of a field that was read.
struct FieldOrigin {
  bool identity = false;             ///< nothing moves, by its formula
  std::vector<std::string> notes;    ///< for people: what was assumed
  std::vector<ReadFieldFile> files;  ///< those that were no formulas, in order
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
/// is that of the first file of a field, and `output` if the first is a transform or an array without a place.
/// @throws InputError for an unusable file, or an array without a place that is not the first; Cancelled
ReadPullField read_field(const PullChoice& choice, const Geometry& output, int threads, const Control& control);

/// The same for fields and transforms that lead the other way, from the points of the moving volume to the fixed one:
/// those of a registration in its forward direction. Which of its two volumes a transform begins in, its user knows.
/// @throws InputError also for a field that states that it leads back
ReadPullField read_forward_map(const PullChoice& choice, const Geometry& moving, int threads, const Control& control);

/// Whether all its fields are affine transforms. @throws InputError for an unusable one; Cancelled
bool is_affine(const PullChoice& choice);

/// Memory of the field that `read_field` will give, with what a mesh needs for its own work. Transforms and meshes are
/// read, so that a bad one is known early.
std::uint64_t field_bytes(const ForwardChoice& choice, const Geometry& volume);
std::uint64_t field_bytes(const PullChoice& choice, const Geometry& output);

/// What a header says and how that is known, without the grid.
nlohmann::json to_json(const FieldFileHeader& header);
nlohmann::json to_json(const std::vector<ReadFieldFile>& files);

}  // namespace tetwarp::apps
