// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads 3D Slicer's .mrk.json: markups-schema-v1.0.3.json of Slicer, Modules/Loadable/Markups/Resources/Schema.
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "deform/errors.h"
#include "io/documents/json_tree.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

using Json = nlohmann::ordered_json;

/// Parses a document, and refuses an object that has a key twice: of two positions or coordinate systems none is the
/// right one.
/// @throws InputError or what nlohmann throws
Json parse_with_different_keys(const std::string& bytes, const std::string& name) {
  std::vector<std::set<std::string>> keys;  // the keys so far of each object that is open
  return Json::parse(bytes, [&](int, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key) {
      const auto key = parsed.get<std::string>();
      require(keys.back().insert(key).second, "the key \"" + printable(key) + "\" twice in one object, " + name);
    }
    return true;
  });
}

/// Where a value stands, for messages: "/markups/0/controlPoints/2, FILE".
std::string place_of(const Json::json_pointer& at, const std::string& name) { return at.to_string() + ", " + name; }

/// The frame that a markup states; none where it states none.
std::optional<PointFrame> frame_of_markup(const Json& markup, const std::string& where) {
  const auto system = markup.find("coordinateSystem");
  if (system == markup.end()) return {};
  require(system->is_string() || system->is_number_integer(), "coordinateSystem is no text, " + where);
  return frame_of(system->is_string() ? system->get<std::string>() : system->dump(), where);
}

void require_mm(const Json& markup, const std::string& where) {
  const auto units = markup.find("coordinateUnits");
  if (units == markup.end()) return;
  // UCUM: a list of value, scheme, meaning
  const Json& unit = units->is_array() && !units->empty() ? units->front() : *units;
  require(unit == "mm", "coordinates in " + unit.dump() + ", " + where + "; expected mm");
}

glm::dvec3 position_of(const Json& control_point, const std::string& where) {
  const auto position = control_point.find("position");
  require(position != control_point.end() && position->is_array() && position->size() == 3,
          "no position of 3 numbers, " + where);
  glm::dvec3 point;
  for (int axis = 0; axis < 3; ++axis) {
    const Json& number = (*position)[static_cast<std::size_t>(axis)];
    require(number.is_number(), number.dump() + " where a number is expected, " + where);
    point[axis] = number.get<double>();
    require(std::isfinite(point[axis]), "a coordinate that is not finite, " + where);
  }
  return point;
}

class MarkupsDocument : public PointsDocument {
 public:
  MarkupsDocument(const std::string& bytes, const std::string& name) {
    try {
      document_ = parse_with_different_keys(bytes, name);
    } catch (const nlohmann::json::parse_error& error) {
      throw InputError("not a JSON document" + at_byte(error.byte, name) + "; is the file whole?");
    } catch (const nlohmann::json::exception&) {
      throw InputError("a number that is too large, " + name);
    }
    require(document_.is_object() && document_.contains("markups") && document_["markups"].is_array(),
            "no list of markups, " + name + "; expected a markups file of 3D Slicer");
    for (std::size_t n = 0; n < document_["markups"].size(); ++n)
      take(Json::json_pointer("/markups/" + std::to_string(n)), n == 0, name);
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus> status) const override {
    Json document = document_;
    for (std::size_t n = 0; n < moved.size(); ++n) {
      Json& control_point = document[positions_[n].at];
      const glm::dvec3 point = positions_[n].turned ? turned(moved[n]) : moved[n];
      if (moved[n] != points[n]) control_point["position"] = {point.x + 0.0, point.y + 0.0, point.z + 0.0};
      if (status[n] == PointStatus::outside)
        control_point["description"] = with_outside_text(control_point.value("description", ""));
    }
    return document.dump(4) + "\n";
  }

 private:
  struct Position {
    Json::json_pointer at;
    bool turned;  ///< whether its markup has the other frame than the first markup
  };

  void take(const Json::json_pointer& at, bool first, const std::string& name) {
    const std::string where = place_of(at, name);
    const Json& markup = document_[at];
    require(markup.is_object(), "no object, " + where);
    const auto own = frame_of_markup(markup, where);
    require_mm(markup, where);
    if (first) frame = own;
    require(own.has_value() == frame.has_value(), "some markups say their coordinateSystem and some do not, " + name);
    const auto type = markup.find("type");
    if (type != markup.end() && (*type == "ROI" || *type == "Plane"))
      notes.push_back(type->get<std::string>() + " of " + where + ": its control points are moved, nothing else of it");
    const auto list = markup.find("controlPoints");
    if (list == markup.end()) return;
    require(list->is_array(), "controlPoints is no list, " + where);
    for (std::size_t n = 0; n < list->size(); ++n) {
      const Json::json_pointer place = at / "controlPoints" / n;
      take_control_point((*list)[n], {place, own != frame}, place_of(place, name));
    }
  }

  void take_control_point(const Json& control_point, const Position& place, const std::string& where) {
    require(control_point.is_object(), "no object, " + where);
    const auto placed = control_point.find("positionStatus");
    // Such a point is not placed yet, or is missing in this volume.
    if (placed != control_point.end() && *placed != "defined") return;
    const auto description = control_point.find("description");
    require(description == control_point.end() || description->is_string(), "description is no text, " + where);
    const glm::dvec3 point = position_of(control_point, where);
    points.push_back(place.turned ? turned(point) : point);
    positions_.push_back(place);
  }

  Json document_;
  std::vector<Position> positions_;
};

}  // namespace

std::unique_ptr<PointsDocument> parse_markups(std::string bytes, const std::string& name) {
  return std::make_unique<MarkupsDocument>(bytes, name);
}

}  // namespace tetwarp
