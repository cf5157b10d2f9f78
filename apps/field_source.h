#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/backend.h"
#include "apps/console.h"
#include "deform/vertex_field.h"
#include "io/field_file.h"

namespace tetwarp::apps {

/// A field file that was read, and what its header says.
struct ReadField {
  std::string path;
  FieldFileHeader header;
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

  const Geometry& lattice() const { return direction == Direction::pull ? pull.grid : forward.field.lattice; }
  const std::vector<glm::vec3>& displacement() const {
    return direction == Direction::pull ? pull.displacement : forward.field.displacement;
  }
};

/// A file from the command line, `PATH` or `PATH:KEY=VALUE,...`, for a volume. It is not read yet and need not exist.
/// @throws UsageError for options that do not go with it
FieldSource field_source(const std::string& text, const std::optional<Geometry>& volume = {});

/// Formulas, transforms and fields, composed vertex by vertex, the first applied first. The lattice is that of the
/// first if it is a field file, else one over `volume` with a vertex every `cell_size` voxels.
/// @throws UsageError for a text that is no formula and no file, or a cell size with a field file; InputError for
/// unusable files
ForwardField read_forward_field(const std::vector<std::string>& fields, const Geometry& volume,
                                std::optional<std::int64_t> cell_size, const CommonOptions& common,
                                const Control& control);

/// Checks texts and files' names without reading vectors: for a command that fails early. @throws as above
void check_fields(const std::vector<std::string>& fields, std::optional<std::int64_t> cell_size);

/// Those of the fields that are files.
std::vector<std::filesystem::path> field_files(const std::vector<std::string>& fields);

/// Size of the lattice that `read_forward_field` will make. Transforms are read, so that a bad one is known early.
glm::i64vec3 lattice_size(const std::vector<std::string>& fields, const Geometry& volume,
                          std::optional<std::int64_t> cell_size);

/// The pull field of a file for `volume`, or a transform sampled at every voxel centre of `output`.
/// @param found  receives what was read and what was assumed
PullField read_pull_field(const std::string& text, const Geometry& volume, const Geometry& output,
                          const CommonOptions& common, const Control& control, AnyField& found);

/// Size of the grid that `read_pull_field` will give. A transform is read.
glm::i64vec3 pull_grid_size(const std::string& text, const Geometry& output);

/// What a header says and how that is known, without the grid.
nlohmann::json to_json(const FieldFileHeader& header);
nlohmann::json to_json(const std::vector<ReadField>& files);

/// SHA-256 over direction, lattice geometry and displacements (Sha256::add_blocks), hexadecimal: the same for a formula
/// and the file it was written to.
std::string hash_field(const Geometry& lattice, const std::vector<glm::vec3>& displacement,
                       const std::string& direction, int threads);

}  // namespace tetwarp::apps
