// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "python/src/fields.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "apps/fields/read_field.h"
#include "deform/fields/continued.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/points.h"
#include "io/staged_output.h"
#include "python/src/calls.h"
#include "python/src/module.h"
#include "python/src/words.h"

namespace tetwarp::python {

namespace {

template <class To, class From>
std::vector<To> copied(const From* from, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<To> && sizeof(To) % sizeof(From) == 0);
  std::vector<To> to(count);
  if (count > 0) std::memcpy(static_cast<void*>(to.data()), from, count * sizeof(To));
  return to;
}

NiftiFrame frame_of(const std::string& word) {
  require(word == "sform" || word == "qform", "nifti_frame is \"" + word + "\"; expected \"sform\" or \"qform\"");
  return word == "sform" ? NiftiFrame::sform : NiftiFrame::qform;
}

/// The forward field that texts of formulas and names of files give on a volume, as `-f` of the program takes them.
nb::tuple read_forward(const std::vector<std::string>& texts, const Geometry& volume,
                       std::optional<std::int64_t> cell_size, const std::string& nifti_frame, int threads,
                       const CallOptions& options) {
  std::optional<apps::ReadForwardField> read;
  run_call(options, false, [&](const Control& control) {
    const apps::ForwardChoice choice = apps::parse_forward_fields(texts, cell_size, frame_of(nifti_frame));
    read = apps::read_field(choice, volume, threads_of(threads), control);
  });
  return nb::make_tuple(as_tuple(std::move(read->field)), read->origin.notes);
}

nb::tuple read_pull(const std::vector<std::string>& texts, const Geometry& volume, const std::string& nifti_frame,
                    int threads, const CallOptions& options) {
  std::optional<apps::ReadPullField> read;
  run_call(options, false, [&](const Control& control) {
    const apps::PullChoice choice = apps::parse_pull_fields(texts, frame_of(nifti_frame));
    read = apps::read_field(choice, straightened(volume), threads_of(threads), control);
  });
  const Geometry grid = read->field.grid;
  return nb::make_tuple(grid, as_numpy(grid, std::move(read->field.displacement)), read->origin.notes);
}

/// The field of a file that says its own grid.
nb::tuple read_file(const std::string& text, const std::string& nifti_frame) {
  VertexField field;
  {
    const WithoutGil released;
    const FieldSource source = apps::parse_field_file(text, frame_of(nifti_frame));
    if (is_mesh_file(source.path) && !is_field_file(source)) {
      MeshFile file = read_mesh_file(source);
      field.mesh = std::move(file.mesh);
      field.lattice = file.lattice;
    } else {
      field = read_forward_field(source);
    }
  }
  return as_tuple(std::move(field));
}

nb::tuple read_pull_file(const std::string& text, const std::string& nifti_frame) {
  PullField field;
  {
    const WithoutGil released;
    field = read_pull_field(apps::parse_field_file(text, frame_of(nifti_frame)));
  }
  const Geometry grid = field.grid;
  return nb::make_tuple(grid, as_numpy(grid, std::move(field.displacement)));
}

void write_forward(const std::filesystem::path& path, const VertexField& field, bool overwrite,
                   const CallOptions& options) {
  run_call(options, field.mesh.is_empty() && std::ssize(field.displacement) < kSmallFile, [&](const Control& control) {
    StagedOutput output(path, StagedOutput::Kind::file, overwrite);
    write_vertex_field(output.path(), field, control, path);
    output.commit();
  });
}

void write_pull(const std::filesystem::path& path, const Geometry& grid, const ConstArray& displacement, bool overwrite,
                const CallOptions& options) {
  const PullField field = pull_field_of(grid, displacement);
  run_call(options, voxel_count(grid) < kSmallFile, [&](const Control& control) {
    StagedOutput output(path, StagedOutput::Kind::file, overwrite);
    write_field_file(output.path(), field, control);
    output.commit();
  });
}

/// Several forward fields on one another, the first applied first.
nb::tuple compose_all(std::vector<VertexField> fields, int threads, const CallOptions& options) {
  require(!fields.empty(), "there is no field to compose; pass at least one");
  run_call(options, false, [&](const Control& control) {
    for (std::size_t n = 1; n < fields.size(); ++n) {
      require(fields[n].mesh.is_empty(),
              "field " + std::to_string(n + 1) +
                  " is a mesh; only the first of several may be one, for a mesh says nothing "
                  "of what lies outside it");
      compose(fields[0], piecewise_affine(fields[n]), {.threads = threads_of(threads)}, control);
    }
  });
  return as_tuple(std::move(fields[0]));
}

/// Points [n, 3] moved by the forward map, and for each whether the field holds it.
nb::tuple move(const Geometry& output, const VertexField& field, const ConstArray& points, const std::string& outside,
               int threads, const CallOptions& options) {
  const auto* given = values_of<double>(points, {-1, 3}, "points");
  std::vector<glm::dvec3> moved = copied<glm::dvec3>(given, points.shape(0));
  for (const glm::dvec3& point : moved) {
    require(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z),
            "points hold a number that is not finite");
  }
  std::vector<std::uint8_t> held(moved.size());
  const Outside beyond = outside_of(outside);
  run_call(options, moved.size() < 1000 && field.displacement.size() < 100000 && field.mesh.is_empty(),
           [&](const Control& control) {
             const auto status =
                 move_points(output, view(field, beyond), moved, {.threads = threads_of(threads)}, control);
             std::transform(status.begin(), status.end(), held.begin(),
                            [](PointStatus one) { return static_cast<std::uint8_t>(one == PointStatus::moved); });
           });
  const std::size_t count = moved.size();
  return nb::make_tuple(as_numpy<double>(std::move(moved), {count, 3}),
                        as_numpy<std::uint8_t>(std::move(held), {count}));
}

/// A pull field as a forward field that leads from where voxels of the output lie to where they come from, so that it
/// can be inverted; as `invert --pull-field` takes it.
nb::tuple continued(const Geometry& grid, const ConstArray& displacement, const Geometry& like) {
  const PullField field = pull_field_of(grid, displacement);
  std::optional<VertexField> forward;
  {
    const WithoutGil released;
    forward = continued_over(field, straightened(like));
  }
  return as_tuple(std::move(*forward));
}

}  // namespace

const glm::vec3* vectors_of(const ConstArray& array, const Geometry& grid) {
  const std::vector<std::int64_t> shape{grid.size.z, grid.size.y, grid.size.x, 3};
  return reinterpret_cast<const glm::vec3*>(values_of<float>(array, shape, "the displacement", true));
}

FieldView ForwardArrays::hold(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                              const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced,
                              const std::string& outside) {
  FieldView field{.outside = outside_of(outside)};
  lattice_ = lattice.value_or(Geometry{});
  if (lattice) field.lattice = &lattice_;
  if (displacement) {
    require(lattice.has_value(), "a displacement without a lattice; pass the lattice's geometry");
    field.displacement = vectors_of(*displacement, lattice_);
    field.memory = memory_of(*displacement, "the displacement");
  }
  mesh_ = mesh ? mesh_of(*mesh) : TetrahedralMesh{};
  if (mesh) field.mesh = &mesh_;
  replaced_.clear();
  if (replaced) {
    const auto* numbers = values_of<std::uint64_t>(*replaced, {-1}, "the replaced cells");
    replaced_.assign(numbers, numbers + replaced->shape(0));
    field.replaced = replaced_;
  }
  require(field.displacement || field.mesh, "the field has neither a displacement nor a mesh");
  displacement_ = displacement;
  return field;
}

bool ForwardArrays::is_small() const {
  return mesh_.is_empty() && (!displacement_ || voxel_count(lattice_) < kSmallCall);
}

PullField pull_field_of(const Geometry& grid, const ConstArray& displacement) {
  const auto* values = values_of<float>(displacement, {grid.size.z, grid.size.y, grid.size.x, 3}, "the displacement");
  return {grid, copied<glm::vec3>(values, static_cast<std::size_t>(voxel_count(grid)))};
}

TetrahedralMesh mesh_of(const MeshArrays& arrays) {
  const std::size_t vertices = arrays.rest.ndim() > 0 ? arrays.rest.shape(0) : 0;
  const auto count = static_cast<std::int64_t>(vertices);
  TetrahedralMesh mesh;
  mesh.rest = copied<glm::dvec3>(values_of<double>(arrays.rest, {count, 3}, "the mesh's rest"), vertices);
  mesh.displacement =
      copied<glm::vec3>(values_of<float>(arrays.displacement, {count, 3}, "the mesh's displacement"), vertices);
  const auto* corners = values_of<std::uint32_t>(arrays.tetrahedra, {-1, 4}, "the mesh's tetrahedra");
  mesh.tetrahedra = copied<glm::u32vec4>(corners, arrays.tetrahedra.shape(0));
  for (const glm::u32vec4& tetrahedron : mesh.tetrahedra) {
    require(
        std::max({tetrahedron.x, tetrahedron.y, tetrahedron.z, tetrahedron.w}) < vertices,
        "the mesh has a tetrahedron of a vertex that is not there; it has " + std::to_string(vertices) + " vertices");
  }
  if (arrays.lattice_vertex) {
    mesh.lattice_vertex = copied<std::int64_t>(
        values_of<std::int64_t>(*arrays.lattice_vertex, {count}, "the mesh's lattice_vertex"), vertices);
  }
  return mesh;
}

VertexField field_of(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                     const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced) {
  VertexField field;
  if (lattice) field.lattice = *lattice;
  if (displacement) {
    require(lattice.has_value(), "a displacement without a lattice; pass the lattice's geometry");
    const glm::i64vec3 size = lattice->size;
    const auto* values = values_of<float>(*displacement, {size.z, size.y, size.x, 3}, "the displacement");
    field.displacement = copied<glm::vec3>(values, static_cast<std::size_t>(voxel_count(*lattice)));
  }
  if (mesh) field.mesh = mesh_of(*mesh);
  if (replaced) {
    field.replaced =
        copied<std::uint64_t>(values_of<std::uint64_t>(*replaced, {-1}, "the replaced cells"), replaced->shape(0));
  }
  return field;
}

nb::tuple as_tuple(VertexField&& field) {
  nb::object lattice = nb::none(), displacement = nb::none(), mesh = nb::none(), replaced = nb::none();
  if (field.lattice.size.x > 0) lattice = nb::cast(field.lattice);
  if (!field.displacement.empty()) displacement = as_numpy(field.lattice, std::move(field.displacement));
  if (!field.mesh.is_empty()) {
    TetrahedralMesh& from = field.mesh;
    const std::size_t vertices = from.rest.size(), tetrahedra = from.tetrahedra.size();
    nb::object numbers = nb::none();
    if (!from.lattice_vertex.empty()) numbers = as_numpy<std::int64_t>(std::move(from.lattice_vertex), {vertices});
    mesh = nb::make_tuple(as_numpy<double>(std::move(from.rest), {vertices, 3}),
                          as_numpy<float>(std::move(from.displacement), {vertices, 3}),
                          as_numpy<std::uint32_t>(std::move(from.tetrahedra), {tetrahedra, 4}), numbers);
  }
  if (!field.replaced.empty()) {
    const std::size_t count = field.replaced.size();
    replaced = as_numpy<std::uint64_t>(std::move(field.replaced), {count});
  }
  return nb::make_tuple(lattice, displacement, mesh, replaced);
}

void add_fields(nb::module_& core) {
  nb::class_<CallOptions>(core, "CallOptions")
      .def(
          "__init__",
          [](CallOptions* self, nb::object progress, std::uintptr_t stream) {
            new (self) CallOptions{std::move(progress), stream};
          },
          nb::arg("progress").none(), nb::arg("stream"));
  nb::class_<MeshArrays>(core, "MeshArrays")
      .def(
          "__init__",
          [](MeshArrays* self, ConstArray rest, ConstArray displacement, ConstArray tetrahedra,
             std::optional<ConstArray> lattice_vertex) {
            new (self)
                MeshArrays{std::move(rest), std::move(displacement), std::move(tetrahedra), std::move(lattice_vertex)};
          },
          nb::arg("rest"), nb::arg("displacement"), nb::arg("tetrahedra"), nb::arg("lattice_vertex").none());
  nb::class_<VertexField>(core, "HostField")
      .def(nb::new_(&field_of), nb::arg("lattice").none(), nb::arg("displacement").none(), nb::arg("mesh").none(),
           nb::arg("replaced").none());
  core.def("read_forward", &read_forward, nb::arg("texts"), nb::arg("volume"), nb::arg("cell_size").none(),
           nb::arg("nifti_frame"), nb::arg("threads"), nb::arg("options"));
  core.def("read_pull", &read_pull, nb::arg("texts"), nb::arg("volume"), nb::arg("nifti_frame"), nb::arg("threads"),
           nb::arg("options"));
  core.def("read_file", &read_file, nb::arg("text"), nb::arg("nifti_frame"));
  core.def("read_pull_file", &read_pull_file, nb::arg("text"), nb::arg("nifti_frame"));
  core.def("write_forward", &write_forward, nb::arg("path"), nb::arg("field"), nb::arg("overwrite"),
           nb::arg("options"));
  core.def("write_pull", &write_pull, nb::arg("path"), nb::arg("grid"), nb::arg("displacement"), nb::arg("overwrite"),
           nb::arg("options"));
  core.def("compose", &compose_all, nb::arg("fields"), nb::arg("threads"), nb::arg("options"));
  core.def("move_points", &move, nb::arg("output"), nb::arg("field"), nb::arg("points"), nb::arg("outside"),
           nb::arg("threads"), nb::arg("options"));
  core.def("continued", &continued, nb::arg("grid"), nb::arg("displacement"), nb::arg("like"));
}

}  // namespace tetwarp::python
