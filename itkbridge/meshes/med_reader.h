// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to the program tetwarp-read, which limits memory and time: this reader is not safe without limits.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "itkbridge/isolated/read_record.h"

namespace tetwarp {

/// Reads a MED file in this process, which a damaged file may bring down. med_file.cpp takes the records apart.
/// @param part  0: the mesh and the list of its vectors, these records:
///   - name of the mesh; head: the three numbers of the version, how many records of cells follow; values: coordinates,
///     all x, then all y, then all z
///   - "mm", "m" or nothing: the stated unit; values: numbers of the nodes, where the file has them
///   - for each type of cells its name ("TE4"); head: number of cells; values: nodes, counted from 1, the first of all
///     cells, then the second of all, ...; none of polygons and polyhedra
///   - for each step of each field that is taken for vectors its name; head: step, iteration, number of components
///
///   n: of the field number n - 1 in that list, for each part of the nodes (a profile) two records:
///   - values: the nodes, counted from 1; none: all nodes
///   - values: the vectors of these nodes, in the unit of the coordinates: all x, then all y, then all z
/// @throws InputError
std::vector<ReadRecord> read_med_unconfined(const std::filesystem::path& path, std::uint64_t part);

}  // namespace tetwarp
