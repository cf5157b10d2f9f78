// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <ostream>

#include "deform/text/enum_names.h"

namespace tetwarp {

/// Writes the word that `name_of` gives, for `Print` of a filter.
inline std::ostream& operator<<(std::ostream& stream, Interpolation interpolation) {
  return stream << name_of(interpolation);
}
/// Writes the word that `name_of` gives, for `Print` of a filter.
inline std::ostream& operator<<(std::ostream& stream, Outside outside) { return stream << name_of(outside); }

}  // namespace tetwarp
