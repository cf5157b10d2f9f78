// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/messages.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "deform/errors.h"

namespace tetwarp::viewer {
namespace {

using nlohmann::json;

Request read(const std::string& text) { return std::get<Request>(read_message(text)); }

template <class One>
One one(const std::string& text) {
  return std::get<One>(read(text).what);
}

std::string refusal(const std::string& text) {
  try {
    read_message(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ViewMessages, EveryWordIsReadAsWhatItAsksFor) {
  EXPECT_EQ(std::get<Hello>(read_message(R"({"do": "hello", "token": "abc", "take": true})")).token, "abc");
  EXPECT_TRUE(std::get<Hello>(read_message(R"({"do": "hello", "token": "abc", "take": true})")).takes);
  EXPECT_EQ(read(R"({"do": "undo", "n": 4294967295})").number, 4294967295u);
  const auto size = one<request::Size>(R"({"do": "size", "pane": "sagittal", "width": 300, "height": 200})");
  EXPECT_EQ(size.pane, request::Pane::sagittal);
  EXPECT_EQ(size.width, 300);
  EXPECT_EQ(size.height, 200);
  EXPECT_EQ(one<request::Look>(R"({"do": "look", "at": [1, -2.5, 3e2]})").at_mm, glm::dvec3(1, -2.5, 300));
  const auto turn =
      one<request::Turn>(R"({"do": "turn", "angle": 10, "elevation": -20, "zoom": 2, "target": [1, 2, 3]})");
  EXPECT_EQ(turn.elevation_deg, -20);
  EXPECT_EQ(turn.target_mm, glm::dvec3(1, 2, 3));
  EXPECT_EQ(one<request::Levels>(R"({"do": "levels", "width": 400, "level": 40})").width, 400);
  EXPECT_EQ(one<request::Style>(R"({"do": "style", "name": "mip"})").name, "mip");
  EXPECT_EQ(one<request::Compare>(R"({"do": "compare", "show": "swipe", "share": 0.25})").swipe, 0.25);
  EXPECT_EQ(one<request::LayOver>(R"({"do": "overlay", "kind": "jacobian"})").layer, Layer::jacobian);
  EXPECT_EQ(one<request::LayOver>(R"({"do": "overlay", "kind": "contours"})").layer, Layer::contours);
  EXPECT_FALSE(one<request::LayOver>(R"({"do": "overlay", "kind": null})").layer.has_value());
  EXPECT_EQ(one<request::Probe>(R"({"do": "probe", "at": [0, 0, 9]})").at_mm.z, 9);
  EXPECT_EQ(one<request::Shown>(R"({"do": "shown", "pane": "volume", "number": 7})").number, 7u);
  EXPECT_EQ(std::get<glm::dvec3>(one<request::Grip>(R"({"do": "grip", "at": [1, 2, 3], "radius": 5})").at).y, 2);
  EXPECT_EQ(std::get<glm::dvec2>(one<request::Grip>(R"({"do": "grip", "pixel": [0.5, 1], "radius": 5})").at).y, 1);
  EXPECT_EQ(one<request::Move>(R"({"do": "move", "by": [1, 2, 3]})").by_mm.z, 3);
  one<request::Release>(R"({"do": "release"})");
  EXPECT_EQ(one<request::Pin>(R"({"do": "pin", "at": [1, 2, 3], "radius": 5})").radius_mm, 5);
  one<request::Unpin>(R"({"do": "unpin"})");
  const auto cut = one<request::Cut>(
      R"({"do": "cut", "path": [[1, 2, 3], [4, 5, 6]], "along": [0, 0, 1], "depth": 30, "centred": true})");
  EXPECT_EQ(cut.path.size(), 2u);
  EXPECT_EQ(std::get<glm::dvec3>(cut.path[1]).x, 4);
  EXPECT_TRUE(cut.is_centred);
  EXPECT_FALSE(cut.is_closed);
  EXPECT_TRUE(one<request::Cut>(R"({"do": "cut", "pixels": [[0, 0], [1, 0], [1, 1]], "along": [0, 0, 1], "depth": 30,
                                    "centred": false, "closed": true})")
                  .is_closed);
  EXPECT_EQ(one<request::Suture>(R"({"do": "suture", "name": "cut 1"})").name, "cut 1");
  EXPECT_EQ(one<request::Reopen>(R"({"do": "reopen", "name": "cut 1"})").name, "cut 1");
  EXPECT_EQ(one<request::Ball>(R"({"do": "ball", "at": [1, 2, 3], "radius": 15})").radius_mm, 15);
  one<request::LiftBall>(R"({"do": "lift"})");
  one<request::Play>(R"({"do": "play"})");
  EXPECT_EQ(one<request::Frame>(R"({"do": "frame", "number": 24})").number, 24);
  const auto tissues = one<request::Tissues>(
      R"({"do": "tissues", "tissues": [{"name": "bone", "stiffness": 300, "compression": 0.1, "stretch": 0.2, "shear": 0.3}]})");
  ASSERT_EQ(tissues.tissues.size(), 1u);
  EXPECT_EQ(tissues.tissues[0].name, "bone");
  EXPECT_EQ(tissues.tissues[0].youngs_modulus_kpa, 300);
  EXPECT_EQ(tissues.tissues[0].shear, 0.3);
  one<request::Redo>(R"({"do": "redo"})");
  one<request::Reset>(R"({"do": "reset"})");
  EXPECT_EQ(one<request::Use>(R"({"do": "use", "method": "mass-spring"})").method, simulate::Method::mass_spring);
  EXPECT_EQ(one<request::Save>(R"({"do": "save", "name": "a", "volume": ".nii.gz"})").volume, ".nii.gz");
  const auto save = one<request::Save>(
      R"({"do": "save", "name": "a", "volume": "", "field": true, "pictures": true, "film": ".gif", "of": "coronal"})");
  EXPECT_TRUE(save.field && save.pictures);
  EXPECT_EQ(save.film, ".gif");
  EXPECT_EQ(save.film_of, request::Pane::coronal);
}

TEST(ViewMessages, WhatIsNoRequestIsRefusedWithTheReason) {
  EXPECT_NE(refusal("").find("no JSON object"), std::string::npos);
  EXPECT_NE(refusal("[]").find("no JSON object"), std::string::npos);
  EXPECT_NE(refusal("{\"do\": \"undo\"").find("no JSON object"), std::string::npos);
  EXPECT_NE(refusal("{}").find("\"do\" is missing"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": 3})").find("\"do\" is no text"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "format"})").find("none of its words"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "undo", "path": "/etc/passwd"})").find("not known"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "look", "at": [1, 2]})").find("no list of 3 numbers"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "look", "at": [1, 2, "3"]})").find("no number"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "look", "at": [1, 2, 1e300]})").find("out of its range"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "look", "at": [1, 2, 1e999]})"), "");
  EXPECT_NE(refusal(R"({"do": "grip", "at": [1, 2, 3], "radius": 0})").find("out of its range"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "grip", "pixel": [0.5, 1.5], "radius": 2})").find("out of its range"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "use", "method": "magic"})").find("none of its words"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "size", "pane": "axial", "width": 9000, "height": 1})").find("range"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "frame", "number": -1})").find("out of its range"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "tissues", "tissues": [3]})").find("no list of objects"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "tissues", "tissues": [{"name": "a", "stiffness": 1, "compression": 2, "stretch": 1,
                                                      "shear": 1}]})")
                .find("\"compression\" is out of its range"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"do": "undo", "n": -1})").find("out of its range"), std::string::npos);
}

TEST(ViewMessages, LongAndDeepOnesAreRefusedBeforeTheyAreRead) {
  EXPECT_NE(refusal(std::string(kMostMessageBytes + 1, ' ')).find("too long"), std::string::npos);
  EXPECT_NE(refusal(std::string(60000, '[')).find("too deep"), std::string::npos);
  EXPECT_NE(refusal(R"({"do": "look", "at": [[[[1]]]]})").find("too deep"), std::string::npos);
  EXPECT_EQ(refusal(R"({"do": "suture", "name": "[[[[[[[[ \" [[[["})"), "");  // brackets of a text are none
  std::string path = R"({"do": "cut", "along": [0, 0, 1], "depth": 30, "centred": true, "path": [)";
  for (int n = 0; n < 1001; ++n) path += n == 0 ? "[0, 0, 0]" : ", [0, 0, 0]";
  EXPECT_NE(refusal(path + "]}").find("no list, or a long one"), std::string::npos);
}

TEST(ViewMessages, ARefusalRepeatsNothingThatThePageSaid) {
  EXPECT_EQ(refusal(R"({"do": "undo", "Mustermann": 1})").find("Mustermann"), std::string::npos);
  EXPECT_EQ(refusal(R"({"do": "Mustermann"})").find("Mustermann"), std::string::npos);
}

TEST(ViewMessages, APictureIsALengthATextAndTheBytesOfAFile) {
  Picture picture;
  picture.pane = request::Pane::coronal;
  picture.number = 12;
  picture.request = 34;
  picture.is_exact = true;
  picture.width = 5;
  picture.height = 6;
  picture.bytes = {std::byte{1}, std::byte{0}, std::byte{255}};
  const std::string message = message_of(picture);
  const auto byte = [&](std::size_t n) { return static_cast<std::size_t>(static_cast<unsigned char>(message[n])); };
  const std::size_t length = byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
  ASSERT_EQ(message.size(), 4 + length + 3);
  const json about = json::parse(message.substr(4, length));
  EXPECT_EQ(about["pane"], "coronal");
  EXPECT_EQ(about["number"], 12);
  EXPECT_EQ(about["request"], 34);
  EXPECT_EQ(about["exact"], true);
  EXPECT_EQ(message.substr(4 + length), std::string("\x01\x00\xff", 3));
}

TEST(ViewMessages, APageLearnsWhereEachPixelOfASliceLies) {
  About about;
  about.grid = {.size = {4, 5, 6}, .spacing = {1, 2, 3}, .origin = {10, 20, 30}};
  const json message = json::parse(message_of(about));
  const json& coronal = message["panes"]["coronal"];  // the head is up, so rows run towards the feet
  EXPECT_EQ(coronal["width"], 4);
  EXPECT_EQ(coronal["height"], 6);
  EXPECT_EQ(coronal["slices"], 5);
  EXPECT_EQ(coronal["first"], json({10.0, 20.0, 45.0}));
  EXPECT_EQ(coronal["right"], json({1.0, 0.0, 0.0}));
  EXPECT_EQ(coronal["down"], json({0.0, 0.0, -3.0}));
  EXPECT_EQ(coronal["next"], json({0.0, 2.0, 0.0}));
  EXPECT_EQ(coronal["letters"], json({"R", "L", "S", "I"}));
}

}  // namespace
}  // namespace tetwarp::viewer
