// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Meshes as fields, through the whole program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "deform/fields/formula.h"
#include "deform/fields/lattice_mesh.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

/// MSH 2.2, text: all digits of the positions.
std::string as_msh(const TetrahedralMesh& mesh) {
  std::ostringstream text;
  text.precision(17);
  text << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" << mesh.rest.size() << "\n";
  for (std::size_t n = 0; n < mesh.rest.size(); ++n)
    text << n + 1 << " " << mesh.rest[n].x << " " << mesh.rest[n].y << " " << mesh.rest[n].z << "\n";
  text << "$EndNodes\n$Elements\n" << mesh.tetrahedra.size() << "\n";
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const glm::u32vec4& t = mesh.tetrahedra[n];
    text << n + 1 << " 4 0 " << t.x + 1 << " " << t.y + 1 << " " << t.z + 1 << " " << t.w + 1 << "\n";
  }
  text << "$EndElements\n$NodeData\n1\n\"displacement\"\n1\n0.0\n3\n0\n3\n" << mesh.rest.size() << "\n";
  for (std::size_t n = 0; n < mesh.displacement.size(); ++n) {
    const glm::vec3& by = mesh.displacement[n];
    text << n + 1 << " " << by.x << " " << by.y << " " << by.z << "\n";
  }
  text << "$EndNodeData\n";
  return text.str();
}

constexpr const char* kWave = "wave:amplitude=6,wavelength=70";

/// A phantom, ct.mha, and the tetrahedra of a wave with cells of 6 voxels over it, wave.msh.
struct Scene {
  Scratch scratch;
  Geometry grid;

  Scene() {
    EXPECT_EQ(run("phantom --size 40,36,24 --spacing 3,3,4 --quiet -o ct.mha").status, 0);
    grid = read_image_header(scratch / "ct.mha").geometry;
    write_file(scratch / "wave.msh", as_msh(mesh_of(sample_on(lattice_over(grid, 6), parse_formula(kWave, grid)))));
  }
  Outcome run(const std::string& arguments) const { return run_tetwarp(scratch.path(), arguments); }
  std::vector<std::int16_t> voxels(const std::string& name) const {
    const AnyVolume volume = read_image(scratch / name);
    const auto values = volume.as<std::int16_t>();
    return {values.begin(), values.end()};
  }
  nlohmann::json document(const std::string& name) const { return nlohmann::json::parse(read_text(scratch / name)); }
  std::filesystem::path operator/(const std::string& name) const { return scratch / name; }
};

TEST(MeshDeform, TheMeshOfALatticeDeformsAsTheLattice) {
  const Scene scene;
  write_file(scene / "points.csv", "x,y,z\n10,20,30\n-15,8,11.5\n5000,0,0\n");
  const std::string options =
      " --outside background --inverse INV.mha --folds FOLDS.nrrd --report REPORT.json"
      " --points points.csv=POINTS.csv -o OUT.mha";
  const auto named = [&](std::string text, const std::string& prefix) {
    for (const std::string name : {"INV", "FOLDS", "REPORT", "POINTS", "OUT"})
      text.replace(text.find(name + "."), name.size(), prefix + name);
    return text;
  };
  const Outcome lattice = scene.run(std::string("deform ct.mha -f ") + kWave + " --cell-size 6" + named(options, "a"));
  ASSERT_EQ(lattice.status, 0) << lattice.err;
  const Outcome mesh = scene.run("deform ct.mha -f wave.msh" + named(options, "b"));
  ASSERT_EQ(mesh.status, 0) << mesh.err;
  EXPECT_EQ(scene.voxels("aOUT.mha"), scene.voxels("bOUT.mha"));
  EXPECT_EQ(read_text(scene / "aFOLDS.nrrd"), read_text(scene / "bFOLDS.nrrd"));
  EXPECT_EQ(read_text(scene / "aPOINTS.csv"), read_text(scene / "bPOINTS.csv"));
  EXPECT_TRUE(says(read_text(scene / "bPOINTS.csv"), {"5000", "outside"}));
  const nlohmann::json a = scene.document("aREPORT.json"), b = scene.document("bREPORT.json");
  EXPECT_EQ(a["report"]["covered"], b["report"]["covered"]);
  EXPECT_EQ(b["field"]["mesh"]["tetrahedra"], 5 * 7 * 6 * 4);
  EXPECT_EQ(b["field"]["files"][0]["displacement"], "displacement");
  EXPECT_EQ(b["field"]["files"][0]["known"]["frame"], "assumed");
  EXPECT_EQ(a["quality"]["round_trip"]["voxels"], b["quality"]["round_trip"]["voxels"]);
  EXPECT_NEAR(a["quality"]["largest_stretch"], b["quality"]["largest_stretch"], 1e-6);
  EXPECT_TRUE(says(b["quality"]["verdict"], {"No tetrahedron folds"}));
}

TEST(MeshDeform, AMeshOfAnOrganGoesWithRest) {
  const Scene scene;
  Geometry organ = scene.grid;  // three cells of 4 voxels an axis
  organ.size = glm::i64vec3(4);
  organ.spacing *= 4.0;
  organ.origin = point_from_index(scene.grid)(glm::dvec3(10, 10, 6));
  VertexField lattice{organ, std::vector<glm::vec3>(64, glm::vec3(0))};
  for (const int n : {21, 22, 25, 26, 37, 38, 41, 42}) lattice.displacement[static_cast<std::size_t>(n)] = {4, -3, 5};
  write_file(scene / "organ.msh", as_msh(mesh_of(lattice)));
  const Outcome refused = scene.run("deform ct.mha -f organ.msh -o out.mha");
  EXPECT_EQ(refused.status, 4);
  EXPECT_TRUE(says(refused.err, {"does not reach over the whole grid", "choose rest or background"}));
  EXPECT_FALSE(std::filesystem::exists(scene / "out.mha"));
  const Outcome run = scene.run("deform ct.mha -f organ.msh --outside rest -o out.mha");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::vector<std::int16_t> before = scene.voxels("ct.mha"), after = scene.voxels("out.mha");
  std::size_t changed = 0;
  for (std::size_t n = 0; n < before.size(); ++n) {
    const std::size_t i = n % 40, j = n / 40 % 36, k = n / (40 * 36);
    const bool inside = i >= 10 && i <= 22 && j >= 10 && j <= 22 && k >= 6 && k <= 18;
    changed += before[n] != after[n];
    ASSERT_TRUE(inside || before[n] == after[n]) << i << ' ' << j << ' ' << k;
  }
  EXPECT_GT(changed, 100U);
  const nlohmann::json sidecar = scene.document("out.mha.json");
  EXPECT_EQ(sidecar["report"]["conflicts"], 0);
  EXPECT_EQ(sidecar["report"]["uncovered"], 0);
}

TEST(MeshDeform, InvertsAndComposesAndFits) {
  const Scene scene;
  const Outcome run = scene.run("invert wave.msh --like ct.mha -o inverse.mha --report inverse.json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_LT(scene.document("inverse.json")["forward_after_inverse"]["largest_mm"], 2e-3);
  EXPECT_GT(scene.document("inverse.json")["inverse_after_forward"]["points"], 50);
  ASSERT_EQ(scene.run("deform ct.mha -f wave.msh -f translate:by=3/0/0 --outside background -o both.mha").status, 0);
  ASSERT_EQ(scene
                .run(std::string("deform ct.mha -f ") + kWave +
                     " -f translate:by=3/0/0 --cell-size 6 --outside background -o lattice.mha")
                .status,
            0);
  EXPECT_EQ(scene.voxels("both.mha"), scene.voxels("lattice.mha"));
  ASSERT_EQ(scene.run("deform ct.mha -f wave.msh --grid fit -o fit.mha").status, 0);
  EXPECT_GT(read_image_header(scene / "fit.mha").geometry.size.x, 40);
}

TEST(MeshDeform, WhatAMeshCannotBeIsRefused) {
  const Scene scene;
  const auto expect = [&](const std::string& arguments, int status, const std::string& part) {
    const Outcome run = scene.run(arguments);
    EXPECT_EQ(run.status, status) << arguments << "\n" << run.err;
    EXPECT_TRUE(says(run.err, {part})) << run.err;
    EXPECT_FALSE(std::filesystem::exists(scene / "x.mha"));
  };
  expect("deform ct.mha -f identity -f wave.msh -o x.mha", 2, "let it be the first -f");
  expect("deform ct.mha -f wave.msh --cell-size 4 -o x.mha", 2, "has its own vertices");
  expect("deform ct.mha -f wave.msh:frame=abc -o x.mha", 2, "frame=abc");
  expect("deform ct.mha --pull-field wave.msh -o x.mha", 4, "give it with -f");
  expect("field wave.msh --like ct.mha -o x.mha", 4, "no lattice");
  expect("deform ct.mha -f wave.msh:displacement=U -o x.mha", 4, "displacement");
  expect("deform ct.mha -f wave.msh --memory 1K -o x.mha", 1, "memory");
  std::string text = read_text(scene / "wave.msh");
  write_file(scene / "cut.msh", text.substr(0, text.size() / 3));
  expect("deform ct.mha -f cut.msh -o x.mha", 4, "cut.msh");
  text.replace(text.find("$Nodes\n") + 11, 1, "n");
  write_file(scene / "nan.msh", text);
  expect("deform ct.mha -f nan.msh -o x.mha", 4, "nan.msh");
}

}  // namespace
