// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <glm/mat3x3.hpp>

#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// Writes a row of `Maps::inverse_mm` with vector instructions (Highway): `mm_from_index` times the offsets, in double,
/// rounded to float; NaN where nothing maps.
void write_inverse_row(const glm::dmat3& mm_from_index, const Row& row, glm::vec3* inverse_mm);

}  // namespace tetwarp::cpu
