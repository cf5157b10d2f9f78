// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/transfer_file.h"

#include <array>
#include <charconv>

#include "deform/errors.h"
#include "io/documents/json_entry.h"

namespace tetwarp {

namespace {

constexpr std::size_t kFewestPoints = 2, kMostPoints = 1000;
constexpr NumberRange kValue{-1e9, 1e9}, kOpacity{0, 1}, kDensity{0, 1e6}, kLight{0, 10}, kGradient{0, 1e9},
    kWhite{0, 1e12, true};

glm::dvec3 read_colour(const JsonEntry& entry) {
  const std::string& text = entry.text();
  const std::optional<glm::dvec3> colour = parse_colour(text);
  if (!colour) entry.refuse("is \"" + printable(text) + "\"; a colour is #rrggbb, two hexadecimal digits each");
  return *colour;
}

Projection read_projection(const JsonEntry& entry) {
  const std::string& text = entry.text();
  if (text == "maximum") return Projection::maximum;
  if (text == "sum") return Projection::sum;
  if (text != "composite") entry.refuse("is \"" + printable(text) + "\"; composite, maximum or sum is expected");
  return Projection::composite;
}

/// Reads a point of a transfer function. It has the keys that its projection looks at, and no others.
TransferPoint read_point(const JsonEntry& entry, Projection projection) {
  constexpr std::array<const char*, 3> kComposite = {"value", "colour", "opacity"};
  constexpr std::array<const char*, 2> kMaximum = {"value", "colour"}, kSum = {"value", "density"};
  TransferPoint point;
  switch (projection) {
    case Projection::composite:
      entry.only(kComposite);
      point.opacity = entry.at("opacity").number(kOpacity);
      break;
    case Projection::maximum: entry.only(kMaximum); break;
    case Projection::sum:
      entry.only(kSum);
      point.opacity = entry.at("density").number(kDensity);
      break;
  }
  point.value = entry.at("value").number(kValue);
  if (projection != Projection::sum) point.colour = read_colour(entry.at("colour"));
  return point;
}

void read_light(const JsonEntry& entry, TransferFunction& transfer) {
  constexpr std::array<const char*, 4> kKeys = {"ambient", "diffuse", "specular", "gradient"};
  entry.only(kKeys);
  const auto read = [&](const char* key, const NumberRange& range, double& value) {
    if (entry.has(key)) value = entry.at(key).number(range);
  };
  read("ambient", kLight, transfer.ambient);
  read("diffuse", kLight, transfer.diffuse);
  read("specular", kLight, transfer.specular);
  read("gradient", kGradient, transfer.gradient);
}

}  // namespace

std::optional<glm::dvec3> parse_colour(const std::string& text) {
  unsigned bits = 0;
  const char* const end = text.data() + text.size();
  if (text.size() != 7 || text[0] != '#' || std::from_chars(text.data() + 1, end, bits, 16).ptr != end)
    return std::nullopt;
  return glm::dvec3(bits >> 16 & 255u, bits >> 8 & 255u, bits & 255u) / 255.0;
}

TransferFunction read_transfer_file(const std::filesystem::path& path) {
  constexpr std::array<const char*, 5> kKeys = {"name", "projection", "points", "light", "white"};
  const std::string file = path.string();
  const JsonTree tree = read_json(path, "a transfer function");
  const JsonEntry entry(tree, "", file, "the transfer function");
  entry.only(kKeys);
  TransferFunction transfer;
  transfer.name = entry.has("name") ? entry.at("name").text() : path.stem().string();
  if (entry.has("projection")) transfer.projection = read_projection(entry.at("projection"));
  for (const JsonEntry& item : entry.at("points").items(kFewestPoints, kMostPoints)) {
    transfer.points.push_back(read_point(item, transfer.projection));
    if (transfer.points.size() > 1 && transfer.points.back().value <= transfer.points[transfer.points.size() - 2].value)
      item.at("value").refuse("is not above the one before; values have to rise");
  }
  if (entry.has("light")) {
    if (transfer.projection != Projection::composite) entry.at("light").refuse("goes with composite only");
    read_light(entry.at("light"), transfer);
  }
  if (entry.has("white") != (transfer.projection == Projection::sum))
    entry.refuse(entry.has("white") ? "has \"white\", which goes with sum only" : "has no \"white\", which sum needs");
  if (entry.has("white")) transfer.white = entry.at("white").number(kWhite);
  return transfer;
}

}  // namespace tetwarp
