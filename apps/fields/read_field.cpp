// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/fields/read_field.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/cli/console.h"
#include "apps/cli/input.h"
#include "deform/core/five_tetrahedra.h"

namespace tetwarp::apps {

namespace {

TransformFile read_any(const NamedTransform& transform) {
  return read_transform_file(transform.file, interrupt_token());
}
std::string path_of(const NamedTransform& transform) { return transform.file.path.string(); }

/// A transform that is to map output to input. @throws InputError for one that maps input to output
TransformFile read_pulling(const NamedTransform& named) {
  TransformFile transform = read_any(named);
  require(transform.direction != Direction::forward, [&] {
    return "a transform of " + transform.tool + " maps input to output (moving to fixed), " + path_of(named) +
           "; give it with -f, or its inverse with --pull-field and the option invert=yes behind the others";
  });
  return transform;
}

/// How a file is read that is meant for a volume. @param volume  grid of that volume
FieldSource for_volume(FieldSource file, const Geometry& volume) {
  file.grid = volume;
  return file;
}

std::vector<ReadFieldFile::Part> parts_of(const NamedField& field) {
  std::vector<ReadFieldFile::Part> parts;
  for (const std::filesystem::path& file : files_of(field)) parts.push_back({file.string(), hash_file(file)});
  return parts;
}

/// Notes what the header of a field's file says for people. @param assumed  the direction that is taken where it says
/// none
void note_header(const FieldFileHeader& header, const NamedField& field, const std::string& assumed,
                 FieldOrigin& origin) {
  const std::string path = source_of(field)->path.string();
  if (!header.direction) origin.notes.push_back(path + " does not say its direction: taken as " + assumed);
  for (const std::string& note : header.notes) origin.notes.push_back(path + ": " + note);
  origin.files.push_back({parts_of(field), header});
}

/// What to say of a transform once it was evaluated at every vertex or voxel. @param taken  the direction, for people
void note_transform(TransformFile transform, const NamedField& field, bool pulls, const std::string& taken,
                    FieldOrigin& origin) {
  const std::string path = path_of(std::get<NamedTransform>(field.what));
  if (!transform.direction && !transform.inverted)
    origin.notes.push_back(path + " does not say its direction: taken as " + taken);
  if (transform.direction == Direction::pull && !pulls)
    origin.notes.push_back(path + ": transforms of " + transform.tool + " map output to input; taken as " + taken);
  if (const std::uint64_t outside = *transform.outside; outside > 0) {
    origin.notes.push_back(path + ": " + std::to_string(outside) + (pulls ? " voxels" : " vertices") +
                           " lie outside its domain, " + transform.beyond);
  }
  FieldFileHeader header;
  header.direction = transform.direction;
  header.frame = transform.frame;
  header.units = transform.frame == "index" ? "voxel" : "mm";
  header.absolute = true;
  header.direction_basis = header.frame_basis = header.units_basis = transform.basis;
  header.absolute_basis = FieldBasis::by_format;
  transform.displacement = {};  // only what it is called is kept
  origin.files.push_back({parts_of(field), std::move(header), {}, std::move(transform)});
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
  void add(const NamedField& field, const NamedTransform& named) {
    TransformFile transform = read_any(named);
    add(transform.displacement);
    note_transform(std::move(transform), field, false, "forward, each vertex x goes to T(x)", result_.origin);
  }
  void add(const NamedField& field, const NamedLattice& named) {
    const FieldSource source = for_volume(named.file, volume_);
    note_header(read_field_header(source), field, "forward", result_.origin);
    VertexField next = read_forward_field(source);
    if (is_first_)
      result_.field = std::move(next);
    else
      compose(result_.field, piecewise_affine(next), limits_, control_);
  }
  /// Takes a mesh, which ForwardChoice lets stand first alone.
  void add(const NamedField& field, const NamedMesh& named) {
    MeshFile file = read_mesh_file(named.file);
    const std::string path = named.file.path.string();
    for (const std::string& note : file.header.notes) result_.origin.notes.push_back(path + ": " + note);
    result_.origin.files.push_back({parts_of(field), field_header_of(file.header), file.header});
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

/// Makes one map of points of several, in the order in which a point goes through them.
class PointComposition {
 public:
  /// @param samples    where the map is wanted: there it is sampled if the first is a transform, and there an array
  /// lies
  /// @param direction  in which all of them lead, and how people call it
  PointComposition(const PullChoice& choice, const Geometry& samples, Direction direction, std::string taken,
                   int threads, const Control& control)
      : samples_(samples),
        direction_(direction),
        taken_(std::move(taken)),
        limits_{.threads = threads},
        control_(control) {
    for (const NamedField& field : choice.fields) {
      const auto* transform = std::get_if<NamedTransform>(&field.what);
      transform ? add(field, *transform) : add(field, *source_of(field));
      is_first_ = false;
    }
  }

  ReadPullField result() && { return std::move(result_); }

 private:
  void add(const NamedField& field, const NamedTransform& named) {
    TransformFile transform = direction_ == Direction::pull ? read_pulling(named) : read_any(named);
    if (is_first_) {
      VertexField sampled = sample_on(samples_, transform.displacement, limits_, control_);
      result_.field = {sampled.lattice, std::move(sampled.displacement)};
    } else {
      compose(result_.field, transform.displacement, limits_, control_);
    }
    note_transform(std::move(transform), field, true, taken_, result_.origin);
  }
  void add(const NamedField& field, const FieldSource& file) {
    const FieldSource source = for_volume(file, samples_);
    const FieldFileHeader header = read_field_header(source);
    require(is_first_ || header.has_own_grid,
            "an array has no place of its own, " + source.path.string() +
                ", and behind another field none can be assumed; write it as .nrrd or .nii.gz");
    note_header(header, field, taken_, result_.origin);
    PullField next = read(source, header);
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
  /// From the moving volume to the fixed one every format leads whose registration had the two the other way round, so
  /// only a file that states itself that it is a pull field is refused.
  PullField read(const FieldSource& source, const FieldFileHeader& header) const {
    if (direction_ == Direction::pull) return read_pull_field(source);
    require(header.direction != Direction::pull || header.direction_basis != FieldBasis::stated,
            "a pull field where one from moving to fixed is expected, " + source.path.string());
    FieldFile field = read_field_file(source);
    return {field.grid, std::move(field.displacement)};
  }
  static std::uint64_t count_places(const PullField& field) {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(field.displacement, [](const glm::vec3& by) { return !std::isnan(by.x + by.y + by.z); }));
  }

  const Geometry& samples_;
  Direction direction_;
  std::string taken_;
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

ReadPullField read_field(const PullChoice& choice, const Geometry& output, int threads, const Control& control) {
  return PointComposition(choice, output, Direction::pull, "output to input", threads, control).result();
}

bool is_affine(const PullChoice& choice) {
  return std::ranges::all_of(choice.fields, [](const NamedField& field) {
    const auto* transform = std::get_if<NamedTransform>(&field.what);
    return transform && read_pulling(*transform).affine;
  });
}

ReadPullField read_forward_map(const PullChoice& choice, const Geometry& moving, int threads, const Control& control) {
  return PointComposition(choice, moving, Direction::forward, "moving to fixed", threads, control).result();
}

std::uint64_t field_bytes(const ForwardChoice& choice, const Geometry& volume) {
  for (const NamedField& field : choice.fields) {
    if (const auto* transform = std::get_if<NamedTransform>(&field.what)) read_any(*transform);
    if (const auto* lattice = std::get_if<NamedLattice>(&field.what))
      read_field_header(for_volume(lattice->file, volume));
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
    if (file || bytes == 0)
      bytes += bytes_of_vectors(file ? read_field_header(for_volume(*file, output)).grid.size : output.size);
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
    list.back()["path"] = file.parts.front().path;
    list.back()["sha256"] = file.parts.front().sha256;
    for (const ReadFieldFile::Part& part : std::span(file.parts).subspan(1))
      list.back()["others"].push_back({{"path", part.path}, {"sha256", part.sha256}});
    if (file.transform) {
      list.back()["format"] = file.transform->tool + " transform";
      list.back()["classes"] = file.transform->classes;
      list.back()["inverted"] = file.transform->inverted;
    }
    if (file.mesh) {
      list.back()["vertices"] = file.mesh->vertices;
      list.back()["tetrahedra"] = file.mesh->tetrahedra;
      list.back()["displacement"] = file.mesh->displacement;
    }
  }
  return list;
}

}  // namespace tetwarp::apps
