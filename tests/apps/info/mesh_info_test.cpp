// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `tetwarp info` says of a mesh.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/gmsh_file.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

TEST(MeshInfo, SaysWhatTheMeshHoldsAndWhatIsAssumed) {
  const Scratch scratch;
  write_file(scratch / "a.msh", GmshSample().write({"4.1"}));
  const Outcome text = run_tetwarp(scratch.path(), "info a.msh");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_TRUE(says(text.out, {"a.msh: mesh", "format       Gmsh MSH 4.1, text", "vertices     5",
                              "tetrahedra   2, of cells: tetrahedron 2", "direction    forward (by the format)",
                              "frame LPS (assumed), mm (assumed)", "displacement \"U\", at most 9.11043 mm",
                              "1 points, lines and surface elements are left out"}));
  const Outcome run = run_tetwarp(scratch.path(), "info --json a.msh:frame=ras,units=m");
  EXPECT_EQ(run.status, 0) << run.err;
  const auto said = nlohmann::json::parse(run.out);
  EXPECT_EQ(said["kind"], "mesh");
  EXPECT_EQ(said["path"], "a.msh");
  EXPECT_EQ(said["vertices"], 5);
  EXPECT_EQ(said["tetrahedra"], 2);
  EXPECT_EQ(said["cells"], (nlohmann::json{{"tetrahedron", 2}}));
  EXPECT_EQ(said["direction"], "forward");
  EXPECT_EQ(said["frame"], "RAS");
  EXPECT_EQ(said["units"], "m");
  EXPECT_EQ(said["known"]["frame"], "by an option");
  EXPECT_EQ(said["known"]["direction"], "by the format");
  EXPECT_EQ(said["displacement"], "U");
  EXPECT_NEAR(said["largest_displacement_mm"].get<double>(), 9110.43, 0.01);
  EXPECT_EQ(said["notes"].size(), 2U);
}

TEST(MeshInfo, AMeshWithoutADisplacementIsDescribedAndAWrongOptionRefused) {
  const Scratch scratch;
  const std::string whole = GmshSample().write({"4.1"});
  write_file(scratch / "a.msh", whole.substr(0, whole.find("$NodeData")));
  const Outcome text = run_tetwarp(scratch.path(), "info a.msh");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_TRUE(says(text.out, {"vectors      none at the vertices", "displacement undecided; give displacement=NAME"}));
  const auto said = nlohmann::json::parse(run_tetwarp(scratch.path(), "info --json a.msh").out);
  EXPECT_TRUE(said["displacement"].is_null());
  EXPECT_TRUE(said["largest_displacement_mm"].is_null());
  EXPECT_EQ(run_tetwarp(scratch.path(), "info a.msh:frame=xyz").status, 2);
  write_file(scratch / "b.msh", whole.substr(0, whole.size() / 2));
  const Outcome damaged = run_tetwarp(scratch.path(), "info b.msh");
  EXPECT_EQ(damaged.status, 4);
  EXPECT_TRUE(says(damaged.err, {"tetwarp: error: ", "b.msh"}));
}

}  // namespace
