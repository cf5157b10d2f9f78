// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/method.h"

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

struct Name {
  Method method;
  const char* name;
};
constexpr Name kNames[] = {
    {Method::inverse4x4_double, "inverse4x4-double"},
    {Method::inverse3x3_double, "inverse3x3-double"},
    {Method::inverse3x3_float, "inverse3x3-float"},
    {Method::paper, "paper"},
    {Method::inverse4x4_double_per_voxel, "inverse4x4-double-per-voxel"},
    {Method::inverse3x3_double_per_voxel, "inverse3x3-double-per-voxel"},
    {Method::inverse3x3_float_per_voxel, "inverse3x3-float-per-voxel"},
    {Method::paper_per_voxel, "paper-per-voxel"},
    {Method::gascon, "gascon"},
    {Method::tetwarp, "tetwarp"},
};

}  // namespace

std::string name_of(Method method) { return kNames[static_cast<int>(method)].name; }

std::string name_of(FieldSource source) { return source == FieldSource::kernel ? "kernel" : "memory"; }

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Name& entry : kNames) names.emplace_back(entry.name);
  return names;
}

Method parse_method(const std::string& name) {
  std::string known;
  for (const Name& entry : kNames) {
    if (name == entry.name) return entry.method;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("no method \"" + name + "\"; choose from " + known);
}

InverseIn inverse_of(Method method) {
  switch (method) {
    case Method::inverse4x4_double_per_voxel:
    case Method::inverse3x3_double_per_voxel:
    case Method::inverse3x3_float_per_voxel:
    case Method::paper_per_voxel: return InverseIn::every_voxel;
    default: return InverseIn::loop_as_compiled;
  }
}

Method per_voxel(Method method) {
  switch (method) {
    case Method::inverse4x4_double: return Method::inverse4x4_double_per_voxel;
    case Method::inverse3x3_double: return Method::inverse3x3_double_per_voxel;
    case Method::inverse3x3_float: return Method::inverse3x3_float_per_voxel;
    case Method::paper: return Method::paper_per_voxel;
    default: throw InputError(name_of(method) + " has no form with an inverse for every voxel");
  }
}

}  // namespace tetwarp::bench
