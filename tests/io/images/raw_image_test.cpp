// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/raw_image.h"

#include <gtest/gtest.h>

#include "io/images/image_writer.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

constexpr ImageFormat kFormats[] = {ImageFormat::mha, ImageFormat::nrrd};
const char* name_of(ImageFormat format) { return format == ImageFormat::mha ? "x.mha" : "x.nrrd"; }

void write_raw(const std::filesystem::path& path, ImageFormat format, const AnyVolume& volume,
               const std::map<std::string, std::string>& metadata) {
  const Geometry& grid = volume.geometry();
  const auto header = raw_image_header(format, grid, volume.type(), volume.components(), metadata);
  const auto writer = create_text_image(path, format, grid, volume.type(), volume.components(), header, 0);
  writer->write(volume.view());
  writer->finish();
}

AnyVolume read_raw(const std::filesystem::path& path, ImageFormat format) {
  const auto reader = open_raw_image(path, format);
  const ImageHeader& header = reader->header();
  AnyVolume volume(header.geometry, header.type, header.components);
  reader->read({volume.data(), volume.size_bytes()});
  return volume;
}

TEST(RawImage, GeometryVoxelsAndMetadataComeBack) {
  const Scratch scratch;
  for (const ImageFormat format : kFormats) {
    int type = 0;
    for (const Geometry& grid : all_orientations()) {
      const AnyVolume volume = numbered(grid, static_cast<VoxelType>(type % 8), type % 5 == 0 ? 3 : 1);
      ++type;
      write_raw(scratch / name_of(format), format, volume, {{"tetwarp_direction", "pull"}});
      const AnyVolume back = read_raw(scratch / name_of(format), format);
      EXPECT_TRUE(same_bytes(back, volume)) << name_of(format) << to_string(volume.type());
      EXPECT_EQ(back.geometry(), grid) << name_of(format) << " " << orientation_code(grid);
      EXPECT_EQ(open_raw_image(scratch / name_of(format), format)->header().metadata.at("tetwarp_direction"), "pull");
    }
  }
}

TEST(RawImage, AgreesWithTheOtherReaderAndWriter) {
  const Scratch scratch;
  for (const ImageFormat format : kFormats) {
    for (const Geometry& grid : {all_orientations()[0], all_orientations()[29], oblique_grid()}) {
      for (const int level : {0, 6}) {
#ifndef TETWARP_WITH_ITK
        if (level > 0) continue;
#endif
        if (level > 0 && format == ImageFormat::nrrd) continue;  // gzip in NRRD is for ITK
        const AnyVolume volume = numbered(grid, VoxelType::i16);
        write_image(scratch / name_of(format), volume.view(), {level, {{"key", "value"}}});
        const AnyVolume raw = read_raw(scratch / name_of(format), format);
        EXPECT_TRUE(same_bytes(raw, volume));
        EXPECT_TRUE(same_grid(raw.geometry(), grid, 1e-12));
        EXPECT_EQ(open_raw_image(scratch / name_of(format), format)->header().metadata.at("key"), "value");
      }
      const AnyVolume volume = numbered(grid, VoxelType::f64, 3);
      write_raw(scratch / name_of(format), format, volume, {});
      const AnyVolume back = read_image(scratch / name_of(format));
      EXPECT_TRUE(same_bytes(back, volume));
      EXPECT_TRUE(same_grid(back.geometry(), grid, 1e-12));
    }
  }
}

#ifdef TETWARP_WITH_ITK
TEST(RawImage, CompressedMhaMustHoldExactlyWhatItsHeaderSays) {
  const Scratch scratch;
  for (const char* size : {"DimSize = 4 3 4", "DimSize = 4 3 6"}) {
    write_image(scratch / "x.mha", numbered(all_orientations()[0], VoxelType::i16).view(), {6, {}});
    std::string bytes = read_bytes(scratch / "x.mha");
    write_file(scratch / "x.mha", bytes.replace(bytes.find("DimSize = 4 3 5"), 15, size));
    EXPECT_TRUE(refusal([&] { read_image(scratch / "x.mha"); }).starts_with("InputError: ")) << size;
  }
}
#endif

TEST(RawImage, WhatIsNotPlainIsRefusedByName) {
  const Scratch scratch;
  const auto refused = [&](ImageFormat format, const std::string& from, const std::string& to, const char* why) {
    const auto path = scratch / name_of(format);
    write_raw(path, format, numbered(all_orientations()[0], VoxelType::i16), {});
    std::string bytes = read_bytes(path);
    const auto at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file(path, bytes.replace(at, from.size(), to));
    const std::string text = refusal([&] { read_raw(path, format); });
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << why << " | " << text;
  };
  refused(ImageFormat::mha, "NDims = 3", "NDims = 4", "ndims");
  refused(ImageFormat::mha, "MSB = False", "MSB = True", "binarydatabyteordermsb");
  refused(ImageFormat::mha, "MET_SHORT", "MET_LONG_LONG", "MET_LONG_LONG");
  refused(ImageFormat::mha, "DimSize = 4", "DimSize = four", "\"four\"");
  refused(ImageFormat::mha, "DimSize = 4 ", "DimSize = ", "2 numbers");
  refused(ImageFormat::mha, "DimSize = 4", "DimSize = -4", "expected a positive whole number");
  refused(ImageFormat::mha, "CompressedData = False", "CompressedData = True", "truncated or damaged");
  refused(ImageFormat::mha, "BinaryData = True", "BinaryData = False", "compressed or text");
  refused(ImageFormat::nrrd, "encoding: raw", "encoding: gzip", "compressed or text");
  refused(ImageFormat::nrrd, "endian: little", "endian: big", "endian");
  refused(ImageFormat::nrrd, "left-posterior-superior", "scanner-xyz", "scanner-xyz");
  refused(ImageFormat::nrrd, "type: int16", "type: int64", "int64");
  refused(ImageFormat::nrrd, "NRRD0004", "NRRB0004", "not an NRRD file");
}

}  // namespace
}  // namespace tetwarp
