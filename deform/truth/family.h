// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/truth/bands.h"
#include "deform/truth/subject.h"

namespace tetwarp::truth {

/// A number that a family takes.
struct Parameter {
  std::string_view name;   ///< as texts have it
  double usual;            ///< its value unless another is given
  double least,            ///< smallest value that it takes
      most;                ///< largest value that it takes
  std::string_view about;  ///< what it is, with its unit
  bool is_whole = false;   ///< whether only whole numbers are taken
};
/// Values of all parameters of a family, by name.
using Values = std::map<std::string, double, std::less<>>;

/// A kind of deformation.
struct Family {
  std::string_view name;                ///< as texts have it
  std::string_view about;               ///< one sentence
  std::vector<std::string_view> roles;  ///< labels that it needs
  std::vector<Parameter> parameters;    ///< numbers that it takes
  /// Makes the field. The same subject and values give the same bits on every machine.
  /// @throws InputError where the subject does not go with it; Cancelled
  VertexField (*make)(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
  /// If tissue slips along a surface: how far the voxels of a volume are from it. Else null.
  Bands (*bands)(const Subject& subject, const Geometry& volume) = nullptr;
};
/// All families.
std::span<const Family> families();
/// The family of a name. @throws InputError for another name, which lists them
const Family& family_of(std::string_view name);

/// A deformation of a kind, as a text says it: "elastic:amplitude=10,seed=3".
struct CaseChoice {
  std::string name;      ///< of its folder: the text, with "-" for what no file name should have
  const Family* family;  ///< its kind
  Values values;         ///< of all parameters
};
/// @throws InputError for an unknown family, an unknown parameter, one given twice, or a value out of range
CaseChoice parse_case(std::string_view text);
/// The cases that are made of a subject with these roles unless others are asked for: elastic ones of five strengths,
/// shift and rotation, and one of each family whose roles are all there.
std::vector<CaseChoice> usual_cases(const Roles& roles);

/// The field of a case.
/// @throws InputError for a role that the subject has not, or a field that folds; Cancelled
VertexField make_field(const CaseChoice& choice, const Subject& subject, const Limits& limits = {},
                       const Control& control = {});

}  // namespace tetwarp::truth
