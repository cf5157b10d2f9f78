// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/fields/any_field.h"

#include <nlohmann/json.hpp>

#include "apps/cli/output.h"
#include "deform/fields/lattice_mesh.h"
#include "io/hash.h"

namespace tetwarp::apps {

namespace {

void scale(std::vector<glm::vec3>& displacement, double amount) {
  for (glm::vec3& vector : displacement) vector *= static_cast<float>(amount);
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

/// Whether a field with a mesh is a lattice with replaced cells, or was made of a lattice.
bool is_of_lattice(const VertexField& field) { return !field.replaced.empty() || has_lattice_vertices(field); }

}  // namespace

std::uint64_t size_bytes(const AnyField& field) {
  const auto bytes_of = [](const auto& values) { return std::as_bytes(std::span(values)).size(); };
  if (const auto* pull = std::get_if<PullField>(&field)) return bytes_of(pull->displacement);
  const auto& forward = std::get<VertexField>(field);
  return bytes_of(forward.displacement) + bytes_of(forward.mesh.rest) + bytes_of(forward.mesh.displacement) +
         bytes_of(forward.mesh.tetrahedra) + bytes_of(forward.mesh.lattice_vertex) + bytes_of(forward.replaced);
}

std::string hash_field(const VertexField& field, int threads) {
  if (field.mesh.is_empty()) return hash_samples(field.lattice, field.displacement, "forward", threads);
  const std::optional<TetrahedralMesh> made = mesh_of_cut(view(field));
  const TetrahedralMesh& mesh = made ? *made : field.mesh;
  Sha256 hash;
  hash.add("tetwarp mesh");
  const std::uint64_t sizes[] = {mesh.rest.size(), mesh.tetrahedra.size()};
  hash.add(std::as_bytes(std::span(sizes)));
  hash.add(std::as_bytes(std::span(mesh.rest)));
  hash.add(std::as_bytes(std::span(mesh.displacement)));
  if (is_of_lattice(field)) {
    add_geometry(field.lattice, hash);
    hash.add(std::as_bytes(std::span(mesh.lattice_vertex)));
  }
  return hash.add_blocks(std::as_bytes(std::span(mesh.tetrahedra)), threads).hex();
}

std::string hash_field(const PullField& field, int threads) {
  return hash_samples(field.grid, field.displacement, "pull", threads);
}

std::string hash_field(const AnyField& field, int threads) {
  return std::visit([&](const auto& one) { return hash_field(one, threads); }, field);
}

nlohmann::json place_json(const VertexField& field) {
  if (field.mesh.is_empty()) return {{"lattice", to_json(field.lattice)}};
  nlohmann::json place = {
      {"mesh", {{"vertices", field.mesh.rest.size()}, {"tetrahedra", field.mesh.tetrahedra.size()}}}};
  if (is_of_lattice(field)) place["lattice"] = to_json(field.lattice);
  if (!field.replaced.empty()) place["replaced_cells"] = field.replaced.size();
  return place;
}

nlohmann::json place_json(const AnyField& field) {
  if (const auto* pull = std::get_if<PullField>(&field)) return {{"lattice", to_json(pull->grid)}};
  return place_json(std::get<VertexField>(field));
}

AnyField scaled(AnyField field, double amount) {
  if (auto* pull = std::get_if<PullField>(&field)) {
    scale(pull->displacement, amount);
    return field;
  }
  auto& forward = std::get<VertexField>(field);
  scale(forward.displacement, amount);
  scale(forward.mesh.displacement, amount);
  return field;
}

PullField zero_pull_field(const Geometry& output) {
  Geometry corners = output;
  corners.size = glm::i64vec3(2);
  corners.spacing = output.spacing * glm::dvec3(output.size - std::int64_t{1});
  return {corners, std::vector<glm::vec3>(8, glm::vec3(0))};
}

AnyResampler make_resampler_for(const AnyField& field, const Geometry& output, const Worker& worker,
                                const Limits& limits) {
  const Direction direction = is_pull(field) ? Direction::pull : Direction::forward;
  return {chosen(worker.backend), direction, output, worker.device, limits};
}

void set_field(const AnyResampler& resampler, const AnyField& field, Outside outside, const FieldOptions& options,
               const Control& control) {
  if (const auto* pull = std::get_if<PullField>(&field))
    return resampler.pull().set_field(view(*pull, outside), control);
  resampler.forward().set_field(view(std::get<VertexField>(field), outside), options, control);
}

}  // namespace tetwarp::apps
