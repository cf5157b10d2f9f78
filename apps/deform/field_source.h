// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/console.h"
#include "apps/simulate/simulated_field.h"
#include "deform/vertex_field.h"
#include "io/field_file.h"
#include "io/mesh_file.h"

namespace tetwarp::apps {

/// A field file that was read, and what its header says.
struct ReadField {
  std::string path;
  FieldFileHeader header;
  std::optional<MeshFileHeader> mesh = {};  ///< of a mesh: then `header` has no grid
};

/// A forward field from the command line.
struct ForwardField {
  VertexField field;
  bool identity = false;           ///< nothing moves, by its formula
  std::vector<std::string> notes;  ///< for people: what was assumed
  std::vector<ReadField> files;    ///< those that were files, in order
};

/// The field of either direction, with what is said about it.
struct AnyField {
  Direction direction = Direction::forward;
  ForwardField forward;
  PullField pull;
  std::vector<std::string> notes;
  std::vector<ReadField> files;
  std::optional<SimulationSource> simulation;  ///< of a simulated one

  std::string hash(int threads) const;
  nlohmann::json place() const;
  std::uint64_t size_bytes() const;
};

/// A file from the command line, `PATH` or `PATH:KEY=VALUE,...`, for a volume. It is not read yet and need not exist.
/// @throws UsageError for options that do not go with it
FieldSource field_source(const std::string& text, const std::optional<Geometry>& volume = {},
                         NiftiFrame frame = NiftiFrame::sform);

/// Formulas, transforms and fields, composed vertex by vertex, the first applied first. The lattice is that of the
/// first if it is a field file, else one over `volume` with a vertex every `cell_size` voxels. If the first is a mesh,
/// the vertices are the mesh's; it cannot come later.
/// @throws UsageError for a text that is no formula and no file, or a cell size with a field file; InputError for
/// unusable files
ForwardField read_forward_field(const std::vector<std::string>& fields, const Geometry& volume,
                                std::optional<std::int64_t> cell_size, const CommonOptions& common,
                                const Control& control);

/// Checks texts and names of files without reading vectors, for a command that should fail early.
/// @throws UsageError and InputError as `read_forward_field`
void check_fields(const std::vector<std::string>& fields, std::optional<std::int64_t> cell_size);

/// Fields by name, files without their folders: "wave:amplitude=8, then twist.mha".
std::string title_of_fields(const std::vector<std::string>& fields, const std::string& pull_field);

/// Title of the fields of a de-identified volume: formulas, and that there was a file, but not its name.
std::string title_without_names(const std::vector<std::string>& fields);

/// Memory of the field that `read_forward_field` will make, with what a mesh needs beside its own. Transforms and
/// meshes are read, so that a bad one is known early.
std::uint64_t field_bytes(const std::vector<std::string>& fields, const Geometry& volume,
                          std::optional<std::int64_t> cell_size, NiftiFrame frame);

/// The pull field of a file for `volume`, or a transform sampled at every voxel centre of `output`.
/// @param found  receives what was read and what was assumed
PullField read_pull_field(const std::string& text, const Geometry& volume, const Geometry& output,
                          const CommonOptions& common, const Control& control, AnyField& found);

/// Size of the grid that `read_pull_field` will give. A transform is read.
glm::i64vec3 pull_grid_size(const std::string& text, const Geometry& output, NiftiFrame frame);

/// What a header says and how that is known, without the grid.
nlohmann::json to_json(const FieldFileHeader& header);
nlohmann::json to_json(const std::vector<ReadField>& files);

/// A pull field in which nothing moves: it takes a volume from its own grid onto `output`.
PullField resting_pull_field(const Geometry& output);

/// SHA-256 of what decides a field, its direction, place and numbers (Sha256::add_blocks), hexadecimal: the same for a
/// formula or a simulation and the file it was written to. A lattice with replaced cells counts as the mesh that it is
/// made into (`mesh_of`).
std::string hash_field(const VertexField& field, int threads);
std::string hash_field(const PullField& field, int threads);

/// "lattice" and its geometry, or "mesh" and its size; both where a mesh takes the place of "replaced_cells", or was
/// made of a lattice.
nlohmann::json place_json(const VertexField& field);

}  // namespace tetwarp::apps
