// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp simulate`: scenarios on a small phantom, end to end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "backend/devices.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;
using nlohmann::json;

/// A phantom of 48 x 48 x 30 voxels of 8 x 8 x 10 mm, and scenarios beside it.
class Simulate : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run_tetwarp(scratch_.path(), "phantom --size 48,48,30 --spacing 8,8,10 --quiet -o ct.mha").status, 0);
    write_file(scratch_ / "push.json", R"({
  "method": "chainmail",
  "cell_size": 2,
  "name": "push",
  "tissues": [
    {"name": "bone", "hu": [300, null], "compression": 0, "stretch": 0, "shear": 0},
    {"name": "rest", "compression": 0.2, "stretch": 0.2, "shear": 0.3}
  ],
  "hold": [{"border": true}],
  "phases": [
    {"name": "in", "frames": 4,
     "move": [{"name": "hand", "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 20}, "by_mm": [0, 12, 0]}]},
    {"name": "aside", "frames": 2,
     "move": [{"name": "hand", "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 20}, "by_mm": [8, 12, 0]}]}
  ]
})");
  }
  /// Writes the scenarios that are shipped, with small cells, for the phantom has few voxels. @return their names
  std::vector<std::string> shipped_scenarios() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(TETWARP_SCENARIOS)) {
      names.push_back(entry.path().stem().string());
      json scenario = json::parse(read_text(entry.path()));
      scenario["cell_size"] = 2;
      write_file(scratch_ / (names.back() + ".json"), scenario.dump());
    }
    return names;
  }
  Outcome run(const std::string& arguments) const { return run_tetwarp(scratch_.path(), arguments); }
  json document(const std::string& name) const { return json::parse(read_text(scratch_ / name)); }
  /// What lies in the folder beside the inputs and the program's own words.
  std::vector<std::string> left() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scratch_.path())) {
      const std::string name = entry.path().filename().string();
      if (name != "ct.mha" && name != "ct.mha.json" && !name.ends_with(".json") && name != ".stdout" &&
          name != ".stderr" && name != "labels.mha")
        names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  Scratch scratch_;
};

float largest(const VertexField& field) {
  float result = 0;
  for (const glm::vec3& by : field.displacement)
    result = std::max(result, std::sqrt(by.x * by.x + by.y * by.y + by.z * by.z));
  return result;
}

TEST_F(Simulate, WritesAForwardFieldThatDeformTakes) {
  const Outcome made = run("simulate push.json ct.mha -o field.mha --report report.json --backend cpu");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(says(made.err, {"simulated: chainmail on the cpu", "wrote field.mha"}));
  EXPECT_EQ(made.out, "");
  const VertexField field = read_forward_field(FieldSource(scratch_ / "field.mha"));
  EXPECT_EQ(field.lattice.size, glm::i64vec3(25, 25, 16));
  EXPECT_NEAR(largest(field), std::sqrt(208.0f), 1e-4f);
  const Outcome deformed = run("deform ct.mha -f field.mha -o out.mha");
  EXPECT_EQ(deformed.status, 0) << deformed.err;
  EXPECT_EQ(left(), (std::vector<std::string>{"field.mha", "out.mha"}));
}

TEST_F(Simulate, DeformMakesTheSameFieldByItself) {
  ASSERT_EQ(run("simulate push.json ct.mha -o field.mha --backend cpu").status, 0);
  ASSERT_EQ(run("deform ct.mha -f field.mha -o two_steps.mha").status, 0);
  const Outcome once = run("deform ct.mha --scenario push.json -o one_step.mha --write-field used.mha --backend cpu");
  ASSERT_EQ(once.status, 0) << once.err;
  EXPECT_EQ(read_text(scratch_ / "field.mha"), read_text(scratch_ / "used.mha"));
  EXPECT_EQ(read_text(scratch_ / "two_steps.mha"), read_text(scratch_ / "one_step.mha"));
  const json told = document("one_step.mha.json");
  EXPECT_EQ(told["field"]["sha256"], document("two_steps.mha.json")["field"]["sha256"]);
  EXPECT_EQ(told["field"]["simulation"]["method"], "chainmail");
  EXPECT_EQ(told["field"]["simulation"]["method_version"], 1);
  EXPECT_EQ(told["options"]["scenario"], "push.json");
}

TEST_F(Simulate, DeformTakesOneSourceOfTheFieldAndAFittingFile) {
  const auto refused = [&](const std::string& options, int status, const std::string& words) {
    const Outcome outcome = run("deform ct.mha " + options + " -o out.mha");
    EXPECT_EQ(outcome.status, status) << options;
    EXPECT_TRUE(says(outcome.err, {words}));
  };
  refused("--scenario push.json -f identity", 2, "--scenario makes the field");
  refused("--labels ct.mha -f identity", 2, "--labels is for --scenario");
  refused("--scenario push.json --cell-size 2", 2, "a scenario says its own");
  refused("-f identity --write-field field.txt", 2, "unknown suffix of --write-field");
  refused("--scenario ct.mha", 4, "ct.mha");
  EXPECT_EQ(left(), std::vector<std::string>());
}

TEST_F(Simulate, ReportSaysWhatWasDone) {
  ASSERT_EQ(run("simulate push.json ct.mha -o field.nii.gz --report report.json --backend cpu").status, 0);
  const json report = document("report.json");
  EXPECT_EQ(report["command"], "simulate");
  EXPECT_EQ(report["method"], "chainmail");
  EXPECT_EQ(report["method_version"], 1);
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["scenario"]["name"], "push");
  EXPECT_EQ(report["lattice"]["size"], json({25, 25, 16}));
  EXPECT_EQ(report["body_box_lps_mm"].size(), 2u);
  ASSERT_EQ(report["tissues"].size(), 2u);
  EXPECT_EQ(report["tissues"][0]["cells"].get<int>() + report["tissues"][1]["cells"].get<int>(), 24 * 24 * 15);
  EXPECT_GT(report["tissues"][0]["cells"], 10);
  ASSERT_EQ(report["phases"].size(), 2u);
  const json& in = report["phases"][0];
  EXPECT_EQ(in["name"], "in");
  EXPECT_EQ(in["held"], 25 * 25 * 16 - 23 * 23 * 14);
  EXPECT_GT(in["moved"], 3);
  EXPECT_GT(in["steps"], 3);
  EXPECT_EQ(in["settled"], true);
  EXPECT_NEAR(in["largest_displacement_mm"], 12, 1e-4);
  EXPECT_TRUE(in["links_beyond_limits"]["count"].is_number_unsigned());
  EXPECT_LE(in["links_beyond_limits"]["first"].size(), 10u);
  for (const char* stage : {"read", "prepare", "simulate", "write"})
    EXPECT_GE(report["stages"][stage]["seconds"], 0) << stage;
}

TEST_F(Simulate, FramesOnTheWayHaveTheirNumbers) {
  ASSERT_EQ(run("simulate push.json ct.mha -o f.nii.gz --every 2 --backend cpu").status, 0);
  EXPECT_EQ(left(), (std::vector<std::string>{"f.0002.nii.gz", "f.0004.nii.gz", "f.0006.nii.gz", "f.nii.gz"}));
  const auto at = [&](const std::string& name) { return read_forward_field(FieldSource(scratch_ / name)); };
  EXPECT_NEAR(largest(at("f.0002.nii.gz")), 6, 1e-4f);
  EXPECT_NEAR(largest(at("f.0004.nii.gz")), 12, 1e-4f);
  EXPECT_TRUE(at("f.0006.nii.gz").displacement == at("f.nii.gz").displacement);
  const Outcome again = run("simulate push.json ct.mha -o f.nii.gz --every 3 --overwrite --quiet --backend cpu");
  EXPECT_EQ(again.status, 0);
  EXPECT_EQ(again.err, "");
  std::filesystem::remove(scratch_ / "f.nii.gz");
  EXPECT_EQ(run("simulate push.json ct.mha -o f.nii.gz --every 3").status, 1) << "f.0003.nii.gz is there";
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "f.nii.gz"));
}

TEST_F(Simulate, BytesDoNotDependOnThreads) {
  ASSERT_EQ(run("simulate push.json ct.mha -o a.mha --threads 1 --backend cpu").status, 0);
  ASSERT_EQ(run("simulate push.json ct.mha -o b.mha --threads 3 --backend cpu").status, 0);
  EXPECT_EQ(read_text(scratch_ / "a.mha"), read_text(scratch_ / "b.mha"));
}

TEST_F(Simulate, DryRunSaysWhatWouldBeDoneAndLeavesNothing) {
  const Outcome dry = run("simulate push.json ct.mha -o field.mha --every 1 --dry-run --backend cpu");
  EXPECT_EQ(dry.status, 0);
  EXPECT_TRUE(says(dry.err, {"would simulate: chainmail on the cpu, 25 x 25 x 16 vertices, 6 frames", "bone",
                             "in phase \"in\" ", "vertices held"}));
  EXPECT_TRUE(left().empty());
}

TEST_F(Simulate, RefusalsAreOneLineWithTheirStatusAndLeaveNothing) {
  const auto refused = [&](const std::string& arguments, int status, const std::vector<std::string>& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_TRUE(says(outcome.err, words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(left().empty()) << left().front();
  };
  const std::string text = read_text(scratch_ / "push.json");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    write_file(scratch_ / "bad.json", other);
  };
  changed("\"radius_mm\": 20", "\"radius_mm\": -3");
  refused("simulate bad.json ct.mha -o f.mha", 4, {"bad.json:12: phases[0].move[0].handle.radius_mm is -3"});
  changed("\"hu\": [300, null]", "\"label\": 3");
  refused("simulate bad.json ct.mha -o f.mha", 4, {"\"bone\"", "--labels"});
  changed("{\"border\": true}", "{\"half_space\": {\"at\": {\"mm\": [0, 0, 9000]}, \"normal\": [0, 0, -1]}}");
  refused("simulate bad.json ct.mha -o f.mha", 4, {"bad.json", "phases[0].move[0] \"hand\" (line 12)", "are held"});
  changed("\"phases\": [",
          "\"cuts\": [{\"name\": \"slit\", \"plane\": {\"at\": {\"body\": [0.5, 0.5, 0.5]}, "
          "\"normal\": [1, 0, 0]}}],\n\"phases\": [");
  refused("simulate bad.json ct.mha -o f.mha", 4, {"\"slit\" is open in aside", "write a mesh"});
  refused("simulate absent.json ct.mha -o f.mha", 4, {"cannot be read (No such file or directory), absent.json"});
  refused("simulate . ct.mha -o f.mha", 4, {"folder"});
  refused("simulate ct.mha ct.mha -o f.mha", 4, {"ct.mha"});
  refused("simulate push.json absent.mha -o f.mha", 4, {"absent.mha"});
  refused("simulate push.json ct.mha -o f.txt", 2, {"f.txt", ".mha .nrrd .nii .nii.gz"});
  refused("simulate push.json ct.mha -o folder", 2, {"folder"});
  refused("simulate push.json ct.mha -o ct.mha --overwrite", 2, {"ct.mha"});
  refused("simulate push.json ct.mha -o f.mha --every 0", 2, {"--every"});
  refused("simulate push.json ct.mha", 2, {"output"});
  refused("simulate push.json ct.mha -o f.mha --labels push.json", 4, {"push.json"});
}

TEST_F(Simulate, CutsThatAreClosedAreTissue) {
  std::string text = read_text(scratch_ / "push.json");
  write_file(scratch_ / "plain.json", text);
  text.replace(
      text.find("\"phases\": ["), 11,
      R"("cuts": [{"name": "slit", "plane": {"at": {"body": [0.5, 0.5, 0.5]}, "normal": [1, 0, 0]}}], "phases": [)");
  for (const std::string name : {"in", "aside"}) {
    const std::string key = "\"name\": \"" + name + "\"";
    text.replace(text.find(key), key.size(), key + ", \"closed_cuts\": [\"slit\"]");
  }
  write_file(scratch_ / "closed.json", text);
  ASSERT_EQ(run("simulate plain.json ct.mha -o a.mha --backend cpu").status, 0);
  const Outcome closed = run("simulate closed.json ct.mha -o b.mha --backend cpu");
  ASSERT_EQ(closed.status, 0) << closed.err;
  EXPECT_EQ(read_text(scratch_ / "a.mha"), read_text(scratch_ / "b.mha"));
}

TEST_F(Simulate, AnOpenCutIsWrittenAsAMeshLeavesAGapAndClosesWithoutATrace) {
  json scenario = json::parse(read_text(std::filesystem::path(TETWARP_SCENARIOS) / "incision.json"));
  scenario["cell_size"] = 2;
  for (const char* method : {"chainmail", "mass-spring"}) {
    SCOPED_TRACE(method);
    scenario["method"] = method;
    json open = scenario;
    open["phases"].erase(1);
    write_file(scratch_ / "open.json", open.dump());
    write_file(scratch_ / "closed.json", scenario.dump());
    const Outcome refused = run("simulate open.json ct.mha -o f.mha --backend cpu");
    EXPECT_EQ(refused.status, 4);
    EXPECT_TRUE(says(refused.err, {"\"midline\" is open in open", "f.mha cannot hold", ".vtu or .vtk"}));
    const Outcome made = run("simulate open.json ct.mha -o f.vtk --backend cpu --overwrite");
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_TRUE(says(made.err, {"cells along open cuts as"}));
    ASSERT_EQ(run("deform ct.mha -f f.vtk -o out.mha --background -3000 --report r.json --overwrite").status, 0);
    const json report = document("r.json");
    EXPECT_GT(report["report"]["uncovered"], 30);
    EXPECT_LT(report["report"]["uncovered"], 1000);
    const Outcome unfit = run("deform ct.mha --scenario open.json -o out.mha --write-field f.mha --backend cpu");
    EXPECT_EQ(unfit.status, 4);
    EXPECT_TRUE(says(unfit.err, {"\"midline\" is open in open", "f.mha cannot hold"}));
    ASSERT_EQ(
        run("deform ct.mha --scenario open.json -o one.mha --background -3000 --write-field one.vtk --backend cpu "
            "--overwrite")
            .status,
        0);
    EXPECT_EQ(read_text(scratch_ / "one.vtk"), read_text(scratch_ / "f.vtk"));
    const Outcome sutured = run("simulate closed.json ct.mha -o g.mha --backend cpu --overwrite");
    ASSERT_EQ(sutured.status, 0) << sutured.err;
    if (std::string(method) == "chainmail") continue;  // it knows no way back to rest
    ASSERT_EQ(run("deform ct.mha -f g.mha -o same.mha --overwrite").status, 0);
    AnyVolume before = read_image(scratch_ / "ct.mha"), after = read_image(scratch_ / "same.mha");
    EXPECT_TRUE(std::ranges::equal(before.as<std::int16_t>(), after.as<std::int16_t>()));
  }
}

TEST_F(Simulate, AnOpenCutIsOneFieldForReportHashGridAndFile) {
  json scenario = json::parse(read_text(std::filesystem::path(TETWARP_SCENARIOS) / "incision.json"));
  scenario["cell_size"] = 3;
  scenario["phases"].erase(1);
  write_file(scratch_ / "open.json", scenario.dump());
  // Cut and lips stay as they are; what else moves lies far from the cut.
  scenario["phases"][0]["move"].push_back(
      {{"name", "back"}, {"handle", {{"at", {{"body", {0.5, 0.55, 0.8}}}}, {"radius_mm", 12}}}, {"by_mm", {0, 0, 9}}});
  write_file(scratch_ / "other.json", scenario.dump());
  const std::string common = " --outside background --background -3000 --backend cpu --overwrite";
  const Outcome made =
      run("deform ct.mha --scenario open.json -o one.mha --report one-report.json --write-field one.vtk" + common);
  ASSERT_EQ(made.status, 0) << made.err;
  ASSERT_EQ(run("deform ct.mha --scenario other.json -o other.mha" + common).status, 0);
  ASSERT_EQ(run("deform ct.mha -f one.vtk -o file.mha --report file-report.json" + common).status, 0);
  const auto field_of = [&](const std::string& name) { return document(name)["field"]; };
  EXPECT_GT(field_of("one.mha.json")["replaced_cells"], 20);
  EXPECT_EQ(field_of("one.mha.json")["lattice"], field_of("file.mha.json")["lattice"]);
  EXPECT_EQ(field_of("one.mha.json")["sha256"], field_of("file.mha.json")["sha256"]);
  EXPECT_NE(field_of("one.mha.json")["sha256"], field_of("other.mha.json")["sha256"]);
  EXPECT_EQ(read_text(scratch_ / "one.mha"), read_text(scratch_ / "file.mha"));
  for (const char* name : {"one-report.json", "file-report.json"}) {
    const json trip = document(name)["quality"]["round_trip"];
    EXPECT_GT(trip["forward_after_inverse"]["points"], 10000) << name;
    EXPECT_LT(trip["forward_after_inverse"]["largest_mm"], 0.1) << name;
  }
  // A vertex of a lattice is snapped like the lattice's, so the same mesh without a lattice is another field.
  std::string plain = read_text(scratch_ / "one.vtk");
  for (auto at = plain.find("tetwarp_lattice"); at != std::string::npos; at = plain.find("tetwarp_lattice", at))
    plain.replace(at, 7, "unknown");
  write_file(scratch_ / "plain.vtk", plain);
  ASSERT_EQ(run("deform ct.mha -f plain.vtk -o plain.mha" + common).status, 0);
  EXPECT_FALSE(field_of("plain.mha.json").contains("lattice"));
  EXPECT_NE(field_of("one.mha.json")["sha256"], field_of("plain.mha.json")["sha256"]);
}

TEST_F(Simulate, AGridThatFitsAnOpenCutHoldsTheLatticeBesideItToo) {
  json scenario = json::parse(read_text(std::filesystem::path(TETWARP_SCENARIOS) / "incision.json"));
  scenario["cell_size"] = 3;
  scenario["phases"].erase(1);
  scenario["hold"].erase(1);  // the border, of which a part, far from the cut, is drawn out of the volume
  scenario["phases"][0]["move"].push_back({{"name", "shoulder"},
                                           {"handle", {{"at", {{"body", {0.5, -0.05, 0.95}}}}, {"radius_mm", 40}}},
                                           {"by_mm", {0, -90, 60}}});
  write_file(scratch_ / "wide.json", scenario.dump());
  const std::string common = " --grid fit --outside background --backend cpu";
  ASSERT_EQ(run("deform ct.mha --scenario wide.json -o wide.mha --write-field wide.vtk" + common).status, 0);
  ASSERT_EQ(run("deform ct.mha -f wide.vtk -o file.mha" + common).status, 0);
  EXPECT_GT(document("wide.mha.json")["field"]["replaced_cells"], 20);
  const Geometry fitting = read_image_header(scratch_ / "wide.mha").geometry;
  EXPECT_EQ(fitting, read_image_header(scratch_ / "file.mha").geometry) << "of the mesh that holds all of the field";
  EXPECT_GT(fitting.size.z, 34);
}

TEST_F(Simulate, LabelsDecideWhatIsHeld) {
  AnyVolume labels = read_image(scratch_ / "ct.mha");
  for (std::int16_t& voxel : labels.as<std::int16_t>()) voxel = 7;
  write_image(scratch_ / "labels.mha", std::as_const(labels).view());
  std::string text = read_text(scratch_ / "push.json");
  text.replace(text.find("{\"border\": true}"), 16, "{\"label\": 7}");
  write_file(scratch_ / "all.json", text);
  const Outcome all = run("simulate all.json ct.mha -o f.mha --labels labels.mha");
  EXPECT_EQ(all.status, 4);
  EXPECT_TRUE(says(all.err, {"are held"}));
  text.replace(text.find("{\"label\": 7}"), 12, "{\"label\": [8, 9]}");
  write_file(scratch_ / "none.json", text);
  const Outcome none = run("simulate none.json ct.mha -o f.mha --labels labels.mha");
  EXPECT_EQ(none.status, 0);
  EXPECT_TRUE(says(none.err, {"tetwarp: warning: hold[0] (line 9) holds no vertex"}));
}

TEST_F(Simulate, StepsThatAreSpentAreAWarning) {
  std::string text = read_text(scratch_ / "push.json");
  text.replace(text.find("\"hold\""), 6, "\"stop\": {\"steps\": 1}, \"hold\"");
  write_file(scratch_ / "short.json", text);
  const Outcome shortened = run("simulate short.json ct.mha -o f.mha --report report.json --backend cpu");
  EXPECT_EQ(shortened.status, 0);
  EXPECT_TRUE(says(shortened.err, {"tetwarp: warning: in phase \"in\" ", "had not settled after 1 steps"}));
  EXPECT_EQ(document("report.json")["phases"][0]["settled"], false);
}

TEST_F(Simulate, ShippedScenariosRunOnThePhantom) {
  for (const std::string& name : shipped_scenarios()) {
    const Outcome made =
        run("simulate " + name + ".json ct.mha -o " + name + ".mha --report " + name + ".report.json --backend cpu");
    ASSERT_EQ(made.status, 0) << name << ": " << made.err;
    const json report = document(name + ".report.json");
    for (const json& phase : report["phases"]) {
      EXPECT_EQ(phase["settled"], true) << name;
      EXPECT_GT(phase["held"], 0) << name;
      if (phase["name"] == "close") {
        EXPECT_LT(phase["largest_displacement_mm"], 0.01) << name;
        continue;
      }
      EXPECT_GT(phase["moved"], 0) << name;
      EXPECT_GT(phase["largest_displacement_mm"], 5) << name;
      EXPECT_LT(phase["largest_displacement_mm"], 100) << name;
    }
    const Outcome deformed = run("deform ct.mha -f " + name + ".mha -o " + name + "_out.mha --outside background");
    EXPECT_EQ(deformed.status, 0) << deformed.err;
  }
}

/// What a report says of a result: all but times, and where it was made.
json result_of(json report) {
  report.erase("stages");
  report.erase("backend");
  report.erase("device");
  report.erase("output");
  report.erase("memory");  // of the process
  report.erase("paths");
  report.erase("total_seconds");
  if (report.contains("field") && report["field"].contains("simulation"))
    report["field"]["simulation"].erase("backend");
  return report;
}

TEST_F(Simulate, ShippedScenariosHaveTheCpusBytesOnADevice) {
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  for (const std::string& name : shipped_scenarios()) {
    SCOPED_TRACE(name);
    for (const std::string backend : {"cpu", "cuda"}) {
      std::filesystem::create_directory(scratch_ / backend);
      const std::string options = " --quiet --overwrite --backend " + backend + " -o " + backend;
      ASSERT_EQ(
          run("simulate " + name + ".json ct.mha --report " + backend + "/field.json" + options + "/field.mha").status,
          0);
      ASSERT_EQ(run("deform ct.mha --scenario " + name + ".json --outside background --report " + backend +
                    "/volume.json" + options + "/volume.mha")
                    .status,
                0);
    }
    for (const char* file : {"/field.mha", "/volume.mha"}) {
      EXPECT_TRUE(read_text(scratch_ / ("cpu" + std::string(file))) ==
                  read_text(scratch_ / ("cuda" + std::string(file))))
          << file;
    }
    for (const char* file : {"/field.json", "/volume.json"}) {
      EXPECT_EQ(result_of(document("cpu" + std::string(file))), result_of(document("cuda" + std::string(file))))
          << file;
    }
  }
}

TEST_F(Simulate, HelpHasAnExample) {
  const Outcome help = run("simulate --help");
  EXPECT_EQ(help.status, 0);
  EXPECT_TRUE(says(help.out, {"Example: tetwarp simulate", "--every", "--labels", "--dry-run"}));
}

}  // namespace
