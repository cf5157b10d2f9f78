// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <variant>

#include "apps/deform/deform_worker.h"
#include "backend/factories.h"
#include "deform/vertex_field.h"

namespace tetwarp::apps {

/// A field of either direction, in memory.
using AnyField = std::variant<VertexField, PullField>;

inline bool is_pull(const AnyField& field) { return std::holds_alternative<PullField>(field); }

std::uint64_t size_bytes(const AnyField& field);

/// SHA-256 of what decides a field, its direction, place and numbers (Sha256::add_blocks), hexadecimal: the same for a
/// formula or a simulation and the file it was written to. A lattice with replaced cells counts as the mesh that it is
/// made into (`mesh_of`).
std::string hash_field(const VertexField& field, int threads);
std::string hash_field(const PullField& field, int threads);
std::string hash_field(const AnyField& field, int threads);

/// "lattice" and its geometry, or "mesh" and its size; both where a mesh takes the place of "replaced_cells", or was
/// made of a lattice.
nlohmann::json place_json(const VertexField& field);
nlohmann::json place_json(const AnyField& field);

/// A field of which only a part of each displacement is left. @param amount  0: nothing moves, 1: all of it
AnyField scaled(AnyField field, double amount);

/// A pull field in which nothing moves: it takes a volume from its own grid onto `output`.
PullField zero_pull_field(const Geometry& output);

/// Makes a resampler of fields of the direction of `field`. @throws what AnyResampler's constructor throws
AnyResampler make_resampler_for(const AnyField& field, const Geometry& output, const Worker& worker,
                                const Limits& limits);
/// Gives the resampler a field of its direction, which must outlive its use.
/// @param options  for a forward field
/// @throws what ForwardResampler::set_field and PullResampler::set_field throw
void set_field(const AnyResampler& resampler, const AnyField& field, Outside outside, const FieldOptions& options,
               const Control& control);

}  // namespace tetwarp::apps
