// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. What VTK's fields and all meshes have in common: files that hold vectors by name and do not say in
// which frame and units these are, so that options do.
#include <optional>
#include <set>
#include <string>

#include "io/field_file.h"

namespace tetwarp {

/// Of the names of vectors those that a displacement usually has: displacement, Displacement, U, u.
std::set<std::string> usual_displacements(const std::set<std::string>& names);

/// The frame or units of a file: as it says itself, else by the option, else as they are assumed to be.
/// @param by_option  empty: not given  @param value  what is assumed; set to what is known
/// @throws InputError where file and option disagree
FieldBasis take_stated(const std::optional<std::string>& stated, const std::string& by_option, const std::string& file,
                       std::string& value);

/// The frame that the option `frame=lps` or `frame=ras` means: LPS, RAS, or empty where it was not given.
std::string frame_option(const FieldSource& source);

/// What turns a vector of a frame (LPS or RAS) and units (mm or m) into LPS mm.
glm::dvec3 to_lps_mm(const std::string& frame, const std::string& units);

}  // namespace tetwarp
