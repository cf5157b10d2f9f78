// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform --points`: landmarks and surfaces go where the voxels under them go.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/point_files.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

Outcome expect_run(const Scratch& scratch, const std::string& arguments) {
  const Outcome run = run_tetwarp(scratch.path(), arguments);
  EXPECT_EQ(run.status, 0) << arguments << "\n" << run.err;
  return run;
}

/// Where the samples lie: 30 mm around them, not along the axes.
Geometry grid_of_samples() {
  Geometry grid = oblique_grid();
  grid.size = {40, 36, 30};
  grid.spacing = {1.5, 2, 2.5};
  grid.origin = glm::dvec3(5, 9, 3) - point_from_index(grid).linear * glm::dvec3(19.5, 17.5, 14.5);
  return grid;
}

void write_spot(const std::filesystem::path& path, const Geometry& grid, const glm::dvec3& landmark) {
  AnyVolume volume(grid, VoxelType::i16);
  const AffineMap point = point_from_index(grid);
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 from = point(glm::dvec3(i, j, k)) - landmark;
        volume.as<std::int16_t>()[n++] = static_cast<std::int16_t>(30000 * std::exp(-glm::dot(from, from) / 20));
      }
    }
  }
  write_image(path, volume.view());
}

glm::dvec3 middle_of_spot(const std::filesystem::path& path) {
  const AnyVolume volume = read_image(path);
  const Geometry& grid = volume.geometry();
  const AffineMap point = point_from_index(grid);
  glm::dvec3 sum(0);
  double weight = 0;
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const double value = volume.as<std::int16_t>()[n++];
        sum += value * point(glm::dvec3(i, j, k));
        weight += value;
      }
    }
  }
  return sum / weight;
}

TEST(DeformPoints, ALandmarkGoesWithTheBrightSpotUnderIt) {
  const Scratch scratch;
  const Geometry grid = grid_of_samples();
  write_spot(scratch / "in.mha", grid, sample_points()[0]);
  write_file(scratch / "in.csv", sample_csv());
  const std::string wave = "wave:amplitude=6,wavelength=90,phase=70,axis=y,along=x ";
  for (const std::string& field :
       {wave + "-f twist:angle=60,axis=x --cell-size 1", wave + "--cell-size 3",
        wave + "-f twist:angle=60,axis=x --cell-size 6", std::string("translate:by=2.5/-7/4 --cell-size 16")}) {
    SCOPED_TRACE(field);
    expect_run(scratch, "deform in.mha -f " + field +
                            " -o out.mha --background 0 --points in.csv=out.csv:lps --overwrite --quiet");
    write_file(scratch / "back.csv", read_text(scratch / "out.csv"));
    const PointsFile back(scratch / "back.csv");
    EXPECT_LE(glm::length(middle_of_spot(scratch / "out.mha") - back.points()[0]), 0.2);
    EXPECT_GE(glm::length(back.points()[0] - sample_points()[0]), 1.0);
  }
}

TEST(DeformPoints, TheCsvOfThePromiseGetsAStatus) {
  const Scratch scratch;
  write_spot(scratch / "in.mha", grid_of_samples(), {0, 0, 0});
  write_file(scratch / "in.csv", "x,y,z,name\n1,2,3,a\n1000,2,3.50,b\n");
  const Outcome run =
      expect_run(scratch, "deform in.mha -f translate:by=4/-8/16 -o out.mha --points in.csv=out.csv --report r.json");
  EXPECT_TRUE(says(run.err, {"tetwarp: note: 1 of 2 points of in.csv lie outside"}));
  const std::string out = read_text(scratch / "out.csv");
  EXPECT_EQ(out.substr(0, out.find('\n')), "x,y,z,name,status");
  EXPECT_EQ(out.substr(out.find("1000")), "1000,2,3.50,b,outside\n");
  EXPECT_NE(out.find(",a,moved\n"), std::string::npos);
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(out.c_str() + out.find('\n'), "%lf,%lf,%lf", &x, &y, &z), 3);
  EXPECT_LE(glm::length(glm::dvec3(x, y, z) - glm::dvec3(5, -6, 19)), 2e-3);
  const nlohmann::json expected = {
      {{"input", "in.csv"}, {"output", "out.csv"}, {"points", 2}, {"outside", 1}, {"frame", "LPS"}}};
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "out.mha.json"))["points"], expected);
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "r.json"))["points"], expected);
  expect_run(scratch, "deform in.mha -f identity -o plain.mha");
  EXPECT_FALSE(nlohmann::json::parse(read_text(scratch / "plain.mha.json")).contains("points"));
}

/// The same points, in files of every format and frame, go to the same places.
TEST(DeformPoints, AllFormsAndFramesAgree) {
  const Scratch scratch;
  write_spot(scratch / "in.mha", grid_of_samples(), {0, 0, 0});
  write_file(scratch / "in.csv", sample_csv());
  std::string options = " --points in.csv=out-in.csv", ras_csv = "x,y,z\n";
  for (const PointForm& form : point_forms()) {
    write_file(scratch / form.name, form.lps);
    options += " --points " + form.name + "=out-" + form.name;
  }
  for (const glm::dvec3& point : sample_points()) {
    ras_csv += std::to_string(-point.x) + "," + std::to_string(-point.y) + "," + std::to_string(point.z) + "\n";
  }
  write_file(scratch / "ras.csv", ras_csv);
  options += " --points ras.csv=out-ras.csv:ras";
  expect_run(scratch,
             "deform in.mha -f wave:amplitude=6,wavelength=90,phase=70,axis=y,along=x -f twist:angle=40 --cell-size 2 "
             "-o out.mha" +
                 options);
  const PointsFile expected(scratch / "out-in.csv");
  EXPECT_GE(glm::length(expected.points()[1] - sample_points()[1]), 0.5);
  const auto compare = [&](const PointsFile& found, const std::string& name) {
    for (std::size_t n = 0; n < 3; ++n) EXPECT_LE(glm::length(found.points()[n] - expected.points()[n]), 1e-5) << name;
  };
  for (const PointForm& form : point_forms()) compare(PointsFile(scratch / ("out-" + form.name)), form.name);
  compare(PointsFile(scratch / "out-ras.csv", PointFrame::ras), "ras.csv");
  const auto points = nlohmann::json::parse(read_text(scratch / "out.mha.json"))["points"];
  ASSERT_EQ(points.size(), point_forms().size() + 2);
  EXPECT_EQ(points.back()["frame"], "RAS");
}

TEST(DeformPoints, AnyNumberOfThreadsWritesTheSameBytes) {
  const Scratch scratch;
  write_spot(scratch / "in.mha", grid_of_samples(), {0, 0, 0});
  write_file(scratch / "in.stl", sample_binary_stl("SPACE=RAS"));
  expect_run(scratch, "deform in.mha -f twist:angle=40 -o a.mha --points in.stl=a.stl --threads 1");
  expect_run(scratch, "deform in.mha -f twist:angle=40 -o b.mha --points in.stl=b.stl --threads 2");
  EXPECT_EQ(read_text(scratch / "a.stl"), read_text(scratch / "b.stl"));
  EXPECT_NE(read_text(scratch / "a.stl"), sample_binary_stl("SPACE=RAS"));
}

TEST(DeformPoints, AFrameThatIsNotSaidIsNoted) {
  const Scratch scratch;
  write_spot(scratch / "in.mha", grid_of_samples(), {0, 0, 0});
  write_file(scratch / "in.stl", sample_binary_stl(""));
  write_file(scratch / "in.csv", sample_csv());
  const std::string command = "deform in.mha -f identity -o out.mha --overwrite --points ";
  EXPECT_TRUE(says(expect_run(scratch, command + "in.stl=out.stl").err, {"note: in.stl does not say its frame"}));
  for (const std::string said : {"in.stl=out.stl:lps", "in.stl=out.stl:ras", "in.csv=out.csv"})
    EXPECT_EQ(expect_run(scratch, command + said).err.find("frame"), std::string::npos) << said;
}

TEST(DeformPoints, WhatCannotBeDoneIsRefusedAndNothingIsWritten) {
  const Scratch scratch;
  write_spot(scratch / "in.mha", grid_of_samples(), {0, 0, 0});
  write_file(scratch / "in.csv", sample_csv());
  write_file(scratch / "broken.csv", "x,y,z\n1,2,three\n");
  write_file(scratch / "in.obj", sample_obj("SPACE=RAS"));
  write_file(scratch / "there.csv", "");
  expect_run(scratch, "field identity --like in.mha -o forward.mha --quiet");
  const struct {
    const char* arguments;
    int status;
    std::vector<std::string> words;
  } kCases[] = {
      {"-f identity --points in.csv", 2, {"in.csv", "IN=OUT"}},
      {"-f identity --points =out.csv", 2, {"IN=OUT"}},
      {"-f identity --points in.csv=out.vtk", 2, {".csv", "out.vtk"}},
      {"-f identity --points in.csv=", 2, {".csv"}},
      {"-f identity --points in.csv=out.csv:rsa", 2, {"out.csv:rsa"}},
      {"-f identity --points in.mha=out2.mha", 2, {"in.mha", ".mrk.json"}},
      {"-f identity --points in.csv=in.csv --overwrite", 2, {"in.csv", "input"}},
      {"-f identity --points in.csv=a.csv --points in.csv=a.csv", 2, {"two outputs", "a.csv"}},
      {"-f identity --points in.csv=there.csv", 1, {"there.csv"}},
      {"-f identity --points in.csv=no/such/out.csv", 1, {"out.csv"}},
      {"--pull-field forward.mha --points in.csv=out.csv", 2, {"--points", "--pull-field"}},
      {"-f identity --points missing.csv=out.csv", 4, {"missing.csv"}},
      {"-f identity --points broken.csv=out.csv", 4, {"broken.csv", "line 2", "three"}},
      {"-f identity --points broken.csv=out.csv --dry-run", 4, {"broken.csv", "line 2"}},
      {"-f identity --points in.obj=out.obj:lps", 4, {"in.obj", "RAS", "LPS"}},
  };
  for (const auto& test : kCases) {
    SCOPED_TRACE(test.arguments);
    const Outcome run = run_tetwarp(scratch.path(), std::string("deform in.mha -o out.mha ") + test.arguments);
    EXPECT_EQ(run.status, test.status) << run.err;
    EXPECT_TRUE(says(run.err, test.words));
    EXPECT_EQ(run.err.rfind("tetwarp: error: ", 0), 0u) << run.err;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(name.rfind("out", 0) != 0 && name.rfind(".tetwarp", 0) != 0 && name != "a.csv") << name;
    }
  }
  EXPECT_EQ(read_text(scratch / "in.csv"), sample_csv());
  EXPECT_EQ(read_text(scratch / "there.csv"), "");
}

}  // namespace
