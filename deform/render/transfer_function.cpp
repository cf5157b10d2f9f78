// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/transfer_function.h"

#include <cmath>

#include "deform/errors.h"

namespace tetwarp {

namespace {

constexpr glm::dvec3 kBlack{0, 0, 0}, kWhite{1, 1, 1}, kIvory{0.96, 0.91, 0.80}, kChalk{1.0, 0.98, 0.94},
    kSkin{0.91, 0.72, 0.60}, kPaleSkin{0.98, 0.84, 0.74}, kBlood{0.78, 0.16, 0.12}, kBrightBlood{0.95, 0.45, 0.30},
    kAir{0.35, 0.60, 0.80}, kLung{0.85, 0.55, 0.50}, kMuscle{0.70, 0.35, 0.28};

/// HU: air -1000, lung -900 to -500, fat -100, muscle 50, blood with contrast agent 150 to 400, bone from 200.
TransferFunction bone() {
  return {.name = "ct-bone",
          .points = {{170, kIvory, 0}, {280, kIvory, 0.08}, {450, kIvory, 0.5}, {1200, kChalk, 0.95}},
          .specular = 0.25,
          .gradient = 60};
}

TransferFunction skin() {
  return {.name = "ct-skin",
          .points = {{-450, kSkin, 0}, {-250, kSkin, 0.6}, {100, kPaleSkin, 0.95}},
          .specular = 0.12,
          .gradient = 80};
}

TransferFunction lung() {
  return {.name = "ct-lung",
          .points = {{-930, kAir, 0},
                     {-880, kAir, 0.012},
                     {-800, kLung, 0.02},
                     {-620, kLung, 0.03},
                     {-500, kLung, 0},
                     {120, kIvory, 0},
                     {500, kIvory, 0.04}},
          .specular = 0.05,
          .gradient = 60};
}

TransferFunction vessel() {
  return {.name = "ct-vessel",
          .points = {{130, kMuscle, 0},
                     {200, kBlood, 0.06},
                     {300, kBrightBlood, 0.4},
                     {480, kIvory, 0.3},
                     {1200, kChalk, 0.8}},
          .specular = 0.25,
          .gradient = 50};
}

/// Window 1400, level 500: bone and vessels with contrast agent.
TransferFunction mip() {
  return {.name = "mip", .projection = Projection::maximum, .points = {{-200, kBlack, 0}, {1200, kWhite, 0}}};
}

/// Density: attenuation as a multiple of water's, (HU + 1000) / 1000; 400 mm of water are white. From -950 HU down
/// there is none, so that the noise of the air around the patient does not add up.
TransferFunction xray() {
  return {.name = "xray",
          .projection = Projection::sum,
          .points = {{-950, kWhite, 0}, {-900, kWhite, 0.1}, {3000, kWhite, 4}},
          .white = 400};
}

constexpr TransferFunction (*kFunctions[])() = {bone, skin, lung, vessel, mip, xray};

}  // namespace

std::vector<std::string> transfer_function_names() {
  std::vector<std::string> names;
  for (const auto make : kFunctions) names.push_back(make().name);
  return names;
}

TransferFunction transfer_function(const std::string& name) {
  std::string names;
  for (const auto make : kFunctions) {
    TransferFunction found = make();
    if (found.name == name) return found;
    names += (names.empty() ? "" : " ") + found.name;
  }
  throw InputError("no transfer function has the name " + name + "; there are " + names);
}

void require_valid(const TransferFunction& transfer) {
  const std::string what = "transfer function " + transfer.name + ": ";
  require(transfer.points.size() >= 2,
          what + "it has " + std::to_string(transfer.points.size()) + " points, expected two or more");
  const bool is_sum = transfer.projection == Projection::sum;
  for (std::size_t n = 0; n < transfer.points.size(); ++n) {
    const TransferPoint& point = transfer.points[n];
    const std::string which = what + "point " + std::to_string(n + 1) + ": ";
    require(std::isfinite(point.value), which + "its value is no number");
    require(n == 0 || point.value > transfer.points[n - 1].value, which + "values have to rise");
    require(point.opacity >= 0 && (is_sum ? std::isfinite(point.opacity) : point.opacity <= 1),
            which + (is_sum ? "its density has to be 0 or more" : "its opacity has to be from 0 to 1"));
    for (int channel = 0; channel < 3; ++channel)
      require(point.colour[channel] >= 0 && point.colour[channel] <= 1, which + "its colour has to be from 0 to 1");
  }
  for (const double share : {transfer.ambient, transfer.diffuse, transfer.specular})
    require(share >= 0 && share <= 10, what + "ambient, diffuse and specular have to be from 0 to 10");
  require(transfer.gradient >= 0 && std::isfinite(transfer.gradient), what + "gradient has to be 0 or more");
  require(transfer.white > 0 && std::isfinite(transfer.white), what + "white has to be above 0");
}

}  // namespace tetwarp
