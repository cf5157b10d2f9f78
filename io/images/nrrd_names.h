// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the names that NRRD gives to types, kinds of axes, spaces and encodings. Upper and lower case are
// one.
#include <cstdint>
#include <optional>
#include <string>

#include "io/images/value_reader.h"

namespace tetwarp {

/// @throws InputError naming the file, for 64-bit integers, blocks of bytes, and what is no type of NRRD
VoxelType nrrd_type(const std::string& name, const std::string& file);

/// How NRRD calls a type in files that are written.
const char* nrrd_type_name(VoxelType type);

/// What an axis is.
struct NrrdKind {
  bool is_place = true;    ///< its samples lie at places, or times: an axis of the grid
  std::int64_t size = 0;   ///< how many samples an axis of the kind must have; 0: any number
  std::string pixel = {};  ///< of an axis of components: what the voxels are, where that is neither number nor vector
};
/// Nothing for what is no kind of NRRD; "none" and "???" are places.
std::optional<NrrdKind> nrrd_kind(const std::string& name);

struct NrrdSpace {
  std::string name;    ///< of those of a patient's body: "lps", "ras", "las"; else as NRRD has it
  int dimensions = 0;  ///< 4: time is one
};
/// Nothing for what is no space of NRRD.
std::optional<NrrdSpace> nrrd_space(const std::string& name);

/// Nothing for what is no encoding of NRRD.
std::optional<Encoding> nrrd_encoding(const std::string& name);

}  // namespace tetwarp
