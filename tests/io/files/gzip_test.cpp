// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "deform/errors.h"
#include "io/files/gzip_inflate.h"
#include "io/files/gzip_pieces.h"
#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

/// Bytes that compress about two times.
std::string noise(std::size_t size) {
  std::string bytes(size, '\0');
  std::uint32_t state = 1;
  for (char& byte : bytes) byte = static_cast<char>((state = state * 1664525u + 1013904223u) >> 28);
  return bytes;
}

/// The gzip file that `write_gzip` makes of a text cut into pieces of `step` bytes.
std::string ours(const std::string& plain, std::size_t step, int level = 1) {
  std::ostringstream out;
  const auto piece = [&](std::size_t i, std::vector<std::byte>&) {
    return std::as_bytes(std::span(plain)).subspan(i * step, std::min(step, plain.size() - i * step));
  };
  write_gzip(out, (plain.size() + step - 1) / step, piece, level);
  return out.str();
}

/// A member of ours with nothing in it.
std::string ours_empty() {
  std::ostringstream out;
  write_gzip(
      out, 1, [](std::size_t, std::vector<std::byte>&) { return std::span<const std::byte>(); }, 1);
  return out.str();
}

/// One member by zlib, with a name, a comment and a CRC in its header.
std::string foreign(const std::string& plain, int level = 6) {
  z_stream stream{};
  deflateInit2(&stream, level, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
  std::array<Bytef, 5> name = {'n', 'a', 'm', 'e', 0}, extra = {'x', 'y', 1, 0, 'z'};
  gz_header header{};
  header.name = header.comment = name.data();
  header.extra = extra.data();
  header.extra_len = 5;
  header.hcrc = 1;
  deflateSetHeader(&stream, &header);
  std::string packed(deflateBound(&stream, plain.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string several(const std::string& plain) {
  const std::size_t third = plain.size() / 3;
  return foreign("") + foreign(plain.substr(0, third)) + foreign("") + foreign("") +
         foreign(plain.substr(third, third)) + foreign(plain.substr(2 * third)) + foreign("");
}

/// What `inflate_at_once` gives; nothing where it leaves the file to zlib or finds it damaged.
std::string inflated(const std::filesystem::path& path, std::uint64_t offset, std::size_t bytes, std::uint64_t size) {
  const PlainBytes plain = inflate_at_once(path, size);
  std::string part(bytes, '\0');
  if (!plain || !plain(offset, std::as_writable_bytes(std::span(part)))) return {};
  return part;
}

/// The bytes of a .nii file of 11 x 10 x 9 int16 voxels that do not repeat.
std::string nifti_bytes(const Scratch& scratch) {
  Geometry grid = all_orientations()[0];
  grid.size = {11, 10, 9};
  AnyVolume volume(grid, VoxelType::i16);
  const std::string values = noise(volume.size_bytes());
  std::memcpy(volume.data(), values.data(), values.size());
  write_image(scratch / "x.nii", volume.view());
  return read_bytes(scratch / "x.nii");
}

/// Ways to keep the same bytes, by name.
std::vector<std::pair<const char*, std::string>> packings(const std::string& plain) {
  return {{"ours", ours(plain, 352)},
          {"ours, stored", ours(plain, 352, 0)},
          {"foreign", foreign(plain)},
          {"foreign, stored", foreign(plain, 0)},
          {"several members", several(plain)}};
}

TEST(Gzip, BytesDoNotDependOnThreads) {
  const std::string plain = noise(30'000'000);
  const tbb::global_control three(tbb::global_control::max_allowed_parallelism, 3);
  std::vector<std::string> files(3);
  for (int threads = 1; threads <= 3; ++threads) {
    tbb::task_arena(threads).execute([&] { files[threads - 1] = ours(plain, kGzipPieceBytes); });
  }
  EXPECT_TRUE(files[0] == files[1] && files[0] == files[2]);
  EXPECT_LT(files[0].size(), plain.size() * 2 / 3);
}

TEST(Gzip, GzipAndZlibReadOurFilesWhole) {
  const Scratch scratch;
  const std::string plain = noise(3'000'000);
  for (const int level : {0, 1, 9}) {
    for (const std::size_t step : {kGzipPieceBytes, std::size_t{65'536}}) {
      write_file(scratch / "x.gz", ours(plain, step, level));
      const std::string file = "'" + (scratch / "x.gz").string() + "'", said = "'" + (scratch / "said").string() + "'";
      EXPECT_EQ(std::system(("gzip -t " + file + " 2> " + said).c_str()), 0);
      EXPECT_EQ(read_bytes(scratch / "said"), "");
      gzFile stream = gzopen((scratch / "x.gz").c_str(), "rb");
      std::string back(plain.size() + 1, '\0');
      EXPECT_EQ(gzread(stream, back.data(), static_cast<unsigned>(back.size())), static_cast<int>(plain.size()));
      gzclose(stream);
      back.pop_back();
      EXPECT_TRUE(back == plain) << level << " " << step;
    }
  }
}

TEST(Gzip, AnyPartOfOurFilesIsReadFromItsMembersAlone) {
  const Scratch scratch;
  const std::string plain = noise(2'000'000);
  std::string file = ours(plain, 100'000);
  write_file(scratch / "x.gz", file);
  const PlainBytes whole = inflate_at_once(scratch / "x.gz", plain.size());
  ASSERT_TRUE(whole);
  std::atomic<int> wrong = 0;
  tbb::parallel_for(0, 400, [&](int i) {
    const std::size_t begin = static_cast<std::size_t>(i) * 4'999,
                      n = std::min<std::size_t>(350'000, plain.size() - begin);
    std::string part(n, '\0');
    if (!whole(begin, std::as_writable_bytes(std::span(part))) || part != plain.substr(begin, n)) ++wrong;
  });
  EXPECT_EQ(wrong, 0);
  file[file.size() / 2 + 20'000] ^= 1;  // within the eleventh of 20 members
  write_file(scratch / "x.gz", file);
  EXPECT_TRUE(inflated(scratch / "x.gz", 0, 500'000, plain.size()) == plain.substr(0, 500'000));
  EXPECT_TRUE(inflated(scratch / "x.gz", 1'500'000, 500'000, plain.size()) == plain.substr(1'500'000));
  EXPECT_EQ(inflated(scratch / "x.gz", 0, plain.size(), plain.size()), "");
}

TEST(Gzip, ForeignFilesAreInflatedWhateverTheirMembersAndZerosFollow) {
  const Scratch scratch;
  const std::string plain = noise(200'000), half = plain.substr(0, 100'000), rest = plain.substr(100'000);
  const std::pair<const char*, std::string> files[] = {
      {"one member", foreign(plain)},
      {"several members", several(plain)},
      {"ours, then foreign", ours(half, 30'000) + foreign(rest)},
      {"foreign, then ours", foreign(half) + ours(rest, 30'000)},
      {"trailing zeros", several(plain) + std::string(600, '\0')},
      {"ours, empty members", ours_empty() + ours(half, 30'000) + ours_empty() + ours(rest, 30'000) + ours_empty()},
      {"ours, trailing zeros", ours(plain, 30'000) + std::string(600, '\0')},
  };
  for (const auto& [name, bytes] : files) {
    write_file(scratch / "x.gz", bytes);
    EXPECT_TRUE(inflated(scratch / "x.gz", 0, plain.size(), plain.size()) == plain) << name;
    EXPECT_TRUE(inflated(scratch / "x.gz", 99'990, 20, plain.size()) == plain.substr(99'990, 20)) << name;
  }
}

TEST(Gzip, WhatLibdeflateCannotDoIsLeftToZlib) {
  const Scratch scratch;
  const std::string plain = noise(5'000);
  const auto left = [&](const std::string& bytes) {
    write_file(scratch / "x.gz", bytes);
    return !inflate_at_once(scratch / "x.gz", plain.size());
  };
  EXPECT_FALSE(left(foreign(plain)));
  EXPECT_TRUE(left(foreign(plain.substr(1))));
  EXPECT_TRUE(left(foreign(plain + "more")));
  EXPECT_TRUE(left(foreign(plain) + foreign("more")));
  EXPECT_TRUE(left(ours(plain.substr(1), 100)));
  EXPECT_TRUE(left(ours(plain, 100) + foreign("more")));
  EXPECT_TRUE(left(ours(plain, 100) + "\x1f\x8b"));
  EXPECT_TRUE(left(ours(plain + "more", 100)));
  EXPECT_TRUE(left(foreign(plain) + "and more"));
  EXPECT_TRUE(left(ours(plain, 100) + "and more"));
  EXPECT_TRUE(left(ours(plain, 100) + "\x1f"));
  EXPECT_TRUE(left(foreign("")));
  EXPECT_TRUE(left(""));
}

TEST(GzippedNifti, EveryPackingGivesTheVoxelsOfThePlainFile) {
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {130, 120, 50};
  const auto same = [&](const AnyVolume& volume, const char* kind, float slope) {
    write_image(scratch / "x.nii", volume.view());
    std::string plain = read_bytes(scratch / "x.nii");
    put(plain, 112, slope);
    write_file(scratch / "x.nii", plain);
    const AnyVolume expected = read_image(scratch / "x.nii");
    auto files = packings(plain);
    files.emplace_back("pieces that are not the reader's", ours(plain, 777'777));
    files.emplace_back("pieces that begin with the voxels",
                       ours(plain.substr(0, 352), 352) + ours(plain.substr(352), kGzipPieceBytes));
    files.emplace_back("an empty member, then zeros", several(plain) + foreign("") + std::string(600, '\0'));
    for (const auto& [name, bytes] : files) {
      write_file(scratch / "y.nii.gz", bytes);
      EXPECT_TRUE(same_bytes(read_image(scratch / "y.nii.gz"), expected)) << kind << ", " << name;
    }
  };
  same(numbered(grid, VoxelType::i16), "int16", 1);
  same(numbered(grid, VoxelType::f32, 3), "three floats", 1);
  same(numbered(grid, VoxelType::u8), "scaled", 0.5f);
}

TEST(GzippedNifti, TruncationAtAnyByteIsRefusedByName) {
  const Scratch scratch;
  const std::string file = (scratch / "y.nii.gz").string();
  for (const auto& [name, bytes] : packings(nifti_bytes(scratch))) {
    const std::size_t end = std::string(name) == "several members" ? bytes.size() - foreign("").size() : bytes.size();
    for (std::size_t kept = 0; kept < end; ++kept) {
      std::filesystem::remove(file);
      write_file(file, bytes.substr(0, kept));
      const std::string text = refusal([&] { read_image(file); });
      EXPECT_TRUE(text.starts_with("InputError: ") && text.find(file) != std::string::npos)
          << name << ", " << kept << " of " << bytes.size() << " bytes: " << text;
    }
  }
}

TEST(GzippedNifti, WhateverFollowsTheVoxelsIsRefusedByName) {
  const Scratch scratch;
  const std::string plain = nifti_bytes(scratch);
  for (const std::string& bytes :
       {foreign(plain + "more"), ours(plain + "more", 352), several(plain) + foreign("more"), foreign(plain) + "text",
        ours(plain, 352) + "text", ours(plain, 352) + "\x1f", several(plain) + std::string(600, '\0') + "x"}) {
    std::filesystem::remove(scratch / "y.nii.gz");
    write_file(scratch / "y.nii.gz", bytes);
    const std::string text = refusal([&] { read_image(scratch / "y.nii.gz"); });
    EXPECT_TRUE(text.starts_with("InputError: ") && text.find("y.nii.gz") != std::string::npos) << text;
    EXPECT_NE(text.find("follow"), std::string::npos) << text;
  }
}

TEST(GzippedNifti, FlippedBitIsRefusedOrHarmless) {
  const Scratch scratch;
  const std::string plain = nifti_bytes(scratch);
  const AnyVolume expected = read_image(scratch / "x.nii");
  for (const auto& [name, bytes] : packings(plain)) {
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 11) {
      std::string damaged = bytes;
      damaged[bit / 8] ^= static_cast<char>(1 << bit % 8);
      std::filesystem::remove(scratch / "y.nii.gz");
      write_file(scratch / "y.nii.gz", damaged);
      try {
        const AnyVolume back = read_image(scratch / "y.nii.gz");
        EXPECT_TRUE(same_bytes(back, expected) && back.geometry() == expected.geometry()) << name << ", bit " << bit;
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("y.nii.gz"), std::string::npos) << error.what();
        ++refused;
      }
    }
    EXPECT_GT(refused, bytes.size() / 3) << name;
  }
}

TEST(GzippedNifti, DamageBetweenHeaderAndVoxelsIsRefused) {
  const Scratch scratch;
  std::string plain = nifti_bytes(scratch);
  plain.insert(352, noise(100'000));
  put(plain, 108, 100'352.0f);  // vox_offset
  std::string bytes = ours(plain, 20'000);
  write_file(scratch / "y.nii.gz", bytes);
  EXPECT_TRUE(same_bytes(read_image(scratch / "y.nii.gz"), read_image(scratch / "x.nii")));
  bytes[bytes.size() / 2] ^= 1;
  write_file(scratch / "y.nii.gz", bytes);
  EXPECT_NE(refusal([&] { read_image(scratch / "y.nii.gz"); }).find("damaged voxels"), std::string::npos);
}

TEST(GzippedNifti, NibabelReadsTheSameVoxels) {
  const std::string python = TETWARP_PYTHON;
  if (std::system(("'" + python + "' -c 'import nibabel' 2> /dev/null").c_str()) != 0)
    GTEST_SKIP() << "python3-nibabel is not installed";
  const Scratch scratch;
  Geometry grid = oblique_grid();
  grid.size = {130, 120, 100};
  const AnyVolume volume = numbered(grid, VoxelType::i16);
  write_image(scratch / "x.nii.gz", volume.view());
  const std::string script =
      "import nibabel, numpy, sys; numpy.asarray(nibabel.load(sys.argv[1]).dataobj).T.tofile(sys.argv[2])";
  ASSERT_EQ(std::system(("'" + python + "' -c '" + script + "' '" + (scratch / "x.nii.gz").string() + "' '" +
                         (scratch / "raw").string() + "'")
                            .c_str()),
            0);
  const std::string raw = read_bytes(scratch / "raw");
  ASSERT_EQ(raw.size(), volume.size_bytes());
  EXPECT_EQ(std::memcmp(raw.data(), volume.data(), raw.size()), 0);
}

}  // namespace
}  // namespace tetwarp
