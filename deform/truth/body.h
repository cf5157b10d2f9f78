// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/patient.h"

namespace tetwarp::truth {

/// The voxels of the body, with the lungs and all else that it encloses: those of the cells of `Patient::body`, and of
/// the cells that those enclose within their slice of the lattice.
/// @param volume     grid of the CT that the patient was made from
/// @param patient    of `simulate::examine`
/// @param cell_size  voxels
/// @return 1 for the voxels of the body, else 0, i fastest
Volume<std::uint8_t> body_mask(const Geometry& volume, const simulate::Patient& patient, std::int64_t cell_size);

}  // namespace tetwarp::truth
