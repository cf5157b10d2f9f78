// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <glm/vec3.hpp>

namespace tetwarp {

/// What RAS coordinates are multiplied with to become LPS coordinates, and the other way round.
inline constexpr glm::dvec3 kLpsFromRas(-1, -1, 1);

}  // namespace tetwarp
