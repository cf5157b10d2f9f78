// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Files of VTK and of meshes hold vectors by name and may not say their frame and units; these
// functions read the options that give them.
#include <optional>
#include <set>
#include <string>

#include "io/field_file.h"

namespace tetwarp {

/// Those of the names that a displacement usually has: displacement, Displacement, U, u, DISP, DEPL.
std::set<std::string> usual_displacements(const std::set<std::string>& names);

/// Finds the frame or the units of a file: what the file states, else the option, else what is assumed.
/// @param by_option  what the option gives; empty: it is not given
/// @param value  what is assumed; set to what was found
/// @throws InputError where file and option disagree
FieldBasis take_stated(const std::optional<std::string>& stated, const std::string& by_option, const std::string& file,
                       std::string& value);

/// The frame that the option `frame=lps` or `frame=ras` means: LPS, RAS, or empty where it was not given.
std::string frame_option(const FieldSource& source);

/// Factors that turn a vector of a frame (LPS or RAS) and units (mm or m) into LPS mm.
glm::dvec3 to_lps_mm(const std::string& frame, const std::string& units);

}  // namespace tetwarp
