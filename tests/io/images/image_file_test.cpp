// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/image_file.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <iostream>
#include <numeric>
#include <thread>

#include "tests/support/image_samples.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::vector<std::string> kNames = {"x.mha", "x.nrrd", "x.nii", "x.nii.gz"};
const std::vector<int> kLevels = {-1, 0, 1, 9};

bool is_nifti(const std::string& name) { return name.find(".nii") != std::string::npos; }

TEST(ImageFile, GeometrySurvivesEveryFormatInAll48Orientations) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    for (const Geometry& grid : all_orientations()) {
      write_image(scratch / name, numbered(grid, VoxelType::i16).view());
      const Geometry back = read_image_header(scratch / name).geometry;
      EXPECT_TRUE(same_grid(back, grid, is_nifti(name) ? 2e-5 : 0)) << name << " " << orientation_code(grid);
      EXPECT_EQ(orientation_code(back), orientation_code(grid)) << name;
      if (!is_nifti(name)) {
        EXPECT_EQ(back, grid) << name << " " << orientation_code(grid);
      }
    }
  }
}

TEST(ImageFile, ObliqueGeometrySurvivesEveryFormat) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {400, 3, 5};
  for (const std::string& name : kNames) {
    write_image(scratch / name, numbered(grid, VoxelType::u8).view());
    const Geometry back = read_image_header(scratch / name).geometry;
    EXPECT_TRUE(same_grid(back, grid, is_nifti(name) ? 1e-4 : 1e-12)) << name;
  }
}

TEST(ImageFile, VoxelsOfEveryTypeComeBackAtEveryLevel) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    for (int type = 0; type < 8; ++type) {
      for (const int components : {1, 3}) {
        for (const int level : kLevels) {
          const AnyVolume volume = numbered(all_orientations()[13], static_cast<VoxelType>(type), components);
          write_image(scratch / name, volume.view(), {level, {}});
          EXPECT_TRUE(same_bytes(read_image(scratch / name), volume))
              << name << " " << to_string(volume.type()) << " x " << components << " level " << level;
        }
      }
    }
  }
}

TEST(ImageFile, NanPayloadsInfinityAndNegativeZeroComeBack) {
  const Scratch scratch;
  AnyVolume single(all_orientations()[0], VoxelType::f32), twice(all_orientations()[0], VoxelType::f64);
  for (std::size_t i = 0; i < single.as<float>().size(); ++i) {
    constexpr std::uint32_t kBits[] = {0x7fc12345u, 0xffc54321u, 0x7f800000u, 0xff800000u, 0x80000000u, 0x00000001u};
    single.as<float>()[i] = std::bit_cast<float>(kBits[i % 6]);
    twice.as<double>()[i] = std::bit_cast<double>(std::uint64_t{kBits[i % 6]} << 32 | 0x1234567u);
  }
  for (const std::string& name : kNames) {
    write_image(scratch / name, single.view());
    EXPECT_TRUE(same_bytes(read_image(scratch / name), single)) << name;
    write_image(scratch / name, twice.view());
    EXPECT_TRUE(same_bytes(read_image(scratch / name), twice)) << name;
  }
}

TEST(ImageFile, SuffixDecidesInAnyCase) {
  const Scratch scratch;
  for (const char* name : {"a.nii", "a.nii.gz", "a.nrrd", "a.mha", "a.b.NII.GZ", "A.NRRD"})
    EXPECT_TRUE(has_image_suffix(name)) << name;
  for (const char* name : {"a", "a.gz", "nii", "a.mhd", "a.nhdr", "a.nii.gz.json", "a.hdr"})
    EXPECT_FALSE(has_image_suffix(name)) << name;
  const AnyVolume volume = numbered(oblique_grid(), VoxelType::i16);
  for (const std::string& name : kNames) {
    std::string loud = ".tetwarp-partial-1-a.b.";
    for (const char c : name) loud += static_cast<char>(std::toupper(c));
    write_image(scratch / loud, volume.view());
    EXPECT_TRUE(same_bytes(read_image(scratch / loud), volume)) << loud;
  }
  EXPECT_NE(refusal([&] { write_image(scratch / "x.tif", volume.view()); }).find("InputError: an unknown suffix"),
            std::string::npos);
  EXPECT_NE(refusal([&] { read_image(scratch / "x.tif"); }).find("InputError: an unknown suffix"), std::string::npos);
}

TEST(ImageFile, MetadataComesBack) {
  const Scratch scratch;
  const AnyVolume volume = numbered(oblique_grid(), VoxelType::i16);
  for (const std::string& name : kNames) {
    const std::string key = is_nifti(name) ? "descrip" : "tetwarp_direction", value(79, 'x');
    for (const int level : kLevels) {
      write_image(scratch / name, volume.view(), {level, {{key, value}}});
      EXPECT_EQ(read_image_header(scratch / name).metadata.at(key), value) << name << level;
    }
    EXPECT_NE(refusal([&] { write_image(scratch / name, volume.view(), {-1, {{key, "two\nlines"}}}); }), "") << name;
  }
}

TEST(ImageFile, MissingEmptyAndForeignFilesAreRefusedByName) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    EXPECT_NE(
        refusal([&] { read_image(scratch / name); }).find("InputError: no such file, " + (scratch / name).string()),
        std::string::npos);
    write_file(scratch / name, "");
    EXPECT_NE(refusal([&] { read_image(scratch / name); }).find("an empty file, " + (scratch / name).string()),
              std::string::npos);
    for (const std::string& content :
         {std::string(5000, 'x'), std::string(10, '\0'), std::string("NRRD0004\n"), std::string("NDims = 3\n")}) {
      write_file(scratch / name, content);
      const std::string text = refusal([&] { read_image(scratch / name); });
      EXPECT_TRUE(text.starts_with("InputError: ") && text.find((scratch / name).string()) != std::string::npos)
          << text;
    }
    std::filesystem::remove(scratch / name);
    std::filesystem::create_directory(scratch / name);
    EXPECT_NE(refusal([&] { read_image(scratch / name); }).find("not a file"), std::string::npos) << name;
    std::filesystem::remove(scratch / name);
  }
}

TEST(ImageFile, TruncatedFilesAreRefused) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {40, 30, 20};
  for (const std::string& name : kNames) {
    for (const int level : kLevels) {
      write_image(scratch / name, numbered(grid, VoxelType::i16).view(), {level, {}});
      const std::string whole_file = read_bytes(scratch / name);
      for (const std::size_t kept : {whole_file.size() / 2, whole_file.size() - 40, std::size_t{120}}) {
        write_file(scratch / name, whole_file.substr(0, kept));
        const std::string text = refusal([&] { read_image(scratch / name); });
        EXPECT_TRUE(text.starts_with("InputError: ") && text.find((scratch / name).string()) != std::string::npos)
            << name << " level " << level << ", " << kept << " of " << whole_file.size() << " bytes: " << text;
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      }
    }
  }
}

TEST(ImageFile, HeadersThatPromiseTooMuchAreRefusedBeforeAnythingIsAllocated) {
  const Scratch scratch;
  for (const char* name : {"x.mha", "x.nrrd"}) {
    for (const int level : kLevels) {
      write_image(scratch / name, numbered(oblique_grid(), VoxelType::i16).view(), {level, {}});
      std::string bytes = read_bytes(scratch / name);
      const auto size = bytes.find(" 4 3 5\n");
      ASSERT_NE(size, std::string::npos);
      write_file(scratch / name, bytes.replace(size, 7, " 400000 300000 500000\n"));
      const std::string text = refusal([&] { read_image_header(scratch / name); });
      EXPECT_NE(text.find("InputError: truncated, or a header that promises too much"), std::string::npos) << text;
    }
  }
}

TEST(ImageFile, ShearedAndInvalidGridsAreRefused) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    AnyVolume volume = numbered(oblique_grid(), VoxelType::i16);
    Geometry grid = oblique_grid();
    grid.direction[2] = glm::dvec3(0, 0.3, 1) / std::sqrt(1.09);
    volume.set_geometry(grid);
    EXPECT_NE(refusal([&] { write_image(scratch / name, volume.view()); }).find("a sheared grid"), std::string::npos);
    grid = oblique_grid();
    grid.origin.x = NAN;
    volume.set_geometry(grid);
    EXPECT_NE(refusal([&] { write_image(scratch / name, volume.view()); }).find("the origin is not finite"),
              std::string::npos);
  }
  write_image(scratch / "x.mha", numbered(all_orientations()[0], VoxelType::i16).view());
  std::string bytes = read_bytes(scratch / "x.mha");
  const auto matrix = bytes.find("1 0 0 0 1 0 0 0 1");
  write_file(scratch / "x.mha", bytes.replace(matrix, 17, "1 0 0 .3 1 0 0 0 1"));
  EXPECT_NE(refusal([&] { read_image(scratch / "x.mha"); }), "");
}

TEST(ImageFile, VoxelsInAnotherFileAreRefused) {
  const Scratch scratch;
  write_image(scratch / "x.mha", numbered(oblique_grid(), VoxelType::i16).view());
  std::string bytes = read_bytes(scratch / "x.mha");
  write_file(scratch / "x.mha", bytes.replace(bytes.find("LOCAL"), 5, "x.raw"));
  EXPECT_NE(refusal([&] { read_image(scratch / "x.mha"); }).find("voxels in another file (\"x.raw\")"),
            std::string::npos);
  write_image(scratch / "x.nrrd", numbered(oblique_grid(), VoxelType::i16).view());
  bytes = read_bytes(scratch / "x.nrrd");
  write_file(scratch / "x.nrrd", bytes.insert(bytes.find("space:"), "data file: x.raw\n"));
  EXPECT_NE(refusal([&] { read_image(scratch / "x.nrrd"); }).find("voxels in another file (\"x.raw\")"),
            std::string::npos);
}

TEST(ImageFile, FullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {100, 100, 20};
  for (const std::string& name : kNames) {
    std::filesystem::create_symlink("/dev/full", scratch / name);
    const std::string text = refusal([&] { write_image(scratch / name, numbered(grid, VoxelType::i16).view()); });
    EXPECT_TRUE(text.starts_with("Error: cannot write")) << name << ": " << text;
    EXPECT_NE(refusal([&] { write_image(scratch / ("none/" + name), numbered(grid, VoxelType::i16).view()); }), "")
        << name;
  }
}

TEST(ImageFile, NrrdInRasIsReadAsLps) {
  const Scratch scratch;
  write_file(scratch / "x.nrrd",
             "NRRD0004\ntype: int8\ndimension: 3\nspace: right-anterior-superior\nsizes: 2 1 3\n"
             "space directions: (2,0,0) (0,0,3) (0,-4,0)\nencoding: raw\nspace origin: (10,20,30)\n\nabcdef");
  const AnyVolume volume = read_image(scratch / "x.nrrd");
  EXPECT_EQ(volume.geometry().origin, glm::dvec3(-10, -20, 30));
  EXPECT_EQ(volume.geometry().spacing, glm::dvec3(2, 3, 4));
  EXPECT_EQ(volume.geometry().direction, glm::dmat3(-1, 0, 0, 0, 0, 1, 0, 1, 0));
  EXPECT_EQ(volume.as<std::int8_t>()[4], 'e');
}

TEST(ImageFile, NrrdInLasIsReadAsLps) {
  const Scratch scratch;
  for (const char* space : {"left-anterior-superior", "LAS"}) {
    write_file(scratch / "x.nrrd", std::string("NRRD0004\ntype: int8\ndimension: 3\nspace: ") + space +
                                       "\nsizes: 2 1 3\nspace directions: (2,0,0) (0,0,3) (0,4,0)\nencoding: raw\n"
                                       "space origin: (10,20,30)\n\nabcdef");
    const Geometry grid = read_image_header(scratch / "x.nrrd").geometry;
    EXPECT_EQ(grid.origin, glm::dvec3(10, -20, 30));
    EXPECT_EQ(grid.spacing, glm::dvec3(2, 3, 4));
    EXPECT_EQ(grid.direction, glm::dmat3(1, 0, 0, 0, 0, 1, 0, -1, 0));
  }
}

TEST(ImageFile, AnNrrdWithoutASpaceOfThePatientIsTakenAsLpsWithANote) {
  const Scratch scratch;
  const auto notes_of = [&](const std::string& place) {
    write_file(scratch / "x.nrrd",
               "NRRD0004\ntype: int8\ndimension: 3\nsizes: 2 1 3\nencoding: raw\n" + place + "\n\nabcdef");
    return read_image_header(scratch / "x.nrrd").notes;
  };
  const std::string directions = "\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (1,2,3)";
  EXPECT_EQ(notes_of("space: left-posterior-superior" + directions), std::vector<std::string>());
  EXPECT_EQ(notes_of("space: RAS" + directions), std::vector<std::string>());
  EXPECT_TRUE(says(notes_of("space: scanner-xyz" + directions).at(0), {"scanner-xyz", "taken as LPS"}));
  EXPECT_TRUE(says(notes_of("spacings: 2 3 4").at(0), {"does not say its space", "taken as LPS"}));
}

TEST(ImageFile, AnNrrdAxisWithoutAStepIsNotGivenOne) {
  const Scratch scratch;
  write_file(scratch / "x.nrrd",
             "NRRD0004\ntype: int8\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 1 3\n"
             "space directions: (2,0,0) (nan,nan,nan) (0,4,0)\nencoding: raw\nspace origin: (1,2,3)\n\nabcdef");
  EXPECT_TRUE(says(refusal([&] { read_image(scratch / "x.nrrd"); }), {"space directions", "x.nrrd"}));
}

TEST(ImageFile, VoxelsOfATypeThatVolumesDoNotHaveAreRefusedByName) {
  const Scratch scratch;
  const auto refused = [&](const char* name, VoxelType type, const std::string& from, const std::string& to,
                           const char* why) {
    write_image(scratch / name, numbered(oblique_grid(), type, type == VoxelType::u8 ? 3 : 1).view());
    std::string bytes = read_bytes(scratch / name);
    const auto at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file(scratch / name, bytes.replace(at, from.size(), to));
    const std::string text = refusal([&] { read_image(scratch / name); });
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << text;
  };
  refused("x.mha", VoxelType::f64, "MET_DOUBLE", "MET_LONG_LONG", "voxels of type int64");
  refused("x.mha", VoxelType::f64, "MET_DOUBLE", "MET_ULONG_LONG", "voxels of type uint64");
  refused("x.nrrd", VoxelType::f64, "type: double", "type: int64", "voxels of type int64");
  refused("x.nrrd", VoxelType::u8, "kinds: vector", "kinds: RGB-color", "voxels that are rgb");
}

TEST(ImageFile, FlippedBitInCompressedVoxelsIsRefused) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {40, 30, 20};
  AnyVolume volume(grid, VoxelType::u16);
  std::uint32_t state = 1;
  for (auto& v : volume.as<std::uint16_t>())
    v = static_cast<std::uint16_t>((state = state * 1664525u + 1013904223u) >> 20);
  for (const char* name : {"x.mha", "x.nrrd", "x.nii.gz"}) {
    write_image(scratch / name, volume.view(), {6, {}});
    std::string bytes = read_bytes(scratch / name);
    bytes[bytes.size() * 2 / 3] ^= 0x10;
    write_file(scratch / name, bytes);
    EXPECT_TRUE(refusal([&] { read_image(scratch / name); }).starts_with("InputError: ")) << name;
  }
}

TEST(ImageFile, CompressedMhaMustHoldExactlyWhatItsHeaderSays) {
  const Scratch scratch;
  for (const char* size : {"DimSize = 4 3 4", "DimSize = 4 3 6"}) {
    write_image(scratch / "x.mha", numbered(all_orientations()[0], VoxelType::i16).view(), {6, {}});
    std::string bytes = read_bytes(scratch / "x.mha");
    write_file(scratch / "x.mha", bytes.replace(bytes.find("DimSize = 4 3 5"), 15, size));
    EXPECT_TRUE(refusal([&] { read_image(scratch / "x.mha"); }).starts_with("InputError: ")) << size;
  }
}

TEST(ImageFile, CompressedSizeFollowsTheLevel) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {64, 64, 64};
  AnyVolume volume(grid, VoxelType::i16);
  std::uint32_t state = 1;
  for (auto& v : volume.as<std::int16_t>())
    v = static_cast<std::int16_t>((state = state * 1664525u + 1013904223u) >> 28);
  for (const char* name : {"x.mha", "x.nrrd", "x.nii.gz"}) {
    std::vector<std::uintmax_t> sizes;
    for (const int level : {0, 1, 9}) {
      write_image(scratch / name, volume.view(), {level, {}});
      sizes.push_back(std::filesystem::file_size(scratch / name));
    }
    EXPECT_TRUE(sizes[0] > volume.size_bytes() && sizes[1] < sizes[0] && sizes[2] < sizes[1]) << name;
  }
}

TEST(ImageFile, CompressedBytesDoNotDependOnThreads) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {200, 150, 100};
  const AnyVolume volume = numbered(grid, VoxelType::f32, 3);
  const tbb::global_control three(tbb::global_control::max_allowed_parallelism, 3);
  for (const int threads : {1, 2, 3}) {
    tbb::task_arena(threads).execute([&] {
      write_image(scratch / std::to_string(threads).append(".nii.gz"), volume.view());
      EXPECT_TRUE(same_bytes(read_image(scratch / "1.nii.gz"), volume)) << threads;
    });
  }
  EXPECT_TRUE(read_bytes(scratch / "1.nii.gz") == read_bytes(scratch / "2.nii.gz"));
  EXPECT_TRUE(read_bytes(scratch / "1.nii.gz") == read_bytes(scratch / "3.nii.gz"));
}

TEST(ImageFile, RealNiftiHasTheGeometryOfItsSform) {
  TETWARP_REAL_DATA(folder, "nifti-abdomen-3mm");
  const AnyVolume volume = read_image(folder / "example_ct.nii.gz");
  const Geometry& grid = volume.geometry();
  EXPECT_EQ(grid.size, glm::i64vec3(122, 101, 112));
  EXPECT_EQ(volume.type(), VoxelType::i32);
  EXPECT_EQ(grid.spacing, glm::dvec3(3));
  EXPECT_EQ(grid.direction, glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1));
  EXPECT_TRUE(glm::all(glm::lessThan(glm::abs(grid.origin - glm::dvec3(177.956, -11.319, 94.302)), glm::dvec3(5e-4))));
  const auto [low, high] = std::ranges::minmax_element(volume.as<std::int32_t>());
  EXPECT_EQ(*low, -1207);
  EXPECT_EQ(*high, 3382);
}

TEST(ImageFile, RealMhaHasTheStatedSumAndSurvivesEveryFormat) {
  TETWARP_REAL_DATA(folder, "lung-4dct-t0-t5");
  const AnyVolume volume = read_image(folder / "t0.mha");
  const auto voxels = volume.as<std::int16_t>();
  EXPECT_EQ(std::accumulate(voxels.begin(), voxels.end(), std::int64_t{0}), -5961119589);
  EXPECT_EQ(volume.geometry().origin, glm::dvec3(-249.512, -249.512, -167.5));
  const Scratch scratch;
  for (const std::string& name : kNames) {
    write_image(scratch / name, volume.view(), {1, {}});
    const AnyVolume back = read_image(scratch / name);
    EXPECT_TRUE(same_bytes(back, volume)) << name;
    EXPECT_TRUE(same_grid(back.geometry(), volume.geometry(), 1e-4)) << name;
  }
}

TEST(ImageFile, ThreadsThatReadAtOnceLeaveStandardErrorAsItWas) {
  const Scratch scratch;
  Geometry grid;
  grid.size = {4, 3, 2};
  const AnyVolume volume(grid, VoxelType::i16);
  write_image(scratch / "ct.nii", volume.view());
  std::streambuf* const before = std::cerr.rdbuf();
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 8; ++n) {
      threads.emplace_back([&] {
        for (int again = 0; again < 50; ++again)
          EXPECT_EQ(read_image_header(scratch / "ct.nii").geometry.size, grid.size);
      });
    }
  }
  std::streambuf* const after = std::cerr.rdbuf(before);
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace tetwarp
