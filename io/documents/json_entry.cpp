// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/documents/json_entry.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "deform/errors.h"
#include "deform/simulate/zone.h"
#include "io/edit_distance.h"

namespace tetwarp {

namespace {

constexpr std::size_t kLongestText = 200;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string list_of(std::span<const char* const> words) {
  std::string list;
  for (std::size_t n = 0; n < words.size(); ++n) {
    if (n > 0) list += n + 1 == words.size() ? " or " : ", ";
    list += words[n];
  }
  return list;
}

const JsonTree* find(const JsonTree& object, const std::string& key) {
  if (object.kind != JsonTree::Kind::object) return nullptr;
  const auto found =
      std::find_if(object.items.begin(), object.items.end(), [&](const JsonTree& member) { return member.key == key; });
  return found == object.items.end() ? nullptr : &*found;
}

}  // namespace

std::string NumberRange::text() const {
  return (above ? "above " : "from ") + text_of(low) + (above ? ", to " : " to ") + text_of(high);
}

void JsonEntry::refuse(const std::string& what) const {
  throw InputError(*file_ + ":" + std::to_string(line()) + ": " + (path_.empty() ? whole_ : path_) + " " + what);
}

void JsonEntry::expect(JsonTree::Kind kind, const std::string& expected) const {
  if (!is(kind)) refuse(std::string("is ") + name_of(tree_->kind) + "; " + expected + " is expected");
}

double JsonEntry::number(const NumberRange& range) const {
  const std::string expected = "a number " + range.text();
  expect(JsonTree::Kind::number, expected);
  if (!range.contains(tree_->number)) refuse("is " + text_of(tree_->number) + "; " + expected + " is expected");
  return tree_->number;
}

std::int64_t JsonEntry::whole_number(std::int64_t low, std::int64_t high) const {
  const std::string expected = "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  expect(JsonTree::Kind::number, expected);
  const double value = tree_->number;
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high) && std::floor(value) == value))
    refuse("is " + text_of(value) + "; " + expected + " is expected");
  return static_cast<std::int64_t>(value);
}

bool JsonEntry::truth() const {
  expect(JsonTree::Kind::boolean, "true or false");
  return tree_->truth;
}

const std::string& JsonEntry::text() const {
  expect(JsonTree::Kind::text, "a text");
  if (tree_->text.empty()) refuse("is empty; a text is expected");
  const auto characters = static_cast<std::size_t>(
      // Characters of UTF-8: bytes that do not continue one.
      std::count_if(tree_->text.begin(), tree_->text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  if (characters > kLongestText)
    refuse("has " + std::to_string(characters) + " characters; a text of at most " + std::to_string(kLongestText) +
           " is expected");
  return tree_->text;
}

const std::string& JsonEntry::any_text() const {
  expect(JsonTree::Kind::text, "a text");
  return tree_->text;
}

glm::dvec3 JsonEntry::vector(const NumberRange& range) const {
  const std::string expected = "a list of three numbers";
  expect(JsonTree::Kind::list, expected);
  const std::vector<JsonEntry> numbers = items(3, 3);
  return {numbers[0].number(range), numbers[1].number(range), numbers[2].number(range)};
}

glm::dvec3 JsonEntry::direction() const {
  const glm::dvec3 result = vector({-1e6, 1e6});
  if (result == glm::dvec3(0)) refuse("has no length; a direction is expected");
  return simulate::scaled_direction(result);
}

std::vector<JsonEntry> JsonEntry::items(std::size_t fewest, std::size_t most) const {
  expect(JsonTree::Kind::list, "a list");
  if (tree_->items.size() < fewest || tree_->items.size() > most) {
    const std::string count =
        fewest == most ? std::to_string(fewest) : std::to_string(fewest) + " to " + std::to_string(most);
    refuse("has " + std::to_string(tree_->items.size()) + " parts; a list of " + count + " is expected");
  }
  std::vector<JsonEntry> result;
  for (std::size_t n = 0; n < tree_->items.size(); ++n)
    result.emplace_back(tree_->items[n], path_ + "[" + std::to_string(n) + "]", *file_, whole_);
  return result;
}

void JsonEntry::only(std::span<const char* const> known) const {
  expect(JsonTree::Kind::object, "an object");
  for (const JsonTree& member : tree_->items) {
    if (std::find(known.begin(), known.end(), member.key) != known.end()) continue;
    const auto nearest = std::min_element(known.begin(), known.end(), [&](const char* a, const char* b) {
      return edit_distance(printable(member.key), a) < edit_distance(printable(member.key), b);
    });
    const bool is_near =
        edit_distance(printable(member.key), *nearest) <= std::max<std::size_t>(1, member.key.size() / 3);
    throw InputError(*file_ + ":" + std::to_string(member.key_line) + ": " + (path_.empty() ? "" : path_ + ": ") +
                     "the key \"" + printable(member.key) + "\" is not known; " +
                     (is_near ? std::string("did you mean \"") + *nearest + "\"?" : "known are " + list_of(known)));
  }
}

bool JsonEntry::has(const char* key) const { return find(*tree_, key) != nullptr; }

JsonEntry JsonEntry::at(const char* key) const {
  expect(JsonTree::Kind::object, "an object");
  const JsonTree* member = find(*tree_, key);
  if (member == nullptr) refuse(std::string("has no \"") + key + "\"");
  return {*member, path_.empty() ? key : path_ + "." + key, *file_, whole_};
}

std::size_t JsonEntry::one_of(std::span<const char* const> keys) const {
  expect(JsonTree::Kind::object, "an object");
  std::size_t found = keys.size();
  for (std::size_t n = 0; n < keys.size(); ++n) {
    if (!has(keys[n])) continue;
    if (found < keys.size())
      refuse(std::string("has both ") + keys[found] + " and " + keys[n] + "; one of them is expected");
    found = n;
  }
  if (found == keys.size()) refuse("has none of " + list_of(keys) + "; one of them is expected");
  return found;
}

}  // namespace tetwarp
