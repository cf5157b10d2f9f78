// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/results.h"
#include "bench/paper/backend.h"

namespace tetwarp::bench {

/// Runs what the options ask for on one backend: every field of every volume with every method, and the coarse cells
/// on one volume (300 slices where that is among them, else the first). A row each.
///
/// What only stands beside the paper's numbers, its fields as written and its methods with an inverse per voxel, takes
/// the field from the kernel, as the paper does. It runs on that one volume, and on the others where the paper's Table
/// 4 has them: Wave, values and places interpolated.
///
/// @throws InputError for a volume of one value and the like
Json run_all(const Options& options, Backend& backend);

}  // namespace tetwarp::bench
