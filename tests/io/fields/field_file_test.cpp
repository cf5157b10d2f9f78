// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/field_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <map>

#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::vector<std::string> kNames = {"f.mha", "f.nrrd", "f.nii", "f.nii.gz"};

/// At rest, but for one corner that says which component is which and where i, j, k lead.
VertexField asymmetric_field(const Geometry& grid) {
  VertexField field{grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(0))};
  field.displacement[static_cast<std::size_t>(3 + grid.size.x * (1 + grid.size.y * 2))] = {3, 5, 7};
  field.displacement[1] = {-0.0f, 1e-42f, 0.1f};
  field.displacement[2] = {1e-30f, -3.4e38f, 1.0f / 3};
  return field;
}

bool same_bits(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(glm::vec3)) == 0;
}

TEST(FieldFile, SameBitsAndPlaceComeBackInAll48Orientations) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    for (const Geometry& grid : all_orientations()) {
      const VertexField field = asymmetric_field(grid);
      write_field_file(scratch / name, field);
      const VertexField back = read_forward_field(scratch / name);
      EXPECT_TRUE(same_bits(back.displacement, field.displacement)) << name << " " << orientation_code(grid);
      EXPECT_TRUE(same_grid(back.lattice, grid, name.find("nii") != std::string::npos ? 2e-5 : 0)) << name;
    }
  }
}

TEST(FieldFile, DirectionIsStatedAndTheOtherOneIsRefused) {
  const Scratch scratch;
  const VertexField forward = asymmetric_field(all_orientations()[5]);
  const PullField pull{forward.lattice, forward.displacement};
  for (const std::string& name : kNames) {
    write_field_file(scratch / name, forward);
    EXPECT_EQ(read_field_file(scratch / name).direction, Direction::forward) << name;
    EXPECT_EQ(read_field_header(scratch / name).direction, Direction::forward) << name;
    const std::string text = refusal([&] { read_pull_field(scratch / name); });
    EXPECT_NE(text.find("InputError: a forward field where a pull field is expected, " + (scratch / name).string()),
              std::string::npos)
        << text;
    write_field_file(scratch / name, pull);
    EXPECT_EQ(read_field_file(scratch / name).direction, Direction::pull) << name;
    EXPECT_TRUE(same_bits(read_pull_field(scratch / name).displacement, pull.displacement)) << name;
    EXPECT_NE(
        refusal([&] { read_forward_field(scratch / name); }).find("a pull field where a forward field is expected"),
        std::string::npos);
  }
}

TEST(FieldFile, UnstatedDirectionIsTakenEitherWay) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    const AnyVolume vectors = numbered(all_orientations()[7], VoxelType::f32, 3);
    write_image(scratch / name, vectors.view());
    EXPECT_EQ(read_field_file(scratch / name).direction, std::nullopt) << name;
    EXPECT_EQ(read_forward_field(scratch / name).displacement[1].x, read_pull_field(scratch / name).displacement[1].x);
  }
  write_image(scratch / "g.nrrd", numbered(all_orientations()[7], VoxelType::f32, 3).view(),
              {-1, {{"tetwarp_direction", "sideways"}}});
  EXPECT_NE(refusal([&] { read_field_file(scratch / "g.nrrd"); }).find("the direction \"sideways\""),
            std::string::npos);
}

TEST(FieldFile, TheDirectionThatSlicerStatesIsTaken) {
  const Scratch scratch;
  const AnyVolume vectors = numbered(all_orientations()[7], VoxelType::f32, 3);
  const auto write = [&](std::map<std::string, std::string> keys) {
    write_image(scratch / "g.nrrd", vectors.view(), {-1, std::move(keys)});
    return scratch / "g.nrrd";
  };
  const std::string key = "displacement field type";
  EXPECT_EQ(read_field_file(write({{key, "resampling"}})).direction, Direction::pull);
  EXPECT_NE(refusal([&] { read_forward_field(scratch / "g.nrrd"); }).find("a pull field where a forward field"),
            std::string::npos);
  EXPECT_EQ(read_field_file(write({{key, "modeling"}})).direction, Direction::forward);
  EXPECT_EQ(read_field_header(scratch / "g.nrrd").units_basis, FieldBasis::assumed);
  write({{key, "other"}});
  EXPECT_NE(refusal([&] { read_field_file(scratch / "g.nrrd"); }).find("expected resampling or modeling"),
            std::string::npos);
  write({{key, "modeling"}, {"tetwarp_direction", "pull"}});
  EXPECT_NE(refusal([&] { read_field_file(scratch / "g.nrrd"); }).find("contradict each other"), std::string::npos);
  // What Tetwarp writes says so as well.
  write_field_file(scratch / "own.nrrd", asymmetric_field(all_orientations()[0]));
  std::ifstream own(scratch / "own.nrrd", std::ios::binary);
  std::string text(4096, '\0');
  own.read(text.data(), static_cast<std::streamsize>(text.size()));
  EXPECT_NE(text.find(key + ":=modeling\n"), std::string::npos);
  EXPECT_EQ(read_field_file(scratch / "own.nrrd").direction, Direction::forward);
}

TEST(FieldFile, FirstVertexThatIsNotFiniteIsNamed) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    for (const float bad : {NAN, INFINITY, -INFINITY}) {
      VertexField field = asymmetric_field(all_orientations()[0]);
      field.displacement[2 + 4 * (1 + 3 * 3)].z = bad;
      field.displacement[59].x = bad;
      write_field_file(scratch / name, field);
      const std::string text = refusal([&] { read_field_file(scratch / name); });
      EXPECT_NE(text.find("at vertex (2, 1, 3), " + (scratch / name).string()), std::string::npos)
          << name << ": " << text;
    }
  }
}

TEST(FieldFile, OnlyPullFieldsHaveGaps) {
  const Scratch scratch;
  VertexField forward = asymmetric_field(all_orientations()[0]);
  forward.displacement[7] = glm::vec3(NAN);
  PullField pull{forward.lattice, forward.displacement};
  for (const std::string& name : kNames) {
    write_field_file(scratch / name, forward);
    EXPECT_NE(refusal([&] { read_forward_field(scratch / name); }).find("at vertex (3, 1, 0)"), std::string::npos);
    write_field_file(scratch / name, pull);
    for (const glm::vec3& mm :
         {read_pull_field(scratch / name).displacement[7], read_field_file(scratch / name).displacement[7]})
      EXPECT_TRUE(std::isnan(mm.x) && std::isnan(mm.y) && std::isnan(mm.z)) << name;
    PullField infinite = pull;
    infinite.displacement[9].y = -INFINITY;
    write_field_file(scratch / name, infinite);
    EXPECT_NE(refusal([&] { read_pull_field(scratch / name); }).find("at vertex (1, 2, 0)"), std::string::npos) << name;
  }
}

TEST(FieldFile, DoublesAreRoundedToFloat) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    AnyVolume vectors(oblique_grid(), VoxelType::f64, 3);
    for (std::size_t i = 0; i < vectors.as<double>().size(); ++i)
      vectors.as<double>()[i] = 0.1 * static_cast<double>(i);
    write_image(scratch / name, vectors.view());
    const FieldFile field = read_field_file(scratch / name);
    EXPECT_EQ(field.displacement[7], glm::vec3(2.1f, 2.2f, static_cast<float>(0.1 * 23))) << name;
    vectors.as<double>()[4] = 1e300;
    write_image(scratch / name, vectors.view());
    EXPECT_NE(refusal([&] { read_field_file(scratch / name); }).find("at vertex (1, 0, 0)"), std::string::npos) << name;
  }
}

TEST(FieldFile, ImagesAreNotFields) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    write_image(scratch / name, numbered(oblique_grid(), VoxelType::f32).view());
    EXPECT_FALSE(is_field_file(scratch / name)) << name;
    EXPECT_NE(refusal([&] {
                read_field_header(scratch / name);
              }).find("1 x float32 a voxel; expected 3 x float32 or float64"),
              std::string::npos);
    write_image(scratch / name, numbered(oblique_grid(), VoxelType::i16, 3).view());
    EXPECT_NE(refusal([&] { read_field_file(scratch / name); }).find("3 x int16 a voxel"), std::string::npos) << name;
    write_field_file(scratch / name, asymmetric_field(oblique_grid()));
    EXPECT_TRUE(is_field_file(scratch / name)) << name;
  }
  EXPECT_FALSE(is_field_file(scratch / "f.txt"));
}

TEST(FieldFile, VectorsInAnotherFrameAreRefused) {
  const Scratch scratch;
  write_field_file(scratch / "f.nrrd", asymmetric_field(all_orientations()[0]));
  const std::string bytes = read_bytes(scratch / "f.nrrd");
  std::string ras = bytes, turned = bytes;
  write_file(scratch / "f.nrrd", ras.replace(ras.find("left-posterior-superior"), 23, "right-anterior-superior"));
  EXPECT_NE(
      refusal([&] { read_field_file(scratch / "f.nrrd"); }).find("vectors in the space \"right-anterior-superior\""),
      std::string::npos);
  write_file(scratch / "f.nrrd",
             turned.insert(turned.find("encoding:"), "measurement frame: (-1,0,0) (0,-1,0) (0,0,1)\n"));
  EXPECT_NE(refusal([&] { read_field_file(scratch / "f.nrrd"); }).find("measurement frame"), std::string::npos);
}

TEST(FieldFile, DisplacementsMustFitTheGrid) {
  const Scratch scratch;
  VertexField field = asymmetric_field(oblique_grid());
  field.displacement.pop_back();
  EXPECT_NE(
      refusal([&] { write_field_file(scratch / "f.mha", field); }).find("59 displacements for 4 x 3 x 5 vertices"),
      std::string::npos);
}

TEST(FieldFile, RealPullFieldHasTheStatedDisplacements) {
  TETWARP_REAL_DATA(folder, "lung-4dct-t0-t5");
  const PullField field = read_pull_field(folder / "dvf_t5_to_t0_4mm.mha");
  EXPECT_EQ(field.grid.size, glm::i64vec3(128, 128, 64));
  EXPECT_EQ(field.grid.spacing, glm::dvec3(3.90624, 3.90624, 5));
  EXPECT_EQ(field.grid.origin, glm::dvec3(-249.512, -249.512, -167.5));
  double largest = 0, sum = 0;
  for (const glm::vec3& d : field.displacement) {
    const double length = std::sqrt(static_cast<double>(d.x * d.x + d.y * d.y + d.z * d.z));
    largest = std::max(largest, length);
    sum += length;
  }
  EXPECT_NEAR(largest, 22.83, 0.005);
  EXPECT_NEAR(sum / static_cast<double>(field.displacement.size()), 1.333, 0.0005);
}

}  // namespace
}  // namespace tetwarp
