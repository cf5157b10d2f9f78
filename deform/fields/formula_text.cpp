// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <string>
#include <vector>

#include "deform/fields/elastic.h"
#include "deform/fields/formula.h"
#include "deform/fields/parameter_text.h"
#include "deform/text/text_number.h"

namespace tetwarp {

namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295769;
constexpr std::string_view kVoxels = "vox";

/// A length as typed: mm, or voxels if it has the suffix `vox`.
struct TypedLength {
  double value;
  bool in_voxels;
};

/// The parameters of one formula. Each may be taken once, and none may be left over.
class Parameters {
 public:
  Parameters(std::string_view text, const Geometry& volume) : text_(text), volume_(volume) {
    for (const auto& [key, value] : parse_parameters(text, about()).values) values_.emplace(key, value);
  }

  [[noreturn]] void fail(const std::string& what) const { throw InputError(about() + ": " + what); }

  void require_all_used() const {
    if (!values_.empty()) fail("unknown parameter \"" + std::string(values_.begin()->first) + "\"");
  }

  double number(const std::string& key, std::optional<double> otherwise = {}) {
    const std::string_view text = take(key, otherwise.has_value());
    return text.empty() ? *otherwise : parse(key, text);
  }

  std::uint64_t whole_number(const std::string& key) {
    const std::string_view text = take(key, false);
    const auto value = number_from<std::uint64_t>(text);
    if (!value) fail(key + " is \"" + std::string(text) + "\", expected a whole number from 0 to 2^64 - 1");
    return *value;
  }

  /// A length in mm. One `vox` is the spacing of the grid axis nearest to patient axis `along`, or the smallest spacing
  /// if that is -1.
  double length(const std::string& key, int along) {
    const TypedLength length = parse_length(key, take(key, false));
    return length.in_voxels ? length.value * voxel_mm(along) : length.value;
  }

  double positive_length(const std::string& key, int along) {
    const double value = length(key, along);
    if (!(value > 0)) fail(key + " must be greater than 0");
    return value;
  }

  int axis(const std::string& key, int otherwise) {
    const std::string_view text = take(key, true);
    if (text.empty()) return otherwise;
    if (text == "x") return 0;
    if (text == "y") return 1;
    if (text == "z") return 2;
    fail(key + " is \"" + std::string(text) + "\", expected x, y or z");
  }

  glm::dvec3 position(const std::string& key, const glm::dvec3& otherwise) {
    const std::string_view text = take(key, true);
    if (text.empty()) return otherwise;
    const std::array<std::string_view, 3> parts = three(key, text);
    return {parse(key, parts[0]), parse(key, parts[1]), parse(key, parts[2])};
  }

  /// A shift DX/DY/DZ: mm along L, P, S; with `vox` after the last number, or after each, voxels along i, j, k.
  glm::dvec3 shift(const std::string& key) {
    const std::array<std::string_view, 3> parts = three(key, take(key, false));
    std::array<TypedLength, 3> lengths{};
    for (std::size_t axis = 0; axis < 3; ++axis) lengths[axis] = parse_length(key, parts[axis]);
    const glm::dvec3 by(lengths[0].value, lengths[1].value, lengths[2].value);
    const int marked = lengths[0].in_voxels + lengths[1].in_voxels + lengths[2].in_voxels;
    if (marked != 0 && marked != 3 && !(marked == 1 && lengths[2].in_voxels)) fail(key + " mixes mm and vox");
    return lengths[2].in_voxels ? point_from_index(volume_).linear * by : by;
  }

 private:
  std::string about() const { return "formula \"" + std::string(text_) + "\""; }

  std::string_view take(const std::string& key, bool optional) {
    const auto found = values_.find(key);
    if (found == values_.end()) {
      if (!optional) fail(key + " is missing");
      return {};
    }
    const std::string_view value = found->second;
    if (value.empty()) fail(key + " is empty");
    values_.erase(found);
    return value;
  }

  double parse(const std::string& key, std::string_view text) const {
    const auto value = number_from<double>(text);
    if (!value || !std::isfinite(*value)) fail(key + " is \"" + std::string(text) + "\", expected a number");
    return *value;
  }

  TypedLength parse_length(const std::string& key, std::string_view text) const {
    const bool in_voxels = text.ends_with(kVoxels);
    if (in_voxels) text.remove_suffix(kVoxels.size());
    return {parse(key, text), in_voxels};
  }

  std::array<std::string_view, 3> three(const std::string& key, std::string_view text) const {
    const std::vector<std::string_view> parts = split(text, '/');
    if (parts.size() != 3) fail(key + " is \"" + std::string(text) + "\", expected three numbers X/Y/Z");
    return {parts[0], parts[1], parts[2]};
  }

  double voxel_mm(int along) const {
    const glm::dvec3& spacing = volume_.spacing;
    if (along < 0) return std::min({spacing.x, spacing.y, spacing.z});
    int nearest = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (std::abs(volume_.direction[axis][along]) > std::abs(volume_.direction[nearest][along])) nearest = axis;
    }
    return spacing[nearest];
  }

  std::string_view text_;
  const Geometry& volume_;
  std::map<std::string_view, std::string_view> values_;
};

PointMap parse_identity(Parameters&, const Geometry&) {
  return [](const glm::dvec3&) { return glm::dvec3(0); };
}

PointMap parse_wave(Parameters& given, const Geometry& volume) {
  Wave wave{.amplitude = 0, .wavelength = 0, .centre = centre(volume)};
  wave.axis = given.axis("axis", 0);
  wave.along = given.axis("along", 2);
  wave.amplitude = given.length("amplitude", wave.axis);
  wave.wavelength = given.positive_length("wavelength", wave.along);
  wave.phase = given.number("phase", 0.0) * kRadiansPerDegree;
  return wave;
}

PointMap parse_twist(Parameters& given, const Geometry& volume) {
  const int axis = given.axis("axis", 2);
  return Twist{given.number("angle") * kRadiansPerDegree, half_length(volume, axis), axis, centre(volume)};
}

PointMap parse_bubble(Parameters& given, const Geometry& volume) {
  const double radius = given.positive_length("radius", -1);
  return Bubble{radius, given.number("strength"), given.position("center", centre(volume))};
}

PointMap parse_paper_bubble(Parameters& given, const Geometry& volume) {
  return PaperBubble{given.length("shift", -1), given.position("center", centre(volume))};
}

PointMap parse_translate(Parameters& given, const Geometry&) {
  return [by = given.shift("by")](const glm::dvec3&) { return by; };
}

PointMap parse_elastic(Parameters& given, const Geometry& volume) {
  const double spacing = given.positive_length("spacing", -1);
  constexpr double kMostControlPoints = 1e6;  // along an axis: more are a mistake, and many more would exceed 64 bits
  for (int axis = 0; axis < 3; ++axis) {
    if (half_length(volume, axis) / spacing > kMostControlPoints) given.fail("spacing is too small for the volume");
  }
  return Elastic{given.length("amplitude", -1), spacing, given.whole_number("seed"), centre(volume)};
}

struct Formula {
  std::string_view name;
  PointMap (*parse)(Parameters&, const Geometry&);
};
constexpr Formula kFormulas[] = {{"identity", parse_identity},
                                 {"wave", parse_wave},
                                 {"twist", parse_twist},
                                 {"bubble", parse_bubble},
                                 {"bubble-paper", parse_paper_bubble},
                                 {"elastic", parse_elastic},
                                 {"translate", parse_translate}};

const Formula* find_formula(std::string_view text) {
  const auto* found = std::find_if(std::begin(kFormulas), std::end(kFormulas),
                                   [&](const Formula& formula) { return formula.name == name_of(text); });
  return found == std::end(kFormulas) ? nullptr : found;
}

}  // namespace

std::vector<std::string> formula_names() {
  std::vector<std::string> names;
  for (const Formula& formula : kFormulas) names.emplace_back(formula.name);
  return names;
}

bool is_formula(std::string_view text) { return find_formula(text) != nullptr; }

PointMap parse_formula(std::string_view text, const Geometry& volume) {
  const Formula* formula = find_formula(text);
  if (!formula) {
    std::string names;
    for (const std::string& name : formula_names()) names += (names.empty() ? "" : ", ") + name;
    throw InputError("formula \"" + std::string(text) + "\" is unknown; choose one of " + names);
  }
  require_valid(volume, "volume");
  Parameters parameters(text, volume);
  PointMap map = formula->parse(parameters, volume);
  parameters.require_all_used();
  return map;
}

}  // namespace tetwarp
