// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Volume files written slice by slice: the bytes do not depend on the split, and are those that ITK writes at once.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <glm/geometric.hpp>
#include <map>
#include <random>
#include <sstream>

#include "io/files/gzip_pieces.h"
#include "io/image_file.h"
#include "io/lower_case.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#ifdef TETWARP_WITH_ITK
#include "tests/support/itk_image_io.h"
#endif

namespace tetwarp {
namespace {

const std::vector<std::string> kNames = {"x.mha", "x.nrrd", "x.nii", "x.nii.gz", "X.NRRD"};
const std::vector<int> kLevels = {-1, 0, 1, 6};

bool is_nifti(const std::string& name) { return lower(name).find(".nii") != std::string::npos; }

/// Values that compress, but not to nothing, and do not repeat.
AnyVolume noisy(const glm::i64vec3& size, VoxelType type, int components) {
  Geometry grid = oblique_grid();
  grid.size = size;
  AnyVolume volume(grid, type, components);
  std::uint32_t state = 1;
  for (std::size_t n = 0; n < volume.size_bytes(); ++n)
    volume.data()[n] = static_cast<std::byte>((state = state * 1664525u + 1013904223u) >> 29);
  return volume;
}

ConstVolumeView slices_of(const AnyVolume& volume, std::int64_t begin, std::int64_t end) {
  ConstVolumeView part = volume.view();
  part.buffered.begin.z = begin;
  part.buffered.end.z = end;
  part.voxels += volume.size_bytes() / static_cast<std::size_t>(volume.geometry().size.z) * begin;
  return part;
}

/// What a file has after its slices came `step` at a time.
std::string written(const std::filesystem::path& path, const AnyVolume& volume, std::int64_t step,
                    const ImageWriteOptions& options) {
  const auto writer = create_image(path, volume.geometry(), volume.type(), volume.components(), options);
  const std::int64_t slices = volume.geometry().size.z;
  for (std::int64_t k = 0; k < slices; k += step) {
    const std::int64_t end = std::min(k + step, slices);
    ConstVolumeView part = slices_of(volume, k, end);
    const std::vector<std::byte> held(part.voxels, slices_of(volume, end, end).voxels);  // gone before the next
    part.voxels = held.data();
    writer->write(part);
  }
  writer->finish();
  return read_bytes(path);
}

TEST(ImageWriter, EverySplitGivesTheSameBytesInEveryFormatAndLevel) {
  const Scratch scratch;
  for (const auto& [type, components] : {std::pair(VoxelType::i16, 1), {VoxelType::f32, 3}, {VoxelType::u8, 3}}) {
    for (const std::string& name : kNames) {
      // NIfTI: 1.3 MB and more a component, several members of gzip whose ends are no ends of slices.
      const AnyVolume volume =
          noisy(is_nifti(name) ? glm::i64vec3(151, 113, type == VoxelType::u8 ? 80 : 40) : glm::i64vec3(61, 43, 31),
                type, components);
      const std::int64_t slices = volume.geometry().size.z;
      for (const int level : kLevels) {
        const ImageWriteOptions options{level, {{is_nifti(name) ? "descrip" : "tetwarp_direction", "pull"}}};
        write_image(scratch / name, volume.view(), options);
        const std::string whole = read_bytes(scratch / name);
        EXPECT_TRUE(same_bytes(read_image(scratch / name), volume)) << name << " " << level;
        for (const std::int64_t step : {std::int64_t{1}, std::int64_t{7}, slices - 1})
          EXPECT_TRUE(written(scratch / name, volume, step, options) == whole)
              << name << " level " << level << " " << to_string(type) << " x " << components << ", " << step
              << " slices at a time";
      }
    }
  }
}

TEST(ImageWriter, AWriteThatIsWatchedHasTheSameBytesAndStopsBetweenItsParts) {
  const Scratch scratch;
  const AnyVolume volume = noisy({256, 256, 40}, VoxelType::i16, 1);  // 5 MB
  for (const std::string& name : kNames) {
    const ImageWriteOptions options{1, {}};
    write_image(scratch / name, volume.view(), options);
    const std::string whole = read_bytes(scratch / name);
    std::vector<double> shares;
    write_image(scratch / name, volume.view(), options, {.progress = [&](double share) { shares.push_back(share); }});
    EXPECT_TRUE(read_bytes(scratch / name) == whole) << name;
    EXPECT_TRUE(std::ranges::is_sorted(shares) && shares.back() == 1) << name;
    const bool is_small = name.ends_with(".gz");  // threads take it in few parts, or in one
    EXPECT_TRUE(is_small || shares.size() >= 5) << name << " " << shares.size();

    std::stop_source stop;
    int calls = 0;
    const auto stop_soon = [&](double) {
      if (++calls == 1) stop.request_stop();
    };
    if (is_small) stop.request_stop();
    EXPECT_THROW(write_image(scratch / name, volume.view(), options, {.progress = stop_soon, .stop = stop.get_token()}),
                 Cancelled)
        << name;
    EXPECT_LE(calls, 1) << name;
  }
}

#ifdef TETWARP_WITH_ITK
TEST(ImageWriter, MhaAndNrrdHaveTheBytesThatItkWrites) {
  const Scratch scratch;
  const std::map<std::string, std::string> metadata = {{"tetwarp_direction", "pull"}};
  for (const std::string name : {"x.mha", "x.nrrd"}) {
    const ItkFormat format = name == "x.mha" ? ItkFormat::meta : ItkFormat::nrrd;
    for (const int level : {0, 1, 9}) {
      for (int type = 0; type < 8; ++type) {
        for (const int components : {1, 3}) {
          const AnyVolume volume = noisy({41, 33, 23}, static_cast<VoxelType>(type), components);
          itk_write(scratch / name, format, volume.view(), level, metadata);
          const std::string expected = read_bytes(scratch / name);
          EXPECT_TRUE(written(scratch / name, volume, 4, {level, metadata}) == expected)
              << name << " level " << level << " " << to_string(volume.type()) << " x " << components;
        }
      }
      for (const Geometry& grid : all_orientations()) {
        const AnyVolume volume = numbered(grid, VoxelType::i16);
        itk_write(scratch / name, format, volume.view(), level, {});
        const std::string expected = read_bytes(scratch / name);
        EXPECT_TRUE(written(scratch / name, volume, 2, {level, {}}) == expected) << name << orientation_code(grid);
      }
    }
  }
}

/// Turned any way, and half of them mirrored.
Geometry turned_grid(std::mt19937& random) {
  std::normal_distribution<double> number;
  const auto vector = [&] { return glm::normalize(glm::dvec3(number(random), number(random), number(random))); };
  Geometry grid;
  grid.size = {1, 2, 3};
  grid.spacing = glm::dvec3(1.5) + 0.4 * vector();
  grid.origin = 300.0 * vector();
  const glm::dvec3 x = vector(), z = glm::normalize(glm::cross(x, vector()));
  grid.direction = glm::dmat3(x, glm::cross(z, x), number(random) < 0 ? z : -z);
  return grid;
}

/// The last of what ITK says of units differs: that of time, which 5.4 states and a volume does not have.
std::string without_units(std::string nifti) {
  nifti.at(123) = static_cast<char>(nifti.at(123) & 7);
  return nifti;
}

/// A MetaImage without the words that only repeat TransformMatrix: ITK 5.4 names the ends of axes, and ITK 5.2 their
/// beginnings.
std::string without_orientation(const std::string& meta) {
  const std::size_t begin = meta.find("AnatomicalOrientation"), end = meta.find('\n', begin);
  return meta.substr(0, begin) + meta.substr(end + 1);
}

TEST(ImageWriter, HeadersOfTurnedGridsHaveTheBytesThatItkWrites) {
  const Scratch scratch;
  std::mt19937 random(1);
  std::vector<Geometry> grids = all_orientations();
  grids.push_back(oblique_grid());
  while (grids.size() < 1000) grids.push_back(turned_grid(random));
  constexpr std::pair<const char*, ItkFormat> kFormats[] = {
      {"x.mha", ItkFormat::meta}, {"x.nrrd", ItkFormat::nrrd}, {"x.nii", ItkFormat::nifti}};
  for (const auto& [name, format] : kFormats) {
    for (const Geometry& grid : grids) {
      const AnyVolume volume(grid, VoxelType::u8);
      itk_write(scratch / name, format, volume.view(), 0, {});
      std::string expected = read_bytes(scratch / name);
      if (format == ItkFormat::nifti) expected = without_units(expected);
      std::string found = written(scratch / name, volume, 2, {0, {}});
      if (format == ItkFormat::meta && itk_version() != "5.2") {
        expected = without_orientation(expected);
        found = without_orientation(found);
      }
      ASSERT_EQ(found, expected) << name;
    }
  }
}

TEST(ImageWriter, NiftiHasTheBytesThatItkWrites) {
  const Scratch scratch;
  for (int type = 0; type < 8; ++type) {
    for (const int components : {1, 2, 3, 4, 8}) {
      const AnyVolume volume = noisy({9, 8, 7}, static_cast<VoxelType>(type), components);
      itk_write(scratch / "itk.nii", ItkFormat::nifti, volume.view(), 0, {});
      EXPECT_EQ(written(scratch / "x.nii", volume, 4, {-1, {}}), without_units(read_bytes(scratch / "itk.nii")))
          << to_string(volume.type()) << " x " << components;
    }
  }
}

TEST(ImageWriter, KeysAndValuesAreWrittenAsItkWritesThem) {
  const Scratch scratch;
  const AnyVolume volume = noisy({3, 2, 2}, VoxelType::i16, 1);
  const std::map<std::string, std::string> metadata = {
      {"a key", "a \\ b \\n"}, {"b", ""}, {"c", " blanks  "}, {"descrip", "x: y := z = w"}};
  for (const auto& [name, format] : {std::pair("x.mha", ItkFormat::meta), std::pair("x.nrrd", ItkFormat::nrrd)}) {
    itk_write(scratch / name, format, volume.view(), 0, metadata);
    const std::string expected = read_bytes(scratch / name);
    EXPECT_EQ(written(scratch / name, volume, 1, {0, metadata}), expected) << name;
  }
}
#endif

TEST(ImageWriter, GzippedNiftiIsThePlainOneInMembers) {
  const Scratch scratch;
  for (const int components : {1, 3}) {
    const AnyVolume volume = noisy({151, 113, 40}, VoxelType::f32, components);
    const std::string plain = written(scratch / "x.nii", volume, 4, {-1, {}});
    // The stream in members: the header, then each plane in pieces of 1 MiB, the last of which is shorter.
    const std::size_t plane = (plain.size() - 352) / static_cast<std::size_t>(components);
    std::vector<std::string> pieces = {plain.substr(0, 352)};
    for (std::size_t begin = 352; begin < plain.size(); begin += plane) {
      for (std::size_t at = 0; at < plane; at += kGzipPieceBytes)
        pieces.push_back(plain.substr(begin + at, std::min(kGzipPieceBytes, plane - at)));
    }
    std::ostringstream gzipped;
    write_gzip(
        gzipped, pieces.size(),
        [&](std::size_t i, std::vector<std::byte>&) { return std::as_bytes(std::span(pieces[i])); }, 6);
    EXPECT_TRUE(written(scratch / "x.nii.gz", volume, 4, {6, {}}) == gzipped.str()) << components;
  }
}

TEST(ImageWriter, WhatWaitsForItsPlaceHasNoName) {
  const Scratch scratch;
  const AnyVolume volume = noisy({200, 200, 10}, VoxelType::f32, 3);
  for (const std::string name : {"x.nii.gz", "x.mha"}) {
    const auto writer = create_image(scratch / name, volume.geometry(), VoxelType::f32, 3, {6, {}});
    writer->write(slices_of(volume, 0, 9));
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path()))
      EXPECT_EQ(entry.path().filename(), name);
    std::filesystem::remove(scratch / name);
  }
}

TEST(ImageWriter, SlicesOutOfTurnAndFilesThatAreNotWholeAreRefused) {
  const Scratch scratch;
  const AnyVolume volume = noisy({5, 4, 6}, VoxelType::i16, 1), other = noisy({5, 4, 6}, VoxelType::u16, 1),
                  wide = noisy({6, 4, 6}, VoxelType::i16, 1);
  for (const std::string& name : kNames) {
    const auto writer = create_image(scratch / name, volume.geometry(), VoxelType::i16);
    writer->write(slices_of(volume, 0, 2));
    const auto says = [&](const ConstVolumeView& slices, const std::string& what) {
      const std::string text = refusal([&] { writer->write(slices); });
      EXPECT_NE(text.find(what), std::string::npos) << text;
      EXPECT_NE(text.find((scratch / name).string()), std::string::npos) << text;
    };
    says(slices_of(volume, 3, 4), "slices 3 to 4");
    says(slices_of(volume, 0, 2), "expected whole slices from 2 on");
    says(slices_of(volume, 2, 2), "slices 2 to 2");
    says(slices_of(other, 2, 3), "another grid or type");
    says(slices_of(wide, 2, 3), "another grid or type");
    ConstVolumeView part = slices_of(volume, 2, 3);
    part.buffered.end.x = 4;
    says(part, "expected whole slices");
    EXPECT_NE(refusal([&] { writer->finish(); }).find("2 slices were written"), std::string::npos);
    writer->write(slices_of(volume, 2, 6));
    writer->finish();
    EXPECT_TRUE(same_bytes(read_image(scratch / name), volume)) << name;
  }
}

/// Lets no file of this process grow beyond some bytes, as a full disk does.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

TEST(ImageWriter, AFullDiskIsSaidWithTheNameOfTheFile) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    const AnyVolume volume =
        noisy(is_nifti(name) ? glm::i64vec3(151, 113, 40) : glm::i64vec3(61, 43, 31), VoxelType::f32, 3);
    for (const int level : {-1, kLevels.back()}) {
      // Within the header, within the first slices, and at the end: where planes are put together, or a header goes
      // before.
      write_image(scratch / name, volume.view(), {level, {}});
      const auto size = static_cast<rlim_t>(std::filesystem::file_size(scratch / name));
      for (const rlim_t bytes : {rlim_t{64}, rlim_t{100'000}, size - 10}) {
        const FullDisk full(bytes);
        const std::string text = refusal([&] { written(scratch / name, volume, 3, {level, {}}); });
        EXPECT_TRUE(text.starts_with("Error: cannot write, " + (scratch / name).string() + ";"))
            << level << ", " << bytes << " of " << size << " bytes: " << text;
      }
    }
  }
}

}  // namespace
}  // namespace tetwarp
