// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <ostream>

#include "deform/enum_names.h"

namespace tetwarp {

/// What `Print` of a filter shows.
inline std::ostream& operator<<(std::ostream& stream, Interpolation interpolation) {
  return stream << name_of(interpolation);
}
inline std::ostream& operator<<(std::ostream& stream, Outside outside) { return stream << name_of(outside); }

}  // namespace tetwarp
