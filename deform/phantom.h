// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/volume.h"

namespace tetwarp {

/// A plausible CT of a trunk that never was: skin, fat, muscle, lungs with vessels, heart, liver, spine, ribs, table
/// and noise, in HU from -1024 to about 1300.
/// The volume depends on the arguments alone, and has the same bits on every machine.
///
/// @param size     voxels along i, j, k, each at least 2
/// @param spacing  mm along i, j, k. The body scales with the field of view; the grid is axial, its directions are L,
///         P, S and its middle is the origin.
/// @param seed     decides the noise and small variations of the anatomy
Volume<std::int16_t> make_phantom(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed);

}  // namespace tetwarp
