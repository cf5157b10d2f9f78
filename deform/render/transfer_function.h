// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/render/projection.h"

namespace tetwarp {

/// What a value looks like; between two points linear.
struct TransferPoint {
  double value = 0;      ///< HU in CT
  glm::dvec3 colour{1};  ///< red, green, blue as a screen shows them, 0 to 1
  double opacity = 0;    ///< composite: 0 to 1, of a layer of 1 mm. sum: density, added up for each mm
};

/// From the values of a volume to a picture. Below the first point and above the last their own values hold.
struct TransferFunction {
  std::string name;
  Projection projection = Projection::composite;
  std::vector<TransferPoint> points;  ///< rising; at least two
  /// Of composite: light from the viewer's upper left on both sides of surfaces (Phong 1975, Blinn 1977).
  double ambient = 0.3, diffuse = 0.65, specular = 0.15;
  double gradient = 50;  ///< change of the value in a mm from which a place is lit as a surface
  /// Of sum: the integral that is white. Of maximum the colours of the points count.
  double white = 1;
};

/// ct-bone ct-skin ct-lung ct-vessel mip xray.
std::vector<std::string> transfer_function_names();
/// @throws InputError for another name
TransferFunction transfer_function(const std::string& name);

/// @throws InputError for fewer than two points, values that do not rise, or numbers out of their ranges
void require_valid(const TransferFunction& transfer);

}  // namespace tetwarp
