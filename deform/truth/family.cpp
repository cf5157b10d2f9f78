// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/family.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "deform/errors.h"
#include "deform/field_quality.h"
#include "deform/fields/parameter_text.h"
#include "deform/text/text_number.h"
#include "deform/truth/motions.h"
#include "deform/truth/slip_tube.h"

namespace tetwarp::truth {

namespace {

constexpr double kMostSeed = 9007199254740992;  // 2^53: whole numbers up to here are exact

const std::vector<Family>& all_families() {
  static const std::vector<Family> kAll{
      {"elastic",
       "a smooth random field of cubic B-splines that keeps the faces of the grid",
       {},
       {{"amplitude", 10, 0, 200, "largest component, mm"},
        {"spacing", 60, 1, 1000, "distance of control points, mm"},
        {"seed", 1, 0, kMostSeed, "decides the random numbers", true}},
       &elastic_motion},
      {"shift",
       "all is moved alike",
       {},
       {{"x", 4.3, -500, 500, "to the left, mm"},
        {"y", -3.1, -500, 500, "to the back, mm"},
        {"z", 5.7, -500, 500, "to the head, mm"}},
       &shift_motion},
      {"rotation",
       "all is turned about the middle of the volume",
       {},
       {{"angle", 6, -90, 90, "degrees"}, {"axis", 2, 0, 2, "0, 1, 2: about L, P, S", true}},
       &rotation_motion},
      {"breathing",
       "lungs and diaphragm go down and the belly comes forward, while bones and the table stay",
       {"lung", "bone"},
       {{"amplitude", 15, 0, 100, "of the diaphragm, mm"}, {"rise", 0.3, 0, 2, "of the belly, as a share of that"}},
       &breathing_motion},
      {"slip",
       "what lies inside the chest wall slides along it, towards the feet",
       {"lung", "bone"},
       {{"amplitude", 15, 0, 100, "mm"}},
       &slip_motion,
       &slip_bands},
      {"flexion",
       "the spine bends forward, and each bone moves rigidly",
       {"bone"},
       {{"angle", 12, -60, 60, "between the lowest and the highest bone, degrees"}},
       &flexion_motion},
      {"filling",
       "an organ grows about its middle, and tissue around it makes room and keeps its volume",
       {"organ"},
       {{"ratio", 1.5, 1, 8, "volume after to before"}},
       &filling_motion},
      {"shrinkage",
       "a lump shrinks about its middle, and tissue around it follows",
       {"lump"},
       {{"ratio", 0.5, 0.1, 1, "volume after to before"}},
       &shrinkage_motion},
  };
  return kAll;
}

std::string joined_names() {
  std::string names;
  for (const Family& family : all_families()) names += (names.empty() ? "" : ", ") + std::string(family.name);
  return names;
}

/// A bound as messages show it.
std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

double number_of(std::string_view text, std::string_view of, const Parameter& parameter) {
  const auto value = number_from<double>(text);
  const bool fits = value && *value >= parameter.least && *value <= parameter.most &&
                    (!parameter.is_whole || *value == std::floor(*value));
  require(fits, "case " + std::string(of) + ": " + std::string(parameter.name) + " is \"" + std::string(text) +
                    "\"; expected a " + (parameter.is_whole ? "whole " : "") + "number from " +
                    short_text(parameter.least) + " to " + short_text(parameter.most) + ", " +
                    std::string(parameter.about));
  return *value;
}

std::string folder_name(std::string_view text) {
  std::string name(text);
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.';
    if (!plain) c = '-';
  }
  return name;
}

}  // namespace

std::span<const Family> families() { return all_families(); }

const Family& family_of(std::string_view name) {
  for (const Family& family : families())
    if (family.name == name) return family;
  throw InputError("there is no kind of deformation \"" + std::string(name) + "\"; expected one of " + joined_names());
}

CaseChoice parse_case(std::string_view text) {
  const ParameterText parsed = parse_parameters(text, "case " + std::string(text));
  CaseChoice choice{folder_name(text), &family_of(parsed.name), {}};
  const auto& known = choice.family->parameters;
  for (const auto& [name, value] : parsed.values) {
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&, wanted = name](const Parameter& one) { return one.name == wanted; });
    require(found != known.end(), "case " + std::string(text) + ": \"" + std::string(name) + "\" is no parameter of " +
                                      std::string(choice.family->name));
    choice.values.emplace(name, number_of(value, text, *found));
  }
  for (const Parameter& parameter : known) choice.values.emplace(parameter.name, parameter.usual);
  return choice;
}

std::vector<CaseChoice> usual_cases(const Roles& roles) {
  std::vector<CaseChoice> cases;
  for (const char* text : {"elastic:amplitude=2", "elastic:amplitude=5", "elastic:amplitude=8", "elastic:amplitude=12",
                           "elastic:amplitude=16"})
    cases.push_back(parse_case(text));
  for (const Family& family : families()) {
    if (family.name == "elastic") continue;
    const bool all = std::all_of(family.roles.begin(), family.roles.end(),
                                 [&](std::string_view role) { return roles.contains(std::string(role)); });
    if (all) cases.push_back(parse_case(family.name));
  }
  return cases;
}

VertexField make_field(const CaseChoice& choice, const Subject& subject, const Limits& limits, const Control& control) {
  for (const std::string_view role : choice.family->roles) {
    require(subject.has(std::string(role)),
            "the case " + choice.name + " needs to know which labels are " + std::string(role));
  }
  VertexField field = choice.family->make(subject, choice.values, limits, control);
  const FieldQuality quality = measure_quality(field, limits, control);
  require(quality.parts[0] == 0, "the case " + choice.name + " folds; make its numbers smaller");
  return field;
}

}  // namespace tetwarp::truth
