// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// What a solver does with a node.
enum class Role : std::uint8_t {
  kept,    ///< no springs tie it to a placed node: nothing says where it should go
  free,    ///< sought
  placed,  ///< given
};

/// Finds the nodes that springs tie to placed ones. One hold a node.
std::vector<Role> roles(const Model& model, std::span<const Hold> hold);

/// @throws InputError for arrays of the wrong size, a goal or force that is not finite or too large (1e6 mm, 1e9 N), or
/// forces where no node is placed
void require_loads(const Model& model, const Loads& loads);

/// @throws InputError unless there is one finite displacement a node, of 1e6 mm at most
void require_displacement(const Model& model, std::span<const glm::vec3> displacement);

/// @throws InputError for a model whose arrays do not fit each other
void require_springs(const Model& model);

}  // namespace tetwarp::simulate
