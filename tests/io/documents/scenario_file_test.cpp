// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/scenario_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "deform/errors.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

using namespace simulate;

/// A scenario in which everything occurs, a key a line.
constexpr const char* kWhole = R"({
  "$schema": "../../docs/scenario.schema.json",
  "name": "everything", "description": "Every key",
  "method": "mass-spring",
  "cell_size": 4,
  "body_above_hu": -300,
  "tissues": [
    {"name": "bone", "hu": [200, null], "youngs_modulus_kpa": 1e4, "compression": 0, "stretch": 0.01, "shear": 0.02},
    {"name": "liver", "label": [5, 6], "hu": [null, 100]},
    {"name": "rest"}
  ],
  "hold": [
    {"all_of": [{"hu": [200, 3000]}, {"not": {"label": 7}}]},
    {"border": true}
  ],
  "cuts": [
    {"name": "midline", "plane": {"at": {"body": [0.5, 0.5, 0.5]}, "normal": [1, 0, 0]}},
    {"name": "round", "disc": {"at": {"mm": [1, 2, 3]}, "normal": [0, 0, 4], "radius_body": 0.25}},
    {"name": "slit", "swept": {"path": [{"mm": [0, 0, 0]}, {"mm": [9, 0, 0]}, {"mm": [9, 9, 0]}], "along": [0, 1, 0],
                               "depth_mm": 30, "closed": true}}
  ],
  "phases": [
    {"name": "open", "frames": 10, "closed_cuts": ["round"], "move": [
      {"name": "lip", "handle": {"at": {"body": [0.4, 0, 0.5]}, "radius_mm": 20}, "by_mm": [-25, 0, 0]},
      {"region": {"sphere": {"at": {"mm": [1, 2, 3]}, "radius_body": 0.5}}, "by_body": [0, 0.1, 0]},
      {"region": {"half_space": {"at": {"mm": [1, 2, 3]}, "normal": [0, 0, -2]}},
       "rotate": {"about": {"body": [0.5, 0.5, 0]}, "axis": [1, 0, 0], "degrees": -20}},
      {"region": {"any_of": [{"box": {"from": {"mm": [1, 2, 3]}, "to": {"mm": [0, 0, 0]}}}, {"body": true}]},
       "force_n": [0, 0, 5]}
    ]},
    {"closed_cuts": ["midline", "round", "slit"]},
    {"name": "by hand", "frames": 2, "closed_cuts": ["slit"], "pin": [{"label": 9}, {"border": true}],
     "push": {"radius_mm": 12.5, "path_mm": [[0, 0.1, 3], [1, 0, 2.5]]},
     "move": [{"handle": {"at": {"mm": [4, 5, 6]}, "radius_mm": 7}, "drag_mm": [[0, 0, 0], [1, 0.1, -3]]}]}
  ],
  "stop": {"motion_mm": 0.02, "residual": 1e-4, "steps": 500},
  "deadband_mm": 0.05
}
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class ScenarioFile : public testing::Test {
 protected:
  Scenario read(const std::string& text) {
    write_file(scratch_ / "s.json", text);
    return read_scenario(scratch_ / "s.json");
  }
  /// The one line that says why, without the folder: "s.json:3: ...".
  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      const std::string what = error.what(), folder = scratch_.path().string() + "/";
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
      return what.starts_with(folder) ? what.substr(folder.size()) : what;
    }
    return "taken";
  }
  /// The refusal of the whole scenario with one text replaced by another.
  std::string refusal(const std::string& from, const std::string& to) { return refusal(replaced(kWhole, from, to)); }

  Scratch scratch_;
};

TEST_F(ScenarioFile, ReadsEverything) {
  const Scenario scenario = read(kWhole);
  EXPECT_EQ(scenario.name, "everything");
  EXPECT_EQ(scenario.description, "Every key");
  EXPECT_EQ(scenario.method, Method::mass_spring);
  EXPECT_EQ(scenario.cell_size, 4);
  EXPECT_EQ(scenario.body_above_hu, -300);
  EXPECT_EQ(scenario.deadband_mm, 0.05);
  ASSERT_EQ(scenario.tissues.size(), 3u);
  EXPECT_EQ(scenario.tissues[0].tissue.youngs_modulus_kpa, 1e4);
  EXPECT_EQ(scenario.tissues[0].tissue.shear, 0.02);
  EXPECT_TRUE(scenario.tissues[0].hu->contains(1e9));
  EXPECT_EQ(scenario.tissues[1].labels, (std::vector<std::int64_t>{5, 6}));
  EXPECT_TRUE(scenario.tissues[1].hu->contains(-1e9));
  EXPECT_FALSE(scenario.tissues[1].hu->contains(100));
  EXPECT_EQ(scenario.tissues[2].tissue.youngs_modulus_kpa, 10);
  ASSERT_EQ(scenario.hold.size(), 2u);
  EXPECT_EQ(std::get<AllOf>(scenario.hold[0].zone.shape).parts.size(), 2u);
  EXPECT_EQ(scenario.hold[1].entry, "hold[1] (line 14)");
  ASSERT_EQ(scenario.cuts.size(), 3u);
  EXPECT_EQ(std::get<DiscCutPlan>(scenario.cuts[1].shape).radius.unit, Unit::body);
  EXPECT_TRUE(std::get<SweptCutPlan>(scenario.cuts[2].shape).is_closed);
  EXPECT_EQ(scenario.stop.steps, 500);
  EXPECT_EQ(scenario.stop.residual, 1e-4);
}

TEST_F(ScenarioFile, ReadsPhasesAndMoves) {
  const Scenario scenario = read(kWhole);
  ASSERT_EQ(scenario.phases.size(), 3u);
  const Phase& open = scenario.phases[0];
  EXPECT_EQ(open.frames, 10);
  EXPECT_EQ(open.closed_cuts, std::vector<std::string>{"round"});
  ASSERT_EQ(open.moves.size(), 4u);
  EXPECT_EQ(open.moves[0].entry, "phases[0].move[0] \"lip\" (line 24)");
  EXPECT_EQ(open.moves[0].name, "lip");
  EXPECT_EQ(std::get<Handle>(open.moves[0].what).at.at, glm::dvec3(0.4, 0, 0.5));
  EXPECT_EQ(std::get<Shift>(open.moves[0].how).by, glm::dvec3(-25, 0, 0));
  EXPECT_EQ(std::get<Shift>(open.moves[1].how).unit, Unit::body);
  EXPECT_EQ(std::get<Rotation>(open.moves[2].how).degrees, -20);
  EXPECT_EQ(std::get<Force>(open.moves[3].how).newton, glm::dvec3(0, 0, 5));
  EXPECT_EQ(scenario.phases[1].name, "phases[1]");
  EXPECT_EQ(scenario.phases[1].frames, 1);
  const Phase& by_hand = scenario.phases[2];
  EXPECT_EQ(by_hand.frames, 2);
  ASSERT_EQ(by_hand.pins.size(), 2u);
  EXPECT_EQ(by_hand.pins[0].entry, "phases[2].pin[0] (line 32)");
  EXPECT_EQ(by_hand.push->radius_mm, 12.5);
  EXPECT_EQ(by_hand.push->at_mm, (std::vector<glm::dvec3>{{0, 0.1, 3}, {1, 0, 2.5}}));
  EXPECT_EQ(std::get<Drag>(by_hand.moves[0].how).by_mm, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0.1, -3}}));
  const Scenario small = read(R"({"method": "chainmail", "move": [{"region": {"body": true}, "by_mm": [1, 0, 0]}]})");
  ASSERT_EQ(small.phases.size(), 1u);
  EXPECT_EQ(small.phases[0].frames, 1);
  EXPECT_EQ(small.cell_size, 8);
  EXPECT_EQ(small.tissues.size(), 1u);
}

TEST_F(ScenarioFile, AWayHasAPlaceForEachFrameAndSaysHowManyThereAre) {
  const auto with = [](const std::string& keys) { return "{\"method\": \"chainmail\", \"phases\": [{" + keys + "}]}"; };
  const std::string drag = R"("move": [{"region": {"body": true}, "drag_mm": [[1, 0, 0], [2, 0, 0], [3, 0, 0]]}])",
                    push = R"("push": {"radius_mm": 3, "path_mm": [[1, 0, 0], [2, 0, 0]]})";
  EXPECT_EQ(read(with(drag)).phases[0].frames, 3);
  EXPECT_EQ(read(with(push)).phases[0].frames, 2);
  EXPECT_EQ(read("{\"method\": \"chainmail\", " + drag + "}").phases[0].frames, 3);
  EXPECT_EQ(refusal(with(drag + ", \"frames\": 2")),
            "s.json:1: phases[0].move[0].drag_mm has 3 places, and the phase 2 frames; a place a frame is expected");
  EXPECT_EQ(refusal(with(drag + ", " + push)),
            "s.json:1: phases[0].push.path_mm has 2 places, and the phase 3 frames; a place a frame is expected");
}

TEST_F(ScenarioFile, WhatIsWrittenIsReadAsTheSameAndWrittenAlike) {
  std::vector<std::string> texts = {kWhole};
  for (const auto& entry : std::filesystem::directory_iterator(TETWARP_SCENARIOS)) {
    std::ifstream file(entry.path());
    texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  for (const std::string& text : texts) {
    const Scenario first = read(text);
    const std::string written = scenario_text(first);
    const Scenario again = read(written);
    EXPECT_EQ(scenario_text(again), written);
    EXPECT_EQ(again.name, first.name);
    EXPECT_EQ(frame_count(again), frame_count(first));
    ASSERT_EQ(again.phases.size(), first.phases.size());
  }
  // No key of the file in which everything occurs is lost, and no number.
  nlohmann::json whole = nlohmann::json::parse(kWhole), again = nlohmann::json::parse(scenario_text(read(kWhole)));
  whole.erase("$schema");
  for (nlohmann::json& tissue : whole["tissues"])  // what may be left out is written
    for (const auto& [key, value] :
         {std::pair{"youngs_modulus_kpa", 10.0}, {"compression", 0.2}, {"stretch", 0.2}, {"shear", 0.2}})
      if (!tissue.contains(key)) tissue[key] = value;
  whole["phases"][1]["frames"] = 1;
  for (const char* shape : {"half_space"})
    whole["phases"][0]["move"][2]["region"][shape]["normal"] = {0, 0, -1};  // of any length
  whole["cuts"][1]["disc"]["normal"] = {0, 0, 1};
  for (nlohmann::json* label : {&whole["hold"][0]["all_of"][1]["not"]["label"], &whole["phases"][2]["pin"][0]["label"]})
    *label = nlohmann::json::array({*label});
  EXPECT_EQ(again, whole) << nlohmann::json::diff(whole, again).dump(1);
}

TEST_F(ScenarioFile, RefusalsNameLineKeyAndWhatIsExpected) {
  EXPECT_EQ(refusal("\"radius_mm\": 20", "\"radius_mm\": -3"),
            "s.json:24: phases[0].move[0].handle.radius_mm is -3; a number above 0, to 100000 is expected");
  EXPECT_EQ(refusal("\"cell_size\": 4", "\"cell_size\": 4.5"),
            "s.json:5: cell_size is 4.5; a whole number from 1 to 512 is expected");
  EXPECT_EQ(refusal("\"cell_size\": 4", "\"cell_size\": \"4\""),
            "s.json:5: cell_size is a text; a whole number from 1 to 512 is expected");
  EXPECT_EQ(refusal("\"cell_size\"", "\"cellsize\""),
            "s.json:5: the key \"cellsize\" is not known; did you mean \"cell_size\"?");
  EXPECT_EQ(refusal("\"by_mm\": [-25", "\"bymm\": [-25"),
            "s.json:24: phases[0].move[0]: the key \"bymm\" is not known; did you mean \"by_mm\"?");
  EXPECT_TRUE(says(refusal("\"degrees\"", "\"temperature\""),
                   {"s.json:27: phases[0].move[2].rotate: the key \"temperature\" is not known; known are about, axis "
                    "or degrees"}));
  EXPECT_EQ(refusal("\"method\": \"mass-spring\"", "\"method\": \"springs\""),
            "s.json:4: method is \"springs\"; chainmail or mass-spring is expected");
  EXPECT_EQ(refusal("  \"method\": \"mass-spring\",\n", ""), "s.json:1: the scenario has no \"method\"");
  EXPECT_EQ(refusal("\"by_mm\": [-25, 0, 0]", "\"by_mm\": [-25, 0]"),
            "s.json:24: phases[0].move[0].by_mm has 2 parts; a list of 3 is expected");
  EXPECT_EQ(refusal("\"by_mm\": [-25, 0, 0]", "\"by_mm\": [-25, 0, null]"),
            "s.json:24: phases[0].move[0].by_mm[2] is null; a number from -10000 to 10000 is expected");
  EXPECT_EQ(refusal("\"normal\": [0, 0, 4]", "\"normal\": [0, 0, 0]"),
            "s.json:18: cuts[1].disc.normal has no length; a direction is expected");
}

TEST_F(ScenarioFile, RefusesWhatDoesNotGoTogether) {
  EXPECT_EQ(
      refusal(", \"by_mm\": [-25, 0, 0]", ""),
      "s.json:24: phases[0].move[0] has none of by_mm, by_body, rotate, drag_mm or force_n; one of them is expected");
  EXPECT_EQ(refusal("\"by_mm\": [-25, 0, 0]", "\"by_mm\": [-25, 0, 0], \"force_n\": [1, 0, 0]"),
            "s.json:24: phases[0].move[0] has both by_mm and force_n; one of them is expected");
  EXPECT_EQ(refusal("\"mass-spring\"", "\"chainmail\""),
            "s.json:29: phases[0].move[3].force_n is a force, which chainmail knows nothing of; mass-spring does");
  EXPECT_EQ(refusal("\"name\": \"round\"", "\"name\": \"midline\""),
            "s.json:18: cuts[1].name is \"midline\", the name of another cut; give each its own");
  EXPECT_EQ(refusal("[\"round\"], \"move\"", "[\"square\"], \"move\""),
            "s.json:23: phases[0].closed_cuts[0] is \"square\", which is no cut; the cuts are midline, round, slit");
  EXPECT_EQ(refusal("{\"name\": \"rest\"}", "{\"name\": \"rest\", \"hu\": [0, 1]}"),
            "s.json:10: tissues[2] has a condition; the last tissue is the rest, whatever its HU and label: leave out "
            "hu and label");
  EXPECT_EQ(refusal("\"label\": [5, 6], \"hu\": [null, 100]", "\"stretch\": 1"),
            "s.json:9: tissues[1] has no condition, hu or label, so that those after it are never met");
  EXPECT_EQ(refusal("[200, 3000]", "[200, 200]"),
            "s.json:13: hold[0].all_of[0].hu is empty; the lower HU first and a higher one are expected");
  EXPECT_EQ(refusal("\"phases\": [", "\"frames\": 3,\n  \"phases\": ["),
            "s.json:22: frames stands beside phases; put it into them");
  EXPECT_EQ(refusal("{\"border\": true}", "{\"border\": false}"),
            "s.json:14: hold[1].border is false; leave it out, or say \"not\"");
  EXPECT_EQ(refusal(R"({"method": "chainmail"})"),
            "s.json:1: the scenario has no \"move\" and no \"phases\"; one of them is expected");
}

TEST_F(ScenarioFile, CountsLinesWhereNumbersEndThem) {
  EXPECT_EQ(refusal("{\"method\": \"chainmail\",\r\n\"cell_size\":\r\n0\r\n\r\n}"),
            "s.json:3: cell_size is 0; a whole number from 1 to 512 is expected");
  EXPECT_EQ(refusal("{\"method\": \"chainmail\", \"phases\": [{}],\n\"stop\": {\"steps\": 5,\n\"motion_mm\": -2\n}\n}"),
            "s.json:3: stop.motion_mm is -2; a number above 0, to 1000 is expected");
  EXPECT_EQ(refusal("{\"method\": \"chainmail\", \"phases\": [{\"frames\":\n1.5e300\n}]}"),
            "s.json:2: phases[0].frames is 1.5e+300; a whole number from 1 to 10000 is expected");
}

TEST_F(ScenarioFile, RefusesWhatIsNoJson) {
  EXPECT_TRUE(says(refusal(""), {"s.json:1: no JSON: "}));
  EXPECT_TRUE(says(refusal("{\n\n\"method\": chainmail}"), {"s.json:3: no JSON: "}));
  EXPECT_TRUE(says(refusal("{\n\"method\": \"chainmail\"\n"), {"s.json:2: no JSON: "}));
  EXPECT_TRUE(says(refusal("{\"name\": \"\xff\xfe\"}"), {"s.json:1: no JSON: ", "UTF-8"}));
  EXPECT_TRUE(says(refusal(std::string("\0\1\2binary", 9)), {"s.json:1: no JSON: "}));
  EXPECT_EQ(refusal("{\"cell_size\":\n1e999}"), "s.json:2: the number 1e999 is too large");
  EXPECT_EQ(refusal("{\"name\": \"a\",\n\"method\": 1,\n\"name\": \"b\"}"),
            "s.json:3: the key \"name\" a second time; the first is in line 1");
  EXPECT_EQ(refusal("[]"), "s.json:1: the scenario is a list; an object is expected");
  EXPECT_EQ(refusal("3"), "s.json:1: the scenario is a number; an object is expected");
  EXPECT_EQ(refusal("{\"\xc3\xa4\\n\": 1}").substr(0, 28), "s.json:1: the key \"\?\?\?\" is n");
  EXPECT_TRUE(says(refusal("\"cell_size\": 4", "\"cell_size\": 1e308"), {"s.json:5: cell_size is 1e+308; "}));
}

TEST_F(ScenarioFile, RefusesWhatIsTooDeepOrTooLarge) {
  EXPECT_EQ(refusal(std::string(100000, '[')), "s.json:1: lists and objects lie more than 64 deep in each other");
  std::string nested = R"({"method": "chainmail", "hold": [)";
  for (int n = 0; n < 500; ++n) nested += R"({"not":)";
  EXPECT_TRUE(says(refusal(nested), {"64 deep"}));
  EXPECT_TRUE(says(refusal(std::string((8 << 20) + 1, ' ')), {"more than 8388608 bytes"}));
  std::string many = "{\"hold\": [";
  for (int n = 0; n < 1001; ++n) many += std::string(n > 0 ? "," : "") + "{\"border\":true}";
  EXPECT_TRUE(says(refusal(many + "], \"method\": \"chainmail\"}"), {"hold has 1001 parts; a list of 0 to 1000"}));
}

TEST_F(ScenarioFile, RefusesWhatIsNoFile) {
  const auto of_path = [](const std::filesystem::path& path) -> std::string {
    try {
      read_scenario(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_TRUE(says(of_path(scratch_.path()), {"is a folder"}));
  EXPECT_TRUE(says(of_path(scratch_ / "absent.json"), {"cannot be read", "absent.json"}));
}

/// Files that are refused for their form, by the program and by the schema.
const std::vector<std::string> kBadForms = {
    "{}",
    "[]",
    R"({"method": "chainmail"})",
    R"({"method": "chainmail", "move": []})",
    R"({"method": "fem", "move": [{"region": {"body": true}, "by_mm": [1, 0, 0]}]})",
    R"({"method": "chainmail", "move": [{"region": {"body": true}, "by_mm": [1, 0, 0]}], "phases": [{}]})",
    R"({"method": "chainmail", "frames": 2, "phases": [{}]})",
    R"({"method": "chainmail", "phases": []})",
    R"({"method": "chainmail", "phases": [{"frames": 0}]})",
    R"({"method": "chainmail", "phases": [{"frames": 1.5}]})",
    R"({"method": "chainmail", "phases": [{"movement": []}]})",
    R"({"method": "chainmail", "phases": [{}], "cell_size": 0})",
    R"({"method": "chainmail", "phases": [{}], "name": ""})",
    R"({"method": "chainmail", "phases": [{}], "name": null})",
    R"({"method": "chainmail", "phases": [{}], "description": 3})",
    R"({"method": "chainmail", "phases": [{}], "cuts": []})",
    R"({"method": "chainmail", "phases": [{}], "cuts": [{"name": "a"}]})",
    R"({"method": "chainmail", "phases": [{}], "cuts": [{"plane": {"at": {"mm": [0, 0, 0]}, "normal": [1, 0, 0]}}]})",
    R"({"method": "chainmail", "phases": [{}], "cuts": [{"name": "a", "plane": {"at": {"mm": [0, 0, 0]}, "normal": [0, 0, 0]}}]})",
    R"({"method": "chainmail", "phases": [{}], "cuts": [{"name": "a", "swept": {"path": [{"mm": [0, 0, 0]}], "along": [0, 0, 1], "depth_mm": 3}}]})",
    R"({"method": "chainmail", "phases": [{}], "cuts": [{"name": "a", "swept": {"path": [{"mm": [0, 0, 0]}, {"mm": [1, 0, 0]}], "along": [0, 0, 1], "depth_mm": 3, "closed": true}}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"border": true, "body": true}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"border": false}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"hu": [0]}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"label": []}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"label": 1.5}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"all_of": []}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"sphere": {"at": {"mm": [0, 0, 0]}, "radius_mm": 0}}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"sphere": {"at": {"mm": [0, 0, 0]}}}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"sphere": {"at": {"mm": [0, 0, 0]}, "radius_mm": 1, "radius_body": 1}}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"sphere": {"at": {"mm": [0, 0]}, "radius_mm": 1}}]})",
    R"({"method": "chainmail", "phases": [{}], "hold": [{"sphere": {"at": {"mm": [0, 0, 0], "body": [0, 0, 0]}, "radius_mm": 1}}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"by_mm": [0, 0, 0]}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "by_mm": [0, 0, 0], "by_body": [0, 0, 0]}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "rotate": {"axis": [0, 0, 1], "degrees": 3}}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "rotate": {"about": {"mm": [0, 0, 0]}, "axis": [0, 0, 1], "degrees": 181}}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "drag_mm": []}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "drag_mm": [1, 0, 0]}]}]})",
    R"({"method": "chainmail", "phases": [{"move": [{"region": {"body": true}, "drag_mm": [[0, 0, 0]], "by_mm": [0, 0, 0]}]}]})",
    R"({"method": "chainmail", "phases": [{"pin": [{}]}]})",
    R"({"method": "chainmail", "phases": [{}], "pin": [{"body": true}]})",
    R"({"method": "chainmail", "phases": [{"push": {"radius_mm": 3}}]})",
    R"({"method": "chainmail", "phases": [{"push": {"radius_mm": 0, "path_mm": [[0, 0, 0]]}}]})",
    R"({"method": "chainmail", "phases": [{"push": {"radius_mm": 3, "path_mm": [[0, 0]]}}]})",
    R"({"method": "chainmail", "phases": [{}], "stop": {"steps": 0}})",
    R"({"method": "chainmail", "phases": [{}], "deadband_mm": -0.1})",
    R"({"method": "chainmail", "phases": [{}], "deadband_mm": 11})",
    R"({"method": "chainmail", "phases": [{}], "stop": {"motion": 1}})",
    R"({"method": "chainmail", "phases": [{}], "tissues": [{}]})",
    R"({"method": "chainmail", "phases": [{}], "tissues": [{"name": "a", "compression": 1.5}]})",
};

TEST_F(ScenarioFile, SchemaTakesWhatIsShippedAndRefusesWhatTheReaderRefuses) {
  if (std::system("'" TETWARP_PYTHON "' -c 'import jsonschema' 2> '/dev/null'") != 0)
    GTEST_SKIP() << "python3-jsonschema is not installed";
  std::string good, bad;
  std::size_t shipped = 0;
  for (const auto& entry : std::filesystem::directory_iterator(TETWARP_SCENARIOS)) {
    good += " '" + entry.path().string() + "'";
    ++shipped;
  }
  EXPECT_GE(shipped, 4u);
  write_file(scratch_ / "whole.json", kWhole);
  good += " '" + (scratch_ / "whole.json").string() + "'";
  for (std::size_t n = 0; n < kBadForms.size(); ++n) {
    EXPECT_NE(refusal(kBadForms[n]), "taken") << kBadForms[n];
    write_file(scratch_ / (std::to_string(n) + ".json"), kBadForms[n]);
    bad += " '" + (scratch_ / (std::to_string(n) + ".json")).string() + "'";
  }
  const std::string check = "'" TETWARP_PYTHON "' '" TETWARP_CHECK_SCENARIO "' '" TETWARP_SCHEMA "'";
  EXPECT_EQ(std::system((check + " good" + good).c_str()), 0);
  EXPECT_EQ(std::system((check + " bad" + bad).c_str()), 0);
}

TEST_F(ScenarioFile, ShippedScenariosAreRead) {
  for (const auto& entry : std::filesystem::directory_iterator(TETWARP_SCENARIOS)) {
    const Scenario scenario = read_scenario(entry.path());
    EXPECT_FALSE(scenario.name.empty()) << entry.path();
  }
}

}  // namespace
}  // namespace tetwarp
