// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/fields/read_field.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "deform/core/five_tetrahedra.h"
#include "io/transform_file.h"

namespace tetwarp::apps {

namespace {

TransformFile read(const NamedTransform& transform) { return read_transform_file(transform.file, interrupt_token()); }
std::string path_of(const NamedTransform& transform) { return transform.file.path.string(); }

/// A transform that is to map output to input. @throws InputError for one that maps input to output
TransformFile read_pulling(const NamedTransform& named) {
  TransformFile transform = read(named);
  const std::string file = path_of(named);
  require(transform.direction != Direction::forward,
          "a transform of " + transform.tool + " maps input to output (moving to fixed), " + file +
              "; give it with -f, or its inverse with --pull-field " + file + ":invert=yes");
  return transform;
}

/// How a file is read that is meant for a volume. @param volume  grid of that volume
FieldSource for_volume(FieldSource file, const Geometry& volume) {
  file.grid = volume;
  return file;
}

/// Notes what the header of a field's file says for people. @param assumed  the direction that is taken where it says
/// none
void note_header(const FieldFileHeader& header, const std::string& path, const char* assumed, FieldOrigin& origin) {
  if (!header.direction) origin.notes.push_back(path + " does not say its direction: taken as " + assumed);
  for (const std::string& note : header.notes) origin.notes.push_back(path + ": " + note);
  origin.files.push_back({path, header});
}

/// What to say of a transform once it was evaluated at every vertex or voxel.
void note_transform(const TransformFile& transform, const std::string& path, bool pulls, FieldOrigin& origin) {
  const std::string taken = pulls ? "output to input" : "forward, each vertex x goes to T(x)";
  if (!transform.direction) origin.notes.push_back(path + " does not say its direction: taken as " + taken);
  if (transform.direction == Direction::pull && !pulls)
    origin.notes.push_back(path + ": transforms of " + transform.tool + " map output to input; taken as " + taken);
  if (const std::uint64_t outside = *transform.outside; outside > 0) {
    origin.notes.push_back(path + ": " + std::to_string(outside) + (pulls ? " voxels" : " vertices") +
                           " lie outside its domain, " + transform.beyond);
  }
}

FieldFileHeader field_header_of(const MeshFileHeader& mesh) {
  FieldFileHeader header;
  header.format = mesh.format;
  header.direction = Direction::forward;
  header.frame = mesh.frame;
  header.units = mesh.units;
  header.direction_basis = header.absolute_basis = FieldBasis::by_format;
  header.frame_basis = mesh.frame_basis;
  header.units_basis = mesh.units_basis;
  return header;
}

/// Makes one field of several, in the order in which they are applied.
class Composition {
 public:
  Composition(const ForwardChoice& choice, const Geometry& volume, int threads, const Control& control)
      : volume_(volume), cell_size_(choice.cell_size.value_or(1)), limits_{.threads = threads}, control_(control) {
    result_.origin.identity = true;
    for (const NamedField& field : choice.fields) {
      result_.origin.identity = result_.origin.identity && field.text == "identity";
      std::visit([&](const auto& what) { add(field, what); }, field.what);
      is_first_ = false;
    }
  }

  ReadForwardField result() && { return std::move(result_); }

 private:
  void add(const NamedField& field, const NamedFormula&) { add(formula_map(field, volume_)); }
  void add(const NamedField&, const NamedTransform& named) {
    const TransformFile transform = read(named);
    add(transform.displacement);
    note_transform(transform, path_of(named), false, result_.origin);
  }
  void add(const NamedField&, const NamedLattice& named) {
    const FieldSource source = for_volume(named.file, volume_);
    note_header(read_field_header(source), source.path.string(), "forward", result_.origin);
    VertexField next = read_forward_field(source);
    if (is_first_)
      result_.field = std::move(next);
    else
      compose(result_.field, piecewise_affine(next), limits_, control_);
  }
  /// Takes a mesh, which ForwardChoice lets stand first alone.
  void add(const NamedField&, const NamedMesh& named) {
    MeshFile file = read_mesh_file(named.file);
    const std::string path = named.file.path.string();
    for (const std::string& note : file.header.notes) result_.origin.notes.push_back(path + ": " + note);
    result_.origin.files.push_back({path, field_header_of(file.header), file.header});
    result_.field.mesh = std::move(file.mesh);
    result_.field.lattice = file.lattice;
  }
  void add(const PointMap& map) {
    if (is_first_)
      result_.field = sample_on(lattice_over(straightened(volume_), cell_size_), map, limits_, control_);
    else
      compose(result_.field, map, limits_, control_);
  }

  const Geometry& volume_;
  std::int64_t cell_size_;
  Limits limits_;
  const Control& control_;
  ReadForwardField result_;
  bool is_first_ = true;
};

/// Makes one map of several, in the order in which a point goes through them.
class PullComposition {
 public:
  /// @param volume   on which an array without a place lies
  /// @param samples  where the map is wanted, if the first is a transform
  PullComposition(const PullChoice& choice, const Geometry& volume, const Geometry& samples, int threads,
                  const Control& control)
      : volume_(volume), samples_(samples), limits_{.threads = threads}, control_(control) {
    for (const NamedField& field : choice.fields) {
      const auto* transform = std::get_if<NamedTransform>(&field.what);
      transform ? add(*transform) : add(*source_of(field));
      is_first_ = false;
    }
  }

  ReadPullField result() && { return std::move(result_); }

 private:
  void add(const NamedTransform& named) {
    const TransformFile transform = read_pulling(named);
    if (is_first_) {
      VertexField sampled = sample_on(samples_, transform.displacement, limits_, control_);
      result_.field = {sampled.lattice, std::move(sampled.displacement)};
    } else {
      compose(result_.field, transform.displacement, limits_, control_);
    }
    note_transform(transform, path_of(named), true, result_.origin);
  }
  void add(const FieldSource& file) {
    const FieldSource source = for_volume(file, volume_);
    note_header(read_field_header(source), source.path.string(), "output to input", result_.origin);
    PullField next = read_pull_field(source);
    if (is_first_) {
      result_.field = std::move(next);
      return;
    }
    const std::uint64_t before = count_places(result_.field);
    compose(result_.field, between_samples(next), limits_, control_);
    if (const std::uint64_t lost = before - count_places(result_.field); lost > 0)
      result_.origin.notes.push_back(source.path.string() + ": " + std::to_string(lost) +
                                     " samples of what comes before it lead out of its grid, so they have no source");
  }
  static std::uint64_t count_places(const PullField& field) {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(field.displacement, [](const glm::vec3& by) { return !std::isnan(by.x + by.y + by.z); }));
  }

  const Geometry &volume_, &samples_;
  Limits limits_;
  const Control& control_;
  ReadPullField result_;
  bool is_first_ = true;
};

std::uint64_t bytes_of_vectors(const glm::i64vec3& size) {
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(glm::vec3);
}

}  // namespace

ReadForwardField read_field(const ForwardChoice& choice, const Geometry& volume, int threads, const Control& control) {
  return Composition(choice, volume, threads, control).result();
}

ReadPullField read_field(const PullChoice& choice, const Geometry& volume, const Geometry& output, int threads,
                         const Control& control) {
  return PullComposition(choice, volume, output, threads, control).result();
}

ReadPullField read_point_map(const PullChoice& choice, const Geometry& volume, const Geometry& grid, bool forward,
                             int threads, const Control& control) {
  const FieldSource* file = source_of(choice.fields.front());
  if (!forward || !file || choice.fields.size() > 1) return read_field(choice, volume, grid, threads, control);
  ReadPullField result;
  const FieldSource source = for_volume(*file, grid);
  note_header(read_field_header(source), source.path.string(), "moving to fixed", result.origin);
  VertexField field = read_forward_field(source);
  result.field = {field.lattice, std::move(field.displacement)};
  return result;
}

std::uint64_t field_bytes(const ForwardChoice& choice, const Geometry& volume) {
  for (const NamedField& field : choice.fields) {
    if (const auto* transform = std::get_if<NamedTransform>(&field.what)) read(*transform);
  }
  const auto& first = choice.fields.front().what;
  if (const auto* mesh = std::get_if<NamedMesh>(&first)) {
    constexpr std::uint64_t kVertex =
                                sizeof(glm::dvec3) + sizeof(glm::vec3) + sizeof(std::int64_t) + 2 * sizeof(Vertex),
                            kTetrahedron = sizeof(glm::u32vec4) + 32;  // snapped twice; in lists
    const MeshFileHeader header = read_mesh_header(mesh->file);
    return header.vertices * kVertex + header.tetrahedra * kTetrahedron;
  }
  if (const auto* lattice = std::get_if<NamedLattice>(&first))
    return bytes_of_vectors(read_field_header(lattice->file).grid.size);
  return bytes_of_vectors(lattice_over(straightened(volume), choice.cell_size.value_or(1)).size);
}

std::uint64_t field_bytes(const PullChoice& choice, const Geometry& output) {
  std::uint64_t bytes = 0;
  for (const NamedField& field : choice.fields) {
    const FieldSource* file = source_of(field);
    if (!file) read_pulling(std::get<NamedTransform>(field.what));
    if (file || bytes == 0) bytes += bytes_of_vectors(file ? read_field_header(*file).grid.size : output.size);
  }
  return bytes;
}

nlohmann::json to_json(const FieldFileHeader& header) {
  const bool known = header.direction.has_value();
  return {{"format", header.format},
          {"direction", known ? to_string(*header.direction) : "not stated"},
          {"frame", header.frame},
          {"units", header.units},
          {"absolute", header.absolute},
          {"known",
           {{"direction", known ? to_string(header.direction_basis) : "not stated"},
            {"frame", to_string(header.frame_basis)},
            {"units", to_string(header.units_basis)},
            {"absolute", to_string(header.absolute_basis)}}}};
}

nlohmann::json to_json(const std::vector<ReadFieldFile>& files) {
  nlohmann::json list = nlohmann::json::array();
  for (const ReadFieldFile& file : files) {
    list.push_back(to_json(file.header));
    list.back()["path"] = file.path;
    if (file.mesh) {
      list.back()["vertices"] = file.mesh->vertices;
      list.back()["tetrahedra"] = file.mesh->tetrahedra;
      list.back()["displacement"] = file.mesh->displacement;
    }
  }
  return list;
}

}  // namespace tetwarp::apps
