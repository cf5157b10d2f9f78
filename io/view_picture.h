// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "deform/render/camera.h"
#include "io/png.h"

namespace tetwarp {

/// What stands in a rendered picture beside the volume.
struct ViewCaption {
  std::string title;                      ///< one line at the top; no patient data
  std::vector<std::string> details = {};  ///< further ones, fainter
};

/// Writes over a rendered picture what a reader needs to know: title, patient directions at its four sides (two letters
/// where a side lies between two), and a bar of a round length.
void annotate(Picture& picture, const ViewPlane& plane, const ViewCaption& caption);

/// The patient direction of a vector: "L", or "LP" where it lies between two. @param direction  LPS, unit length
std::string direction_letters(const glm::dvec3& direction);

}  // namespace tetwarp
