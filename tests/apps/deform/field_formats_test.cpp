// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// One field, stored as other tools store it: the same deformed volume, and what `info` and the report say of the file.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <tuple>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/foreign_field.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

/// The grid of a field that is turned against the phantom's: i runs down along z, j to the right, k to the back. All of
/// its numbers are exact in float.
Geometry turned_grid() {
  Geometry grid;
  grid.size = {4, 3, 5};
  grid.spacing = {16, 20, 12};
  grid.origin = {20, -30, 24};
  grid.direction = glm::dmat3(0, 0, -1, -1, 0, 0, 0, 1, 0);
  return grid;
}

void make_phantom_file(const Scratch& scratch, const std::string& name) {
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o " + name).status, 0);
}

/// The voxels that a deformation by the field (an option and a text) leaves.
std::string deformed(const Scratch& scratch, const std::string& field) {
  const Outcome run = run_tetwarp(
      scratch.path(), "deform in.mha " + field + " --outside rest -o out.mha --report out.json --overwrite");
  EXPECT_EQ(run.status, 0) << field << "\n" << run.err;
  return run.status == 0 ? read_text(scratch / "out.mha") : "";
}

TEST(FieldFormats, EveryFileOfOneFieldDeformsAlikeInBothDirections) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  const VertexField forward{turned_grid(), corner_displacement(turned_grid())};
  write_field_file(scratch / "forward.mha", forward);
  write_field_file(scratch / "pull.mha", PullField{forward.lattice, forward.displacement});
  const std::string pushed = deformed(scratch, "-f forward.mha"), pulled = deformed(scratch, "--pull-field pull.mha"),
                    rest = deformed(scratch, "-f identity");
  EXPECT_TRUE(pushed != rest);
  EXPECT_TRUE(pulled != rest);
  EXPECT_TRUE(pulled != pushed);
  for (const std::string own : {"own.nrrd", "own.nii", "own.nii.gz"}) {
    write_field_file(scratch / own, forward);
    EXPECT_TRUE(deformed(scratch, "-f " + own) == pushed) << own;
    write_field_file(scratch / own, PullField{forward.lattice, forward.displacement});
    EXPECT_TRUE(deformed(scratch, "--pull-field " + own) == pulled) << own;
  }
  for (const std::string kind : {"1006", "1007", "nreg-0", "nreg-1"}) {
    if (!make_foreign_field(kind, scratch / "pull.mha", scratch / "f.nii.gz")) GTEST_SKIP() << "python3-nibabel";
    EXPECT_TRUE(deformed(scratch, "--pull-field f.nii.gz") == pulled) << kind;
    const auto files = nlohmann::json::parse(read_text(scratch / "out.json"))["field"]["files"];
    ASSERT_EQ(files.size(), 1U);
    EXPECT_EQ(files[0]["path"], "f.nii.gz");
    EXPECT_EQ(files[0]["frame"], kind == "1007" ? "LPS" : "RAS");
    EXPECT_EQ(files[0]["absolute"], kind == "nreg-0");
    if (kind.starts_with("nreg")) {
      const Outcome run = run_tetwarp(scratch.path(), "deform in.mha -f f.nii.gz --outside rest -o no.mha");
      EXPECT_EQ(run.status, 4);
      EXPECT_NE(run.err.find("a pull field where a forward field is expected"), std::string::npos) << run.err;
    } else {
      EXPECT_TRUE(deformed(scratch, "-f f.nii.gz") == pushed) << kind;
    }
  }
}

TEST(FieldFormats, ADeformableRegistrationOfDicomPullsAndOnlyPulls) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  write_field_file(scratch / "pull.mha", PullField{turned_grid(), corner_displacement(turned_grid())});
  const std::string pulled = deformed(scratch, "--pull-field pull.mha");
  for (const std::string kind : {"dsr:explicit", "dsr:big", "dsr:explicit:matrices"}) {
    if (!make_foreign_field(kind, scratch / "pull.mha", scratch / "f.dcm")) GTEST_SKIP() << "python3-pydicom";
    const std::string found = deformed(scratch, "--pull-field f.dcm");
    if (kind != "dsr:explicit:matrices") {
      EXPECT_TRUE(found == pulled) << kind;
    } else {
      EXPECT_EQ(found.size(), pulled.size());  // displacements differ by 1e-5 mm
    }
    EXPECT_TRUE(deformed(scratch, "--pull-field f.dcm:item=1") == found) << kind;
    const auto file = nlohmann::json::parse(read_text(scratch / "out.json"))["field"]["files"][0];
    EXPECT_EQ(file["path"], "f.dcm");
    EXPECT_EQ(file["direction"], "pull");
    EXPECT_EQ(file["known"]["direction"], "by the format");
  }
  const std::string info = run_tetwarp(scratch.path(), "info f.dcm").out;
  EXPECT_NE(info.find("f.dcm: field\n  format       DICOM Deformable Spatial Registration, with its matrices\n"),
            std::string::npos)
      << info;
  EXPECT_NE(info.find("size         4 x 3 x 5"), std::string::npos) << info;
  for (const auto& [option, status, why] : {std::tuple("-f f.dcm", 4, "a pull field where a forward field is expected"),
                                            {"--pull-field f.dcm:item=2", 4, "no item 2 with a grid"},
                                            {"--pull-field f.dcm:item=two", 2, "expected a whole number from 1"},
                                            {"--pull-field f.dcm:part=1", 2, "expected item"}}) {
    const Outcome run =
        run_tetwarp(scratch.path(), std::string("deform in.mha ") + option + " --outside rest -o no.mha");
    EXPECT_EQ(run.status, status) << run.err;
    EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(scratch / "no.mha"));
  }
}

/// The largest difference of the voxels of two volumes.
int largest_difference(const std::filesystem::path& a, const std::filesystem::path& b) {
  const AnyVolume one = read_image(a), other = read_image(b);
  EXPECT_EQ(one.size_bytes(), other.size_bytes());
  int largest = 0;
  for (std::size_t n = 0; n < one.as<std::int16_t>().size(); ++n)
    largest = std::max(largest, std::abs(one.as<std::int16_t>()[n] - other.as<std::int16_t>()[n]));
  return largest;
}

TEST(FieldFormats, ASplineOfNiftyRegIsATransformOnItsImageAndOnOtherGrids) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  const Geometry grid = read_image_header(scratch / "in.mha").geometry;
  write_field_file(scratch / "pull.mha", PullField{grid, corner_displacement(grid)});
  for (const std::string kind : {"spline:corner", "spline:random"}) {
    if (!make_foreign_field(kind, scratch / "pull.mha", scratch / "cpp.nii")) GTEST_SKIP() << "python3-nibabel";
    // Dense fields of the same positions are compared, too, in float64, where the last bit of a voxel may differ.
    const auto run = [&](const std::string& arguments, const std::string& output) {
      const Outcome outcome = run_tetwarp(scratch.path(), "deform in.mha --overwrite " + arguments + " -o " + output);
      EXPECT_EQ(outcome.status, 0) << outcome.err;
      return outcome.err;
    };
    EXPECT_EQ(run("--pull-field cpp.nii", "spline.mha").find("outside"), std::string::npos);
    run("--pull-field cpp-index.nii", "dense.mha");
    EXPECT_LE(largest_difference(scratch / "spline.mha", scratch / "dense.mha"), 1) << kind;
    run("-f identity", "rest.mha");
    EXPECT_GT(largest_difference(scratch / "spline.mha", scratch / "rest.mha"), kind == "spline:random" ? 100 : 0)
        << kind;

    const Geometry other = read_field_header(scratch / "cpp-world.nii").grid;
    write_image(scratch / "other.mha", AnyVolume(other, VoxelType::i16).view());
    EXPECT_NE(run("--pull-field cpp.nii --grid other.mha", "spline.mha")
                  .find("voxels lie outside its domain, where its outermost control points go on"),
              std::string::npos);
    run("--pull-field cpp-world.nii --grid other.mha", "dense.mha");
    EXPECT_LE(largest_difference(scratch / "spline.mha", scratch / "dense.mha"), 1) << kind;
  }
  const Outcome forward = run_tetwarp(scratch.path(), "field cpp.nii --like in.mha -o f.mha");
  ASSERT_EQ(forward.status, 0) << forward.err;
  EXPECT_NE(forward.err.find("transforms of NiftyReg map output to input; taken as forward"), std::string::npos);
  const std::vector<glm::vec3> vertices = read_forward_field(scratch / "f.mha").displacement,
                               dense = read_pull_field(scratch / "cpp-index.nii").displacement;
  ASSERT_EQ(vertices.size(), dense.size());
  for (std::size_t v = 0; v < dense.size(); ++v) ASSERT_LT(glm::distance(vertices[v], dense[v]), 1e-4) << v;
  const std::string info = run_tetwarp(scratch.path(), "info cpp.nii").out;
  EXPECT_NE(info.find("cpp.nii: transform\n  written by   NiftyReg\n  class        cubic B-spline of "),
            std::string::npos)
      << info;
  EXPECT_NE(info.find("direction    output to input (pull)"), std::string::npos) << info;
}

/// Beyond the grid of the first of several fields the others are not applied.
TEST(FieldFormats, PointsDoNotRestWhereALaterPullFieldMovesThem) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  write_field_file(scratch / "pull.mha", PullField{turned_grid(), corner_displacement(turned_grid())});
  write_file(scratch / "shift.mat", "1 0 0 9\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const auto run = [&](const std::string& fields, const std::string& outside) {
    return run_tetwarp(scratch.path(), "deform in.mha " + fields + " -o out.mha --overwrite --outside " + outside);
  };
  const std::string shift = " --pull-field shift.mat:tool=c3d";
  const Outcome rest = run("--pull-field pull.mha" + shift, "rest");
  EXPECT_EQ(rest.status, 4);
  EXPECT_NE(rest.err.find("pull.mha does not reach over the whole output"), std::string::npos) << rest.err;
  EXPECT_EQ(run("--pull-field pull.mha" + shift, "background").status, 0);
  EXPECT_EQ(run(shift + " --pull-field pull.mha", "rest").status, 0) << "the first is everywhere";
  EXPECT_EQ(run("--pull-field pull.mha", "rest").status, 0);
}

TEST(FieldFormats, AnArrayLiesOnTheVolumeOnceOrderAndUnitsAreGiven) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  const Geometry grid = read_image_header(scratch / "in.mha").geometry;
  write_field_file(scratch / "forward.mha", VertexField{grid, corner_displacement(grid)});
  write_field_file(scratch / "pull.mha", PullField{grid, corner_displacement(grid)});
  const std::string pushed = deformed(scratch, "-f forward.mha"), pulled = deformed(scratch, "--pull-field pull.mha");
  EXPECT_TRUE(pushed != pulled);
  if (!make_foreign_field("npy:<f4:zyx:C", scratch / "pull.mha", scratch / "f.npy")) GTEST_SKIP() << "python3-numpy";
  EXPECT_TRUE(deformed(scratch, "-f f.npy:order=zyx,units=mm") == pushed);
  EXPECT_TRUE(deformed(scratch, "--pull-field f.npy:order=zyx,units=mm") == pulled);
  EXPECT_TRUE(deformed(scratch, "--pull-field f.npy:order=zyx,units=mm,frame=ras") != pulled);
  const auto report = nlohmann::json::parse(read_text(scratch / "out.json"));
  EXPECT_EQ(report["field"]["files"][0]["frame"], "RAS");
  EXPECT_EQ(report["field"]["files"][0]["known"]["frame"], "by an option");

  for (const std::string option :
       {"-f f.npy", "--pull-field f.npy", "-f f.npy:order=zyx", "-f f.npy:order=zyx,units=cm",
        "--pull-field f.npy:order=zyx,units=mm,units=mm", "-f forward.mha:order=zyx"}) {
    const Outcome run = run_tetwarp(scratch.path(), "deform in.mha " + option + " -o no.mha");
    EXPECT_EQ(run.status, 2) << option << "\n" << run.err;
    EXPECT_TRUE(run.err.starts_with("tetwarp: error: ")) << run.err;
    EXPECT_FALSE(std::filesystem::exists(scratch / "no.mha"));
  }
  // A run that is only planned looks at the size too.
  const Outcome planned =
      run_tetwarp(scratch.path(), "deform in.mha --pull-field f.npy:order=xyz,units=mm --dry-run -o no.mha");
  EXPECT_EQ(planned.status, 4) << planned.err;
  EXPECT_NE(planned.err.find("with order=zyx it fits"), std::string::npos) << planned.err;
  const std::string bytes = read_text(scratch / "f.npy");
  write_file(scratch / "short.npy", bytes.substr(0, bytes.size() - 1));
  write_file(scratch / "wrong.npy", "#" + bytes.substr(1));
  for (const std::string field : {"short.npy:order=zyx,units=mm", "wrong.npy:order=zyx,units=mm",
                                  "f.npy:order=xyz,units=mm", "none.npy:order=zyx,units=mm"}) {
    const Outcome run = run_tetwarp(scratch.path(), "deform in.mha --pull-field " + field + " -o no.mha");
    EXPECT_EQ(run.status, 4) << field << "\n" << run.err;
    EXPECT_NE(run.err.find(field.substr(0, field.find(':'))), std::string::npos) << run.err;
  }
}

TEST(FieldFormats, InfoSaysWhatIsStatedAndWhatIsAssumed) {
  const Scratch scratch;
  write_field_file(scratch / "own.mha", VertexField{turned_grid(), corner_displacement(turned_grid())});
  const std::string own = run_tetwarp(scratch.path(), "info own.mha").out;
  EXPECT_NE(own.find("direction    forward (stated)"), std::string::npos) << own;
  EXPECT_NE(own.find("displacements (by the format), frame LPS (by the format), mm (by the format)"), std::string::npos)
      << own;
  if (!make_foreign_field("1007", scratch / "own.mha", scratch / "f.nii")) GTEST_SKIP() << "python3-nibabel";
  const std::string itk = run_tetwarp(scratch.path(), "info f.nii").out;
  EXPECT_NE(itk.find("direction    not stated\n"), std::string::npos) << itk;
  EXPECT_NE(itk.find("displacements (assumed), frame LPS (assumed), mm (assumed)"), std::string::npos) << itk;
  ASSERT_TRUE(make_foreign_field("nreg-0", scratch / "own.mha", scratch / "f.nii"));
  const auto niftyreg = nlohmann::json::parse(run_tetwarp(scratch.path(), "info f.nii --json").out);
  EXPECT_EQ(niftyreg["direction"], "pull");
  EXPECT_EQ(niftyreg["known"]["direction"], "by the format");
  EXPECT_EQ(niftyreg["frame"], "RAS");
  EXPECT_EQ(niftyreg["absolute"], true);
  EXPECT_EQ(niftyreg["lattice"]["size"], nlohmann::json::array({4, 3, 5}));
  ASSERT_TRUE(make_foreign_field("npy:<f4:zyx:C", scratch / "own.mha", scratch / "f.npy"));
  EXPECT_EQ(run_tetwarp(scratch.path(), "info f.npy").status, 2);
  const std::string array = run_tetwarp(scratch.path(), "info f.npy:order=zyx,units=voxel").out;
  EXPECT_NE(array.find("displacements (assumed), frame index (by an option), voxel (by an option)"), std::string::npos)
      << array;
  EXPECT_NE(array.find("size         4 x 3 x 5"), std::string::npos) << array;
  EXPECT_NE(array.find("place        that of the volume"), std::string::npos) << array;
}

}  // namespace
