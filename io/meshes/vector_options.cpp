// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/vector_options.h"

#include "deform/errors.h"

namespace tetwarp {

std::set<std::string> usual_displacements(const std::set<std::string>& names) {
  std::set<std::string> usual;
  for (const char* known : {"displacement", "Displacement", "U", "u", "DISP", "DEPL"}) {
    if (names.contains(known)) usual.insert(known);
  }
  return usual;
}

FieldBasis take_stated(const std::optional<std::string>& stated, const std::string& by_option, const std::string& file,
                       std::string& value) {
  if (stated) {
    require(by_option.empty() || by_option == *stated,
            "the file says " + *stated + ", the option " + by_option + ", " + file + "; leave the option out");
    value = *stated;
    return FieldBasis::stated;
  }
  if (by_option.empty()) return FieldBasis::assumed;
  value = by_option;
  return FieldBasis::by_option;
}

std::string frame_option(const FieldSource& source) {
  const std::string frame = source.option("frame");
  return frame.empty() ? "" : (frame == "ras" ? "RAS" : "LPS");
}

glm::dvec3 to_lps_mm(const std::string& frame, const std::string& units) {
  const double unit = units == "m" ? 1000 : 1;
  return frame == "RAS" ? glm::dvec3(-unit, -unit, unit) : glm::dvec3(unit);
}

}  // namespace tetwarp
