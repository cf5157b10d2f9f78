// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/text/enum_names.h"

namespace tetwarp::python {

/// The choice that a word names. @throws InputError for another word
inline Outside outside_of(const std::string& word) {
  for (const Outside one : {Outside::refuse, Outside::rest, Outside::background}) {
    if (word == name_of(one)) return one;
  }
  throw InputError("outside is \"" + word + "\"; expected \"refuse\", \"rest\" or \"background\"");
}

/// As `outside_of`.
inline Interpolation interpolation_of(const std::string& word) {
  const auto found = interpolation_named(word);
  require(found.has_value(),
          "interpolation is \"" + word + "\"; expected \"nearest\", \"linear\", \"cubic\" or \"vote\"");
  return *found;
}

}  // namespace tetwarp::python
