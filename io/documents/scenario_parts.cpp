// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/documents/scenario_parts.h"

#include <array>
#include <cmath>

namespace tetwarp {

namespace {

using namespace simulate;

constexpr NumberRange kLengthMm{0, 1e5, true}, kLengthBody{0, 100, true}, kHu{-1e5, 1e5};
constexpr std::size_t kMostParts = 1000, kMostPoints = 10000, kMostLabels = 10000;
constexpr std::int64_t kLargestLabel = std::int64_t{1} << 53;

/// Refuses an object that has other keys than `keys`.
void only(const JsonEntry& entry, std::initializer_list<const char*> keys) { entry.only({keys.begin(), keys.size()}); }

void require_true(const JsonEntry& entry) {
  if (!entry.truth()) entry.refuse("is false; leave it out, or say \"not\"");
}

std::vector<Zone> read_regions(const JsonEntry& entry) {
  std::vector<Zone> regions;
  for (const JsonEntry& item : entry.items(1, kMostParts)) regions.push_back(read_zone(item));
  return regions;
}

Zone read_sphere(const JsonEntry& entry) {
  only(entry, {"at", "radius_mm", "radius_body"});
  return {Sphere{read_point(entry.at("at")), read_length(entry, "radius_mm", "radius_body")}};
}

Zone read_box(const JsonEntry& entry) {
  only(entry, {"from", "to"});
  return {AlignedBox{read_point(entry.at("from")), read_point(entry.at("to"))}};
}

Zone read_half_space(const JsonEntry& entry) {
  only(entry, {"at", "normal"});
  return {HalfSpace{read_point(entry.at("at")), entry.at("normal").direction()}};
}

Zone read_border(const JsonEntry& entry) {
  require_true(entry);
  return {Border{}};
}

Zone read_body(const JsonEntry& entry) {
  require_true(entry);
  return {Body{}};
}

struct RegionReader {
  const char* key;
  Zone (*read)(const JsonEntry&);
};
constexpr RegionReader kRegions[] = {
    {"sphere", read_sphere},
    {"box", read_box},
    {"half_space", read_half_space},
    {"hu", [](const JsonEntry& entry) { return Zone{read_hu(entry)}; }},
    {"label", [](const JsonEntry& entry) { return Zone{Labels{read_labels(entry)}}; }},
    {"border", read_border},
    {"body", read_body},
    {"all_of", [](const JsonEntry& entry) { return Zone{AllOf{read_regions(entry)}}; }},
    {"any_of", [](const JsonEntry& entry) { return Zone{AnyOf{read_regions(entry)}}; }},
    {"not", [](const JsonEntry& entry) { return Zone{Not{{read_zone(entry)}}}; }},
};

SweptCutPlan read_swept(const JsonEntry& entry) {
  only(entry, {"path", "along", "depth_mm", "depth_body", "closed"});
  SweptCutPlan plan;
  const bool is_closed = entry.has("closed") && entry.at("closed").truth();
  for (const JsonEntry& place : entry.at("path").items(is_closed ? 3 : 2, kMostPoints))
    plan.path.push_back(read_point(place));
  plan.along = entry.at("along").direction();
  plan.depth = read_length(entry, "depth_mm", "depth_body");
  plan.is_closed = is_closed;
  return plan;
}

}  // namespace

ScenarioPoint read_point(const JsonEntry& entry) {
  constexpr std::array<const char*, 2> kKeys = {"mm", "body"};
  entry.only(kKeys);
  if (entry.one_of(kKeys) == 0) return {entry.at("mm").vector(kCoordinateMm), Unit::mm};
  return {entry.at("body").vector(kBodyParts), Unit::body};
}

Length read_length(const JsonEntry& entry, const char* key_mm, const char* key_body) {
  const std::array<const char*, 2> keys = {key_mm, key_body};
  if (entry.one_of(keys) == 0) return {entry.at(key_mm).number(kLengthMm), Unit::mm};
  return {entry.at(key_body).number(kLengthBody), Unit::body};
}

Zone read_zone(const JsonEntry& entry) {
  std::vector<const char*> keys;
  for (const RegionReader& reader : kRegions) keys.push_back(reader.key);
  entry.only(keys);
  const RegionReader& reader = kRegions[entry.one_of(keys)];
  return reader.read(entry.at(reader.key));
}

HuRange read_hu(const JsonEntry& entry) {
  const std::vector<JsonEntry> ends = entry.items(2, 2);
  HuRange range;
  if (!ends[0].is(JsonTree::Kind::null)) range.low = ends[0].number(kHu);
  if (!ends[1].is(JsonTree::Kind::null)) range.high = ends[1].number(kHu);
  if (!(range.low < range.high)) entry.refuse("is empty; the lower HU first and a higher one are expected");
  return range;
}

std::vector<std::int64_t> read_labels(const JsonEntry& entry) {
  if (!entry.is(JsonTree::Kind::list)) return {entry.whole_number(-kLargestLabel, kLargestLabel)};
  std::vector<std::int64_t> labels;
  for (const JsonEntry& item : entry.items(1, kMostLabels))
    labels.push_back(item.whole_number(-kLargestLabel, kLargestLabel));
  return labels;
}

CutPlan read_cut(const JsonEntry& entry) {
  constexpr std::array<const char*, 3> kShapes = {"plane", "disc", "swept"};
  only(entry, {"name", kShapes[0], kShapes[1], kShapes[2]});
  CutPlan cut{entry.at("name").text(), PlaneCutPlan{}};
  const std::size_t shape = entry.one_of(kShapes);
  const JsonEntry inner = entry.at(kShapes[shape]);
  if (shape == 0) {
    only(inner, {"at", "normal"});
    cut.shape = PlaneCutPlan{read_point(inner.at("at")), inner.at("normal").direction()};
  } else if (shape == 1) {
    only(inner, {"at", "normal", "radius_mm", "radius_body"});
    cut.shape = DiscCutPlan{read_point(inner.at("at")), inner.at("normal").direction(),
                            read_length(inner, "radius_mm", "radius_body")};
  } else {
    cut.shape = read_swept(inner);
  }
  return cut;
}

}  // namespace tetwarp
