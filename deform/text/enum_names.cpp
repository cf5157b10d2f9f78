// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/text/enum_names.h"

#include <algorithm>
#include <iterator>

namespace tetwarp {

namespace {

struct Named {
  const char* name;
  Interpolation interpolation;
};
constexpr Named kInterpolations[] = {{"nearest", Interpolation::nearest},
                                     {"linear", Interpolation::linear},
                                     {"cubic", Interpolation::cubic},
                                     {"vote", Interpolation::vote}};

}  // namespace

const char* name_of(Outside outside) {
  constexpr const char* kNames[] = {"refuse", "rest", "background"};
  return kNames[static_cast<int>(outside)];
}

const char* name_of(Interpolation interpolation) {
  return std::find_if(std::begin(kInterpolations), std::end(kInterpolations),
                      [&](const Named& named) { return named.interpolation == interpolation; })
      ->name;
}

std::optional<Interpolation> interpolation_named(std::string_view name) {
  for (const Named& named : kInterpolations) {
    if (named.name == name) return named.interpolation;
  }
  return {};
}

}  // namespace tetwarp
