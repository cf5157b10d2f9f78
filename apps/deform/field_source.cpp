// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/field_source.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/cli/output.h"
#include "deform/core/five_tetrahedra.h"
#include "deform/fields/formula.h"
#include "deform/fields/lattice_mesh.h"
#include "io/field_file.h"
#include "io/hash.h"
#include "io/opened_file.h"
#include "io/transform_file.h"

namespace tetwarp::apps {

namespace {

/// One -f: a formula or a file.
PointMap formula_map(const std::string& text, const Geometry& volume) {
  try {
    return parse_formula(text, volume);
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

/// What the header of a field file has to say.
void note_header(const FieldFileHeader& header, const std::string& path, std::vector<std::string>& notes) {
  for (const std::string& note : header.notes) notes.push_back(path + ": " + note);
}

VertexField read_file(const std::string& text, const Geometry& volume, NiftiFrame frame, ForwardField& result) {
  const FieldSource source = field_source(text, volume, frame);
  const FieldFileHeader header = read_field_header(source);
  const std::string path = source.path.string();
  if (!header.direction) result.notes.push_back(path + " does not say its direction: taken as forward");
  note_header(header, path, result.notes);
  result.files.push_back({path, header});
  return tetwarp::read_forward_field(source);
}

enum class FieldKind { formula, transform, lattice, mesh };

FieldKind kind_of(const std::string& text) {
  if (is_formula(text)) return FieldKind::formula;
  if (is_transform_file(text)) return FieldKind::transform;
  return is_mesh_file(parse_field_source(text).path) ? FieldKind::mesh : FieldKind::lattice;
}

/// Whether the vertices are where the text says.
bool has_vertices(FieldKind kind) { return kind == FieldKind::lattice || kind == FieldKind::mesh; }

void read_mesh(const std::string& text, ForwardField& result) {
  const FieldSource source = field_source(text);
  MeshFile file = read_mesh_file(source);
  const std::string path = source.path.string();
  for (const std::string& note : file.header.notes) result.notes.push_back(path + ": " + note);
  FieldFileHeader header;
  header.format = file.header.format;
  header.direction = Direction::forward;
  header.frame = file.header.frame;
  header.units = file.header.units;
  header.direction_basis = header.absolute_basis = FieldBasis::by_format;
  header.frame_basis = file.header.frame_basis;
  header.units_basis = file.header.units_basis;
  result.files.push_back({path, header, file.header});
  result.field.mesh = std::move(file.mesh);
  result.field.lattice = file.lattice;
}

/// A bad transform is refused before volumes are read.
void check_transform(const std::string& text) {
  if (kind_of(text) == FieldKind::transform) read_transform_file(text, interrupt_token());
}

/// What to say of a transform once it was evaluated at every vertex or voxel.
void note_transform(const TransformFile& transform, const std::string& path, Direction direction,
                    std::vector<std::string>& notes) {
  const std::string taken = direction == Direction::pull ? "output to input" : "forward, each vertex x goes to T(x)";
  if (!transform.pulls) notes.push_back(path + " does not say its direction: taken as " + taken);
  if (transform.pulls && direction == Direction::forward)
    notes.push_back(path + ": transforms of " + transform.tool + " map output to input; taken as " + taken);
  if (const std::uint64_t outside = *transform.outside; outside > 0) {
    notes.push_back(path + ": " + std::to_string(outside) + (direction == Direction::pull ? " voxels" : " vertices") +
                    " lie outside its domain, " + transform.beyond);
  }
}

void add_geometry(const Geometry& lattice, Sha256& hash) {
  const auto bytes_of = [](const auto& value) { return std::as_bytes(std::span(&value, 1)); };
  hash.add(bytes_of(lattice.size))
      .add(bytes_of(lattice.spacing))
      .add(bytes_of(lattice.origin))
      .add(bytes_of(lattice.direction));
}

std::string hash_samples(const Geometry& lattice, const std::vector<glm::vec3>& displacement,
                         const std::string& direction, int threads) {
  Sha256 hash;
  hash.add("tetwarp field").add(direction);
  add_geometry(lattice, hash);
  return hash.add_blocks(std::as_bytes(std::span(displacement)), threads).hex();
}

/// The displacement of a formula or a transform, and what to say of it afterwards.
struct NamedMap {
  PointMap map;
  std::optional<TransformFile> transform;
};

NamedMap map_of(const std::string& text, const Geometry& volume) {
  if (is_formula(text)) return {formula_map(text, volume), {}};
  TransformFile transform = read_transform_file(text, interrupt_token());
  return {transform.displacement, std::move(transform)};
}

FieldSource parsed_source(const std::string& text) {
  try {
    return parse_field_source(text);
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

}  // namespace

FieldSource field_source(const std::string& text, const std::optional<Geometry>& volume, NiftiFrame frame) {
  FieldSource source = parsed_source(text);
  source.nifti_frame = frame;
  const bool mesh = is_mesh_file(source.path);  // a file that cannot be read is no mistake of the command line
  try {
    if (mesh) {
      check_mesh_options(source);
    } else {
      check_field_options(source);
    }
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
  source.grid = volume;
  return source;
}

void check_fields(const std::vector<std::string>& fields, std::optional<std::int64_t> cell_size) {
  if (fields.empty()) throw UsageError("no field; give -f FIELD or --pull-field FILE");
  Geometry any;
  any.size = glm::i64vec3(2);
  for (const std::string& text : fields) {
    if (is_formula(text)) {
      formula_map(text, any);  // a misspelled one is known before anything is read
    } else if (found_at(field_source(text).path) == Found::nothing) {
      throw UsageError("\"" + text + "\" is neither a formula nor a file that exists; see tetwarp deform --help");
    }
  }
  for (std::size_t n = 1; n < fields.size(); ++n) {
    if (kind_of(fields[n]) == FieldKind::mesh) {
      throw UsageError("the mesh " + fields[n] +
                       " comes after another field, but moves its own vertices alone; let it be the first -f");
    }
  }
  if (!cell_size) return;
  if (*cell_size < 1) throw UsageError("--cell-size is " + std::to_string(*cell_size) + ", expected at least 1");
  if (has_vertices(kind_of(fields.front())))
    throw UsageError("--cell-size is for formulas and transforms, " + fields.front() + " has its own vertices");
}

std::string title_without_names(const std::vector<std::string>& fields) {
  std::string title;
  for (const std::string& text : fields)
    title += (title.empty() ? "" : ", then ") + (is_formula(text) ? text : std::string("a field of a file"));
  return title.empty() ? "deformed" : title;
}

std::string title_of_fields(const std::vector<std::string>& fields, const std::string& pull_field) {
  if (!pull_field.empty()) return "pull field " + field_source(pull_field).path.filename().string();
  std::string text;
  for (const std::string& field : fields) {
    text +=
        (text.empty() ? "" : ", then ") + (is_formula(field) ? field : field_source(field).path.filename().string());
  }
  return text;
}

std::uint64_t field_bytes(const std::vector<std::string>& fields, const Geometry& volume,
                          std::optional<std::int64_t> cell_size, NiftiFrame frame) {
  for (const std::string& text : fields) check_transform(text);
  const FieldKind kind = kind_of(fields.front());
  if (kind == FieldKind::mesh) {
    constexpr std::uint64_t kVertex =
                                sizeof(glm::dvec3) + sizeof(glm::vec3) + sizeof(std::int64_t) + 2 * sizeof(Vertex),
                            kTetrahedron = sizeof(glm::u32vec4) + 32;  // snapped twice; in lists
    const MeshFileHeader header = read_mesh_header(field_source(fields.front()));
    return header.vertices * kVertex + header.tetrahedra * kTetrahedron;
  }
  const glm::i64vec3 size = kind == FieldKind::lattice
                                ? read_field_header(field_source(fields.front(), {}, frame)).grid.size
                                : lattice_over(straightened(volume), cell_size.value_or(1)).size;
  return static_cast<std::uint64_t>(size.x * size.y * size.z) * sizeof(glm::vec3);
}

ForwardField read_forward_field(const std::vector<std::string>& fields, const Geometry& volume,
                                std::optional<std::int64_t> cell_size, const CommonOptions& common,
                                const Control& control) {
  check_fields(fields, cell_size);
  const Limits limits{.threads = common.threads};
  ForwardField result;
  result.identity = true;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    const std::string& text = fields[n];
    result.identity = result.identity && text == "identity";
    const FieldKind kind = kind_of(text);
    if (kind == FieldKind::mesh) {  // the first, as was checked
      read_mesh(text, result);
      continue;
    }
    if (kind == FieldKind::lattice) {
      VertexField next = read_file(text, volume, common.nifti_frame, result);
      if (n == 0)
        result.field = std::move(next);
      else
        compose(result.field, piecewise_affine(next), limits, control);
      continue;
    }
    const NamedMap next = map_of(text, volume);
    if (n == 0)
      result.field = sample_on(lattice_over(straightened(volume), cell_size.value_or(1)), next.map, limits, control);
    else
      compose(result.field, next.map, limits, control);
    if (next.transform) note_transform(*next.transform, text, Direction::forward, result.notes);
  }
  return result;
}

namespace {

/// Of a pull field. @throws InputError for a mesh, which is a forward one
FieldSource pull_source(const std::string& text, const std::optional<Geometry>& volume, NiftiFrame frame) {
  FieldSource source = field_source(text, volume, frame);
  require(!is_mesh_file(source.path),
          "a mesh, " + source.path.string() + ", says where its vertices go; give it with -f");
  return source;
}

}  // namespace

PullField read_pull_field(const std::string& text, const Geometry& volume, const Geometry& output,
                          const CommonOptions& common, const Control& control, AnyField& found) {
  if (is_transform_file(text)) {
    const TransformFile transform = read_transform_file(text, interrupt_token());
    VertexField sampled = sample_on(output, transform.displacement, {.threads = common.threads}, control);
    note_transform(transform, text, Direction::pull, found.notes);
    return {sampled.lattice, std::move(sampled.displacement)};
  }
  const FieldSource source = pull_source(text, volume, common.nifti_frame);
  const std::string path = source.path.string();
  found.files.push_back({path, read_field_header(source)});
  if (!found.files.back().header.direction)
    found.notes.push_back(path + " does not say its direction: taken as output to input");
  note_header(found.files.back().header, path, found.notes);
  return tetwarp::read_pull_field(source);
}

glm::i64vec3 pull_grid_size(const std::string& text, const Geometry& output, NiftiFrame frame) {
  if (!is_transform_file(text)) return read_field_header(pull_source(text, {}, frame)).grid.size;
  check_transform(text);
  return output.size;
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

nlohmann::json to_json(const std::vector<ReadField>& files) {
  nlohmann::json list = nlohmann::json::array();
  for (const ReadField& file : files) {
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

namespace {

/// Whether a field with a mesh is a lattice with replaced cells, or was made of a lattice.
bool has_lattice(const VertexField& field) {
  return !field.replaced.empty() || (!field.mesh.lattice_vertex.empty() && field.lattice.size.x != 0);
}

}  // namespace

nlohmann::json place_json(const VertexField& field) {
  if (field.mesh.is_empty()) return {{"lattice", to_json(field.lattice)}};
  nlohmann::json place = {
      {"mesh", {{"vertices", field.mesh.rest.size()}, {"tetrahedra", field.mesh.tetrahedra.size()}}}};
  if (has_lattice(field)) place["lattice"] = to_json(field.lattice);
  if (!field.replaced.empty()) place["replaced_cells"] = field.replaced.size();
  return place;
}

PullField resting_pull_field(const Geometry& output) {
  Geometry corners = output;
  corners.size = glm::i64vec3(2);
  corners.spacing = output.spacing * glm::dvec3(output.size - std::int64_t{1});
  return {corners, std::vector<glm::vec3>(8, glm::vec3(0))};
}

std::string hash_field(const VertexField& field, int threads) {
  if (field.mesh.is_empty()) return hash_samples(field.lattice, field.displacement, "forward", threads);
  const TetrahedralMesh whole = field.replaced.empty() ? TetrahedralMesh{} : mesh_of(field);
  const TetrahedralMesh& mesh = field.replaced.empty() ? field.mesh : whole;
  Sha256 hash;
  hash.add("tetwarp mesh");
  const std::uint64_t sizes[] = {mesh.rest.size(), mesh.tetrahedra.size()};
  hash.add(std::as_bytes(std::span(sizes)));
  hash.add(std::as_bytes(std::span(mesh.rest)));
  hash.add(std::as_bytes(std::span(mesh.displacement)));
  if (has_lattice(field)) {
    add_geometry(field.lattice, hash);
    hash.add(std::as_bytes(std::span(mesh.lattice_vertex)));
  }
  return hash.add_blocks(std::as_bytes(std::span(mesh.tetrahedra)), threads).hex();
}

std::string hash_field(const PullField& field, int threads) {
  return hash_samples(field.grid, field.displacement, "pull", threads);
}

std::string AnyField::hash(int threads) const {
  return direction == Direction::pull ? hash_field(pull, threads) : hash_field(forward.field, threads);
}

nlohmann::json AnyField::place() const {
  if (direction == Direction::pull) return {{"lattice", to_json(pull.grid)}};
  return place_json(forward.field);
}

std::uint64_t AnyField::size_bytes() const {
  const auto bytes_of = [](const auto& values) { return std::as_bytes(std::span(values)).size(); };
  const VertexField& field = forward.field;
  return bytes_of(pull.displacement) + bytes_of(field.displacement) + bytes_of(field.mesh.rest) +
         bytes_of(field.mesh.displacement) + bytes_of(field.mesh.tetrahedra) + bytes_of(field.mesh.lattice_vertex) +
         bytes_of(field.replaced);
}

}  // namespace tetwarp::apps
