// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <utility>

#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/itk_image_io.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

/// The bytes of a good file of 4 x 3 x 5 int16 voxels, straight axes, for a test to damage.
std::string good_file(const Scratch& scratch, VoxelType type = VoxelType::i16, int components = 1) {
  write_image(scratch / "good.nii", numbered(all_orientations()[0], type, components).view());
  return read_bytes(scratch / "good.nii");
}

TEST(Nifti, ItkReadsTheSameGeometryAndVoxels) {
  const Scratch scratch;
  std::vector<Geometry> grids = all_orientations();
  grids.push_back(oblique_grid());
  for (const char* name : {"x.nii", "x.nii.gz"}) {
    for (const Geometry& grid : grids) {
      const AnyVolume volume = numbered(grid, VoxelType::f32, 3);
      write_image(scratch / name, volume.view());
      const ItkImageInfo info = itk_read_info(scratch / name, ItkFormat::nifti);
      EXPECT_TRUE(same_grid(info.geometry, grid, 2e-5)) << orientation_code(grid);
      AnyVolume back(grid, info.type, info.components);
      itk_read_voxels(scratch / name, ItkFormat::nifti, {back.data(), back.size_bytes()});
      EXPECT_TRUE(same_bytes(back, volume)) << name << " " << orientation_code(grid);
      std::filesystem::remove(scratch / name);
    }
  }
}

TEST(Nifti, ReadsWhatItkWrites) {
  const Scratch scratch;
  for (const Geometry& grid : all_orientations()) {
    const AnyVolume volume = numbered(grid, VoxelType::f32, 3);
    itk_write(scratch / "x.nii.gz", ItkFormat::nifti, volume.view(), 0, {});
    const AnyVolume back = read_image(scratch / "x.nii.gz");
    EXPECT_TRUE(same_bytes(back, volume));
    EXPECT_TRUE(same_grid(back.geometry(), grid, 2e-5)) << orientation_code(grid);
  }
}

TEST(Nifti, HeaderStatesBothTransformsMillimetresAndNoScaling) {
  const Scratch scratch;
  const std::string bytes = good_file(scratch, VoxelType::f32, 3);
  EXPECT_EQ(get<std::int16_t>(bytes, 252), 1);    // qform_code
  EXPECT_EQ(get<std::int16_t>(bytes, 254), 1);    // sform_code
  EXPECT_EQ(bytes[123], 2);                       // xyzt_units: mm
  EXPECT_EQ(get<float>(bytes, 112), 1.0f);        // scl_slope
  EXPECT_EQ(get<float>(bytes, 116), 0.0f);        // scl_inter
  EXPECT_EQ(get<float>(bytes, 108), 352.0f);      // vox_offset
  EXPECT_EQ(get<std::int16_t>(bytes, 68), 1007);  // intent_code: vector
  EXPECT_EQ(get<float>(bytes, 280), -1.95312f);   // srow_x[0]: RAS
  EXPECT_EQ(get<float>(bytes, 292), 228.8f);      // srow_x[3]
  EXPECT_EQ(bytes.size(), 352u + 4 * 3 * 5 * 3 * 4);
}

TEST(Nifti, VoxelsComeFromTheFileAskedForWhereBothSuffixesLieSideBySide) {
  const Scratch scratch;
  const AnyVolume a = numbered(all_orientations()[0], VoxelType::i16),
                  b = numbered(all_orientations()[47], VoxelType::f64);
  write_image(scratch / "x.nii", a.view());
  write_image(scratch / "x.nii.gz", b.view());
  EXPECT_TRUE(same_bytes(read_image(scratch / "x.nii"), a));
  EXPECT_TRUE(same_bytes(read_image(scratch / "x.nii.gz"), b));
  EXPECT_EQ(orientation_code(read_image_header(scratch / "x.nii").geometry), "LPS");
  EXPECT_EQ(orientation_code(read_image_header(scratch / "x.nii.gz").geometry), "IAR");
}

TEST(Nifti, WhatCannotBeReadExactlyIsRefusedByName) {
  const Scratch scratch;
  const auto refused = [&](std::string bytes, const char* why) {
    for (const char* name : {"x.nii", "x.nii.gz"}) {
      if (std::string(name) == "x.nii")
        write_file(scratch / name, bytes);
      else
        write_gzipped(scratch / name, bytes);
      const std::string text = refusal([&] { read_image(scratch / name); });
      EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << why << " | " << text;
      EXPECT_NE(text.find((scratch / name).string()), std::string::npos) << text;
      std::filesystem::remove(scratch / name);
    }
  };
  const std::string good = good_file(scratch), vectors = good_file(scratch, VoxelType::f32, 3);
  const auto with = [](std::string bytes, auto... pairs) {
    (put(bytes, pairs.first, pairs.second), ...);
    return bytes;
  };
  using I16 = std::pair<std::size_t, std::int16_t>;
  using F32 = std::pair<std::size_t, float>;
  refused(with(good, I16(68, 1006)), "DISPVECT");
  refused(with(good, I16(68, 2006)), "a field or coefficients of FSL (intent code 2006)");
  refused(with(vectors, I16(68, 0)), "3 values a voxel with intent code 0");
  refused(with(good, I16(70, 1024)), "voxels of int64");
  refused(with(good, I16(70, 128)), "voxels of RGB24");
  refused(with(good, I16(70, 32)), "voxels of complex64");
  refused(with(good, I16(40, 4), I16(48, 2)), "2 time points");
  refused(with(good, I16(40, 2)), "an image of 2 axes");
  refused(with(good, I16(42, -4)), "expected at least 1 on every axis");
  refused(with(good, I16(42, 32767), I16(44, 32767)), "promises too much");
  refused(with(good, I16(252, 0), I16(254, 0)), "no orientation");
  refused(with(good, F32(280 + 4, 0.05f)), "a sheared or singular sform");
  refused(with(good, F32(280, 0.0f)), "a sheared or singular sform");
  for (const std::size_t at : {256, 272, 280, 292}) {  // quatern_b, qoffset_y, srow_x[0], srow_x[3]
    for (const float bad : {NAN, INFINITY, -INFINITY, 2.9e38F}) refused(with(good, F32(at, bad)), "that is not finite");
    if (at == 256) refused(with(good, F32(at, 1.2F)), "no rotation");
  }
  refused(with(good, F32(80, 0.9f)), "by pixdim");
  refused(with(good, std::pair<std::size_t, char>(123, 1)), "lengths in metres");
  refused(with(good, std::pair<std::size_t, char>(345, 'i')), "NIfTI-1 in one file");
  refused(with(good, std::pair<std::size_t, std::int32_t>(0, 540)), "a NIfTI-2 file");
  refused(with(good, F32(108, 0.0f)), "vox_offset");
  for (const float slope : {1.0F, 2.0F}) refused(with(good, F32(112, slope), F32(116, NAN)), "scl_inter");
  refused(good.substr(0, 300), "a NIfTI-1 header has 348");
  write_gzipped(scratch / "x.nii", good);
  EXPECT_NE(refusal([&] { read_image(scratch / "x.nii"); }).find("name it .nii.gz"), std::string::npos);
}

TEST(Nifti, OneTimePointAndEitherTransformAloneAreRead) {
  const Scratch scratch;
  const AnyVolume volume = numbered(all_orientations()[0], VoxelType::i16);
  std::string bytes = good_file(scratch);
  put(bytes, 40, std::int16_t{4});
  put(bytes, 48, std::int16_t{1});
  for (const std::size_t code : {252, 254}) {
    std::string alone = bytes;
    put(alone, code, std::int16_t{0});
    write_file(scratch / "x.nii", alone);
    EXPECT_TRUE(same_bytes(read_image(scratch / "x.nii"), volume));
    EXPECT_TRUE(same_grid(read_image_header(scratch / "x.nii").geometry, volume.geometry(), 2e-5)) << code;
  }
}

TEST(Nifti, ScaledVoxelsBecomeFloatAndSaySo) {
  const Scratch scratch;
  std::string bytes = good_file(scratch);
  put(bytes, 112, 2.0f);
  put(bytes, 116, -1024.0f);
  write_file(scratch / "x.nii", bytes);
  const AnyVolume plain = read_image(scratch / "good.nii"), scaled = read_image(scratch / "x.nii");
  ASSERT_EQ(scaled.type(), VoxelType::f32);
  for (std::size_t i = 0; i < plain.as<std::int16_t>().size(); ++i) {
    EXPECT_EQ(scaled.as<float>()[i], 2.0f * plain.as<std::int16_t>()[i] - 1024.0f);
  }
  EXPECT_NE(read_image_header(scratch / "x.nii").metadata.at("scaled").find("float32 from int16"), std::string::npos);
  put(bytes, 112, NAN);  // what nibabel leaves where nothing is scaled
  write_file(scratch / "x.nii", bytes);
  EXPECT_TRUE(same_bytes(read_image(scratch / "x.nii"), plain));
}

TEST(Nifti, BigEndianFilesAreRead) {
  const Scratch scratch;
  std::string bytes = good_file(scratch, VoxelType::f32, 3);
  const auto swap = [&](std::size_t begin, std::size_t end, std::size_t width) {
    for (std::size_t at = begin; at < end; at += width) std::reverse(bytes.begin() + at, bytes.begin() + at + width);
  };
  swap(0, 4, 4);      // sizeof_hdr
  swap(40, 56, 2);    // dim
  swap(56, 68, 4);    // intent_p
  swap(68, 76, 2);    // intent_code to slice_start
  swap(76, 120, 4);   // pixdim to scl_inter
  swap(120, 122, 2);  // slice_end
  swap(252, 256, 2);  // qform_code, sform_code
  swap(256, 328, 4);  // quaternion to srow_z
  swap(352, bytes.size(), 4);
  write_file(scratch / "x.nii", bytes);
  EXPECT_TRUE(same_bytes(read_image(scratch / "x.nii"), read_image(scratch / "good.nii")));
  EXPECT_EQ(read_image_header(scratch / "x.nii").geometry, read_image_header(scratch / "good.nii").geometry);
}

TEST(Nifti, LeavesNothingBesideTheOutputAndRefusesWhatItCannotHold) {
  const Scratch scratch;
  Geometry grid = all_orientations()[0];
  write_image(scratch / "x.nii.gz", numbered(grid, VoxelType::u8).view());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
  EXPECT_NE(
      refusal([&] {
        write_image(scratch / "y.nii", numbered(grid, VoxelType::u8).view(), {-1, {{"descrip", std::string(80, 'x')}}});
      }).find("NIfTI holds 79"),
      std::string::npos);
  grid.size = {40000, 1, 1};
  EXPECT_NE(refusal([&] { write_image(scratch / "y.nii", numbered(grid, VoxelType::u8).view()); }).find("up to 32767"),
            std::string::npos);
}

}  // namespace
}  // namespace tetwarp
