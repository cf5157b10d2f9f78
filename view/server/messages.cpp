// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/messages.h"

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "deform/errors.h"

namespace tetwarp::viewer {

namespace {

using nlohmann::json;
using namespace request;

constexpr double kFarthestMm = 1e6, kLargestMm = 1e4;
constexpr std::size_t kMostPlaces = 1000, kLongestName = 200, kMostTissues = 255;
constexpr int kDeepest = 4;  ///< levels of brackets in a message

constexpr std::pair<const char*, Pane> kPaneNames[] = {
    {"axial", Pane::axial}, {"coronal", Pane::coronal}, {"sagittal", Pane::sagittal}, {"volume", Pane::volume}};
constexpr std::pair<const char*, Compared> kComparedNames[] = {{"after", Compared::after},
                                                               {"before", Compared::before},
                                                               {"difference", Compared::difference},
                                                               {"swipe", Compared::swipe}};
constexpr std::pair<const char*, Layer> kLayerNames[] = {{"lattice", Layer::lattice}, {"jacobian", Layer::jacobian},
                                                         {"folds", Layer::folds},     {"coverage", Layer::coverage},
                                                         {"labels", Layer::labels},   {"contours", Layer::contours}};
constexpr std::pair<const char*, simulate::Method> kMethodNames[] = {{"chainmail", simulate::Method::chainmail},
                                                                     {"mass-spring", simulate::Method::mass_spring}};

template <class Names, class Value>
const char* name_in(const Names& names, Value value) {
  for (const auto& [name, one] : names)
    if (one == value) return name;
  return "";
}

/// The keys of a message. Each must be asked for, once.
class Keys {
 public:
  explicit Keys(const json& object) : object_(object) {}

  bool has(const char* key) const { return object_.contains(key); }
  const json& at(const char* key) {
    const auto found = object_.find(key);
    require(found != object_.end(), std::string("\"") + key + "\" is missing");
    known_.insert(key);
    return *found;
  }
  double number(const char* key, double least, double most) { return number_of(at(key), key, least, most); }
  bool flag(const char* key) {
    const json& value = at(key);
    require(value.is_boolean(), std::string("\"") + key + "\" is neither true nor false");
    return value.get<bool>();
  }
  std::string text(const char* key, std::size_t longest = kLongestName) {
    const json& value = at(key);
    require(value.is_string() && value.get_ref<const std::string&>().size() <= longest,
            std::string("\"") + key + "\" is no text, or a long one");
    return value.get<std::string>();
  }
  template <class Names>
  auto choice(const char* key, const Names& names) {
    const std::string word = text(key);
    for (const auto& [name, value] : names)
      if (word == name) return value;
    throw InputError(std::string("\"") + key + "\" is none of its words");
  }
  glm::dvec3 vector(const char* key, double most) {
    const json& value = at(key);
    return {numbers_of<3>(value, key, most)};
  }
  Pointed pointed() {
    if (has("pixel")) return pixel_of(at("pixel"), "pixel");
    return vector("at", kFarthestMm);
  }
  std::vector<Pointed> path() {
    const char* const key = has("pixels") ? "pixels" : "path";
    const json& value = at(key);
    require(value.is_array() && value.size() <= kMostPlaces, std::string("\"") + key + "\" is no list, or a long one");
    std::vector<Pointed> places;
    for (const json& one : value)
      places.push_back(has("pixels") ? Pointed(pixel_of(one, key)) : Pointed(numbers_of<3>(one, key, kFarthestMm)));
    return places;
  }
  /// The objects of a list, each with its own keys.
  template <class Read>
  void each(const char* key, std::size_t most, Read&& read) {
    const json& value = at(key);
    require(value.is_array() && value.size() <= most, std::string("\"") + key + "\" is no list, or a long one");
    for (const json& one : value) {
      require(one.is_object(), std::string("\"") + key + "\" is no list of objects");
      Keys keys(one);
      read(keys);
      keys.finish();
    }
  }
  /// @throws InputError for a key that nobody asked for
  void finish() const {
    for (const auto& [key, value] : object_.items())
      require(known_.count(key) > 0, "a key of the message is not known for what is to be done");
  }

 private:
  static double number_of(const json& value, const char* key, double least, double most) {
    require(value.is_number(), std::string("\"") + key + "\" is no number");
    const double number = value.get<double>();
    require(number >= least && number <= most, std::string("\"") + key + "\" is out of its range");
    return number;
  }
  template <int N>
  static glm::vec<N, double> numbers_of(const json& value, const char* key, double most) {
    require(value.is_array() && value.size() == N,
            std::string("\"") + key + "\" is no list of " + std::to_string(N) + " numbers");
    glm::vec<N, double> numbers;
    for (int n = 0; n < N; ++n) numbers[n] = number_of(value[static_cast<std::size_t>(n)], key, -most, most);
    return numbers;
  }
  static glm::dvec2 pixel_of(const json& value, const char* key) {
    const glm::dvec2 pixel = numbers_of<2>(value, key, 1);
    require(pixel.x >= 0 && pixel.y >= 0, std::string("\"") + key + "\" is out of its range");
    return pixel;
  }

  const json& object_;
  std::set<std::string> known_;
};

Hello hello(Keys& keys) {
  Hello hello{keys.text("token"), false};
  if (keys.has("take")) hello.takes = keys.flag("take");
  return hello;
}

/// Properties of tissues, within what a scenario may say (docs/scenario.schema.json).
std::vector<simulate::Tissue> tissues(Keys& keys) {
  std::vector<simulate::Tissue> tissues;
  keys.each("tissues", kMostTissues, [&](Keys& of_one) {
    tissues.push_back({.name = of_one.text("name"),
                       .youngs_modulus_kpa = of_one.number("stiffness", 1e-6, 1e9),
                       .compression = of_one.number("compression", 0, 1),
                       .stretch = of_one.number("stretch", 0, 100),
                       .shear = of_one.number("shear", 0, 100)});
  });
  return tissues;
}

constexpr double kMostPixels = 8192;
using Wish = decltype(Request::what);

/// What each word of "do" asks for.
const std::pair<const char*, Wish (*)(Keys&)> kWishes[] = {
    {"size",
     [](Keys& keys) -> Wish {
       return Size{keys.choice("pane", kPaneNames), static_cast<int>(keys.number("width", 0, kMostPixels)),
                   static_cast<int>(keys.number("height", 0, kMostPixels))};
     }},
    {"look", [](Keys& keys) -> Wish { return Look{keys.vector("at", kFarthestMm)}; }},
    {"turn",
     [](Keys& keys) -> Wish {
       Turn turn{keys.number("angle", -1e6, 1e6), keys.number("elevation", -90, 90), keys.number("zoom", 0.01, 1000),
                 std::nullopt};
       if (keys.has("target")) turn.target_mm = keys.vector("target", kFarthestMm);
       return turn;
     }},
    {"levels",
     [](Keys& keys) -> Wish {
       return Levels{keys.number("width", 1e-9, 1e9), keys.number("level", -1e9, 1e9)};
     }},
    {"style", [](Keys& keys) -> Wish { return Style{keys.text("name")}; }},
    {"compare",
     [](Keys& keys) -> Wish {
       return Compare{keys.choice("show", kComparedNames), keys.has("share") ? keys.number("share", 0, 1) : 0.5};
     }},
    {"overlay",
     [](Keys& keys) -> Wish {
       if (keys.at("kind").is_null()) return LayOver{};
       return LayOver{keys.choice("kind", kLayerNames)};
     }},
    {"probe", [](Keys& keys) -> Wish { return Probe{keys.vector("at", kFarthestMm)}; }},
    {"shown",
     [](Keys& keys) -> Wish {
       return Shown{keys.choice("pane", kPaneNames),
                    static_cast<std::uint32_t>(keys.number("number", 0, 4294967295.0))};
     }},
    {"grip",
     [](Keys& keys) -> Wish {
       return Grip{keys.pointed(), keys.number("radius", 0.01, kLargestMm)};
     }},
    {"move", [](Keys& keys) -> Wish { return Move{keys.vector("by", kLargestMm)}; }},
    {"release", [](Keys&) -> Wish { return Release{}; }},
    {"pin",
     [](Keys& keys) -> Wish {
       return Pin{keys.pointed(), keys.number("radius", 0.01, kLargestMm)};
     }},
    {"unpin", [](Keys&) -> Wish { return Unpin{}; }},
    {"cut",
     [](Keys& keys) -> Wish {
       return request::Cut{keys.path(), keys.vector("along", 1), keys.number("depth", 0.01, kLargestMm),
                           keys.flag("centred"), keys.has("closed") && keys.flag("closed")};
     }},
    {"suture", [](Keys& keys) -> Wish { return Suture{keys.text("name")}; }},
    {"reopen", [](Keys& keys) -> Wish { return Reopen{keys.text("name")}; }},
    {"ball",
     [](Keys& keys) -> Wish {
       return Ball{keys.pointed(), keys.number("radius", 0.01, kLargestMm)};
     }},
    {"lift", [](Keys&) -> Wish { return LiftBall{}; }},
    {"play", [](Keys&) -> Wish { return Play{}; }},
    {"frame", [](Keys& keys) -> Wish { return Frame{static_cast<int>(keys.number("number", 0, 1e6))}; }},
    {"undo", [](Keys&) -> Wish { return Undo{}; }},
    {"redo", [](Keys&) -> Wish { return Redo{}; }},
    {"reset", [](Keys&) -> Wish { return Reset{}; }},
    {"use", [](Keys& keys) -> Wish { return Use{keys.choice("method", kMethodNames)}; }},
    {"tissues", [](Keys& keys) -> Wish { return request::Tissues{tissues(keys)}; }},
    {"save",
     [](Keys& keys) -> Wish {
       request::Save save{.name = keys.text("name"), .volume = keys.text("volume")};
       if (keys.has("field")) save.field = keys.flag("field");
       if (keys.has("pictures")) save.pictures = keys.flag("pictures");
       if (keys.has("film")) save.film = keys.text("film");
       if (keys.has("of")) save.film_of = keys.choice("of", kPaneNames);
       return save;
     }},
};

/// Refuses what is nested deeper than any message, so that no text can use up the stack.
void require_shallow(std::string_view text) {
  int depth = 0, deepest = 0;
  bool in_text = false;
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (in_text && text[n] == '\\') {
      ++n;
    } else if (text[n] == '"') {
      in_text = !in_text;
    } else if (!in_text && (text[n] == '[' || text[n] == '{')) {
      deepest = std::max(deepest, ++depth);
    } else if (!in_text && (text[n] == ']' || text[n] == '}')) {
      --depth;
    }
  }
  require(deepest <= kDeepest, "the message is nested too deep");
}

json numbers(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// How the slices of a plane lie in space: the first pixel of slice 0, and the steps to the next pixels and slice.
json about_pane(const Geometry& grid, AnatomicalPlane plane) {
  const Slice slice = middle_slice(grid, plane);
  const AffineMap point = point_from_index(grid);
  glm::dvec3 first(0);
  const auto step = [&](int axis, bool reversed) {
    if (reversed) first[axis] = static_cast<double>(grid.size[axis] - 1);
    return point.linear[axis] * (reversed ? -1.0 : 1.0);
  };
  const glm::dvec3 right = step(slice.right.grid_axis, slice.right.reversed),
                   down = step(slice.down.grid_axis, slice.down.reversed);
  const auto letter = [](char c) { return std::string(1, c); };
  return {{"width", grid.size[slice.right.grid_axis]},
          {"height", grid.size[slice.down.grid_axis]},
          {"slices", grid.size[slice.normal_axis]},
          {"first", numbers(point(first))},
          {"right", numbers(right)},
          {"down", numbers(down)},
          {"next", numbers(point.linear[slice.normal_axis])},
          {"letters",
           {letter(slice.right.begin), letter(slice.right.end), letter(slice.down.begin), letter(slice.down.end)}}};
}

std::string written(const json& message) { return message.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

std::variant<Hello, Request> read_message(std::string_view text) {
  require(text.size() <= kMostMessageBytes, "the message is too long");
  require_shallow(text);
  const json object = json::parse(text, nullptr, false);
  require(object.is_object(), "the message is no JSON object");
  Keys keys(object);
  const std::string word = keys.text("do");
  if (word == "hello") {
    const Hello said = hello(keys);
    keys.finish();
    return said;
  }
  for (const auto& [name, wish] : kWishes) {
    if (word != name) continue;
    Request request{wish(keys), keys.has("n") ? static_cast<std::uint32_t>(keys.number("n", 0, 4294967295.0)) : 0};
    keys.finish();
    return request;
  }
  throw InputError("\"do\" is none of its words");
}

std::string message_of(const About& about) {
  json panes;
  for (const auto& [name, pane] : kPaneNames)
    if (pane != Pane::volume) panes[name] = about_pane(about.grid, static_cast<AnatomicalPlane>(pane));
  return written({{"say", "about"},
                  {"title", about.title},
                  {"size", {about.grid.size.x, about.grid.size.y, about.grid.size.z}},
                  {"spacing", numbers(about.grid.spacing)},
                  {"middle", numbers(centre(about.grid))},
                  {"panes", panes},
                  {"backend", about.backend},
                  {"hounsfield", about.hounsfield},
                  {"styles", about.styles},
                  {"volumes", about.volume_suffixes},
                  {"films", about.film_suffixes},
                  {"folder", about.folder},
                  {"labels", about.labels},
                  {"reel", about.frames},
                  {"grows", about.grows},
                  {"pulls", about.pulls}});
}

std::string message_of(const State& state) {
  json cuts = json::array(), pins = json::array(), tissues = json::array();
  for (const glm::dvec4& pin : state.pins) pins.push_back({pin.x, pin.y, pin.z, pin.w});
  for (const simulate::Tissue& tissue : state.tissues)
    tissues.push_back({{"name", tissue.name},
                       {"stiffness", tissue.youngs_modulus_kpa},
                       {"compression", tissue.compression},
                       {"stretch", tissue.stretch},
                       {"shear", tissue.shear}});
  for (const auto& [name, is_open] : state.cuts) cuts.push_back({{"name", name}, {"open", is_open}});
  json message = {{"say", "state"},
                  {"request", state.request},
                  {"frames", state.frames},
                  {"moving", state.is_moving},
                  {"undo", state.can_undo},
                  {"redo", state.can_redo},
                  {"holds", state.holds},
                  {"pins", pins},
                  {"ball", nullptr},
                  {"cuts", cuts},
                  {"playable", state.can_play},
                  {"plays", state.plays},
                  {"frame", state.frame},
                  {"tissues", tissues},
                  {"method", name_in(kMethodNames, state.method)},
                  {"quality", nullptr},
                  {"fold", nullptr},
                  {"cursor", numbers(state.cursor_mm)},
                  {"width", state.look.window.width},
                  {"level", state.look.window.level},
                  {"show", name_in(kComparedNames, state.look.compared)},
                  {"share", state.look.swipe},
                  {"overlay", nullptr},
                  {"style", state.style}};
  for (const auto& [name, pane] : kPaneNames)
    message["pictures"][name] = state.pictures[static_cast<std::size_t>(pane)];
  if (state.ball) message["ball"] = {state.ball->x, state.ball->y, state.ball->z, state.ball->w};
  if (state.quality)
    message["quality"] = {{"coverage", state.quality->coverage},
                          {"inverted", state.quality->inverted},
                          {"degenerate", state.quality->degenerate},
                          {"jacobian", nullptr}};
  if (state.quality && state.quality->jacobian_min) message["quality"]["jacobian"] = *state.quality->jacobian_min;
  if (state.fold_at) message["fold"] = numbers(*state.fold_at);
  if (state.look.layer) message["overlay"] = name_in(kLayerNames, *state.look.layer);
  return written(message);
}

std::string message_of(const Answer& answer) {
  json message = {{"n", answer.number}};
  switch (answer.kind) {
    case Answer::Kind::held: message["say"] = "held"; break;
    case Answer::Kind::value: message["say"] = "value"; break;
    case Answer::Kind::nothing: message["say"] = "nothing"; break;
    case Answer::Kind::problem: message["say"] = "problem"; break;
  }
  if (answer.kind == Answer::Kind::problem) {
    message["text"] = answer.text;
  } else {
    message["at"] = numbers(answer.at_mm);
  }
  if (answer.kind == Answer::Kind::value) message["after"] = answer.after, message["before"] = answer.before;
  return written(message);
}

std::string message_of_saved(std::uint32_t number, const std::vector<std::string>& files, const std::string& command) {
  return written({{"say", "saved"}, {"n", number}, {"files", files}, {"command", command}});
}

std::string message_of_progress(std::uint32_t number) { return written({{"say", "progress"}, {"n", number}}); }

std::string message_of_secret(const std::string& secret) { return written({{"say", "secret"}, {"secret", secret}}); }

std::string message_of_refusal(const std::string& reason) { return written({{"say", "bye"}, {"text", reason}}); }

std::string message_of(const Picture& picture) {
  json about = {{"pane", name_in(kPaneNames, picture.pane)},
                {"number", picture.number},
                {"request", picture.request},
                {"exact", picture.is_exact},
                {"width", picture.width},
                {"height", picture.height},
                {"voxel", picture.voxel}};
  if (picture.plane)
    about["plane"] = {{"middle", numbers(picture.plane->middle)},
                      {"right", numbers(picture.plane->right)},
                      {"down", numbers(picture.plane->down)},
                      {"forward", numbers(picture.plane->forward)},
                      {"pixel", picture.plane->pixel_mm}};
  const std::string text = written(about);
  std::string message;
  message.reserve(4 + text.size() + picture.bytes.size());
  for (int n = 0; n < 4; ++n) message += static_cast<char>(text.size() >> (8 * n) & 255);
  message += text;
  message.append(reinterpret_cast<const char*>(picture.bytes.data()), picture.bytes.size());
  return message;
}

}  // namespace tetwarp::viewer
