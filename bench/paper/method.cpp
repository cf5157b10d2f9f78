// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/method.h"

#include <algorithm>

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

constexpr int kTwins = 4;  ///< the first methods, and as far behind each its form with an inverse for every voxel

}  // namespace

const std::vector<std::string>& method_names() {
  static const std::vector<std::string> kNames{"inverse4x4-double",
                                               "inverse3x3-double",
                                               "inverse3x3-float",
                                               "paper",
                                               "inverse4x4-double-per-voxel",
                                               "inverse3x3-double-per-voxel",
                                               "inverse3x3-float-per-voxel",
                                               "paper-per-voxel",
                                               "gascon",
                                               "tetwarp"};
  return kNames;
}

std::string name_of(Method method) { return method_names()[static_cast<std::size_t>(method)]; }

std::string name_of(FieldSource source) { return source == FieldSource::kernel ? "kernel" : "memory"; }

Method parse_method(const std::string& name) {
  const auto& names = method_names();
  const auto found = std::find(names.begin(), names.end(), name);
  require(found != names.end(), "no method \"" + name + "\"");
  return static_cast<Method>(found - names.begin());
}

InverseIn inverse_of(Method method) {
  const int number = static_cast<int>(method);
  return number >= kTwins && number < 2 * kTwins ? InverseIn::every_voxel : InverseIn::loop_as_compiled;
}

Method per_voxel(Method method) {
  require(static_cast<int>(method) < kTwins, name_of(method) + " has no form with an inverse for every voxel");
  return static_cast<Method>(static_cast<int>(method) + kTwins);
}

}  // namespace tetwarp::bench
