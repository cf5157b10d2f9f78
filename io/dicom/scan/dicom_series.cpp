// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_series.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>

#include "io/shown_text.h"

namespace tetwarp {

std::string to_string(const LeftOutFile& left_out) {
  return shown(left_out.file, left_out.frame) + ": " + left_out.reason;
}

std::string plane_name(const glm::dvec3& normal) {
  const glm::dvec3 along = glm::abs(glm::normalize(normal));
  const int axis = along.z >= along.x && along.z >= along.y ? 2 : along.y >= along.x ? 1 : 0;
  const char* const names[] = {"sagittal", "coronal", "axial"};
  const double cosine_of_one_degree = std::cos(M_PI / 180);
  return along[axis] > cosine_of_one_degree ? names[axis] : std::string("oblique, nearly ") + names[axis];
}

const char* name_of(DicomEncoding encoding) {
  constexpr const char* kNames[] = {"explicit", "deflated", "rle", "jpeg-ls"};
  return kNames[static_cast<int>(encoding)];
}

}  // namespace tetwarp
