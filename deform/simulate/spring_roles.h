// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// What a solver of mass-spring does with a node.
enum class SpringRole : std::uint8_t {
  kept,    ///< stays where it is: no springs tie it to a placed node
  free,    ///< its displacement is sought
  placed,  ///< its displacement is given
};

/// Finds the nodes that springs tie to placed ones. @param constraint  one for each node
std::vector<SpringRole> roles(const Model& model, std::span<const Constraint> constraint);

/// Checks loads. @throws InputError for arrays of the wrong size, a goal or force that is not finite or too large (1e6
/// mm, 1e9 N), or forces where no node is placed
void require_loads(const Model& model, const Loads& loads);

/// Checks displacements. @throws InputError unless there is one for each node, finite and at most 1e6 mm
void require_displacement(const Model& model, std::span<const glm::vec3> displacement);

/// Checks a model. @throws InputError for arrays that do not fit each other
void require_springs(const Model& model);

}  // namespace tetwarp::simulate
