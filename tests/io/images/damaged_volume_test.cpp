// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Volume files whose bytes are damaged, missing or too many.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "deform/errors.h"
#include "io/image_file.h"
#include "io/images/text_header.h"
#include "tests/support/image_samples.h"
#include "tests/support/itk_image_io.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

/// 4 x 3 x 5 voxels that do not repeat.
AnyVolume sample(VoxelType type = VoxelType::i16, int components = 1) {
  return numbered(oblique_grid(), type, components);
}

struct Kind {
  const char* name;
  const char* file;
  std::function<void(const std::filesystem::path&)> write;
  bool checked = true;  ///< by a check sum: a flip is found
};

void by_itk(const std::filesystem::path& path, ItkFormat format, int level) {
  itk_write(path, format, sample().view(), level, {});
}
void by_us(const std::filesystem::path& path, int level) { write_image(path, sample().view(), {level, {}}); }

std::string header_of(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  if (path.extension() == ".nii" || path.extension() == ".gz") return bytes.substr(0, 352);
  const ImageFormat format = path.extension() == ".mha" ? ImageFormat::mha : ImageFormat::nrrd;
  return bytes.substr(0, read_text_header(path, format).data_offset);
}

/// NRRD by teem's rules whose gzip data is two members.
void in_two_members(const std::filesystem::path& path) {
  by_us(path, 0);
  std::string bytes = read_bytes(path), header = header_of(path);
  const std::string voxels = bytes.substr(header.size());
  header.replace(header.find("encoding: raw"), 13, "encoding: gzip");
  const auto packed = [&](const std::string& part) {
    const std::filesystem::path gz = path.string() + ".gz";
    write_gzipped(gz, part);
    const std::string member = read_bytes(gz);
    std::filesystem::remove(gz);
    return member;
  };
  write_file(path, header + packed(voxels.substr(0, 50)) + packed(voxels.substr(50)));
}

const Kind kKinds[] = {
    {"gzip NRRD of ITK", "x.nrrd", [](const auto& path) { by_itk(path, ItkFormat::nrrd, 6); }},
    {"gzip NRRD of ours", "x.nrrd", [](const auto& path) { by_us(path, 6); }},
    {"gzip NRRD, two members", "x.nrrd", in_two_members},
    {"raw NRRD", "x.nrrd", [](const auto& path) { by_us(path, 0); }, false},
    {"compressed MHA of ITK", "x.mha", [](const auto& path) { by_itk(path, ItkFormat::meta, 6); }},
    {"compressed MHA of ours", "x.mha", [](const auto& path) { by_us(path, 6); }},
    {"raw MHA", "x.mha", [](const auto& path) { by_us(path, 0); }, false},
    {"NIfTI", "x.nii", [](const auto& path) { by_us(path, 0); }, false},
};

/// Empty where the file is refused by an InputError that names it; else what happened.
std::string not_refused(const std::filesystem::path& path) {
  const std::string text = refusal([&] { read_image(path); });
  if (text.starts_with("InputError: ") && text.find(path.string()) != std::string::npos) return {};
  return text.empty() ? "was read" : text;
}

class DamagedVolume : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    path_ = scratch_ / GetParam().file;
    GetParam().write(path_);
    bytes_ = read_bytes(path_);
    begin_ = header_of(path_).size();
    expected_ = read_image(path_);
    ASSERT_TRUE(same_bytes(expected_, sample()));
  }

  Scratch scratch_;
  std::filesystem::path path_;
  std::string bytes_;
  std::size_t begin_ = 0;  ///< of the voxels
  AnyVolume expected_;
};

TEST_P(DamagedVolume, CutAtAnyByteIsRefusedByName) {
  for (std::size_t kept = 0; kept < bytes_.size(); ++kept) {
    write_file(path_, bytes_.substr(0, kept));
    ASSERT_EQ(not_refused(path_), "") << kept << " of " << bytes_.size() << " bytes";
  }
}

TEST_P(DamagedVolume, BytesBehindTheVoxelsAreRefusedByName) {
  for (const char* more : {"x", "and more", "\x1f", "\x1f\x8b"}) {
    write_file(path_, bytes_ + more);
    EXPECT_EQ(not_refused(path_), "") << more;
  }
}

TEST_P(DamagedVolume, AnyFlippedBitOfCompressedVoxelsIsRefusedOrHarmless) {
  if (!GetParam().checked) GTEST_SKIP() << "plain voxels have no check sum";
  std::size_t refused = 0;
  for (std::size_t bit = 8 * begin_; bit < 8 * bytes_.size(); ++bit) {
    std::string damaged = bytes_;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    write_file(path_, damaged);
    try {
      ASSERT_TRUE(same_bytes(read_image(path_), expected_)) << "bit " << bit - 8 * begin_ << " of the voxels";
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find(path_.string()), std::string::npos) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 8 * (bytes_.size() - begin_) * 3 / 4);
}

TEST_P(DamagedVolume, SizesThatAreNotThoseOfTheVoxelsAreRefused) {
  if (path_.extension() == ".nii") {
    for (const int slices : {4, 6}) {
      put(bytes_, 46, static_cast<std::int16_t>(slices));
      write_file(path_, bytes_);
      EXPECT_EQ(not_refused(path_), "") << slices;
    }
    return;
  }
  for (const char* size : {"4 3 4", "4 3 6", "4 3 5000", "1 1 1"}) {
    std::string other = bytes_;
    other.replace(other.find("4 3 5"), 5, size);
    write_file(path_, other);
    EXPECT_EQ(not_refused(path_), "") << size;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, DamagedVolume, testing::ValuesIn(kKinds), [](const auto& kind) {
  std::string name = kind.param.name;
  std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  return name;
});

/// An NRRD file of a sample with other lines, and other data.
std::filesystem::path nrrd_with(const Scratch& scratch,
                                std::initializer_list<std::pair<const char*, const char*>> edits,
                                const std::function<std::string(const std::string&)>& data, const AnyVolume& volume) {
  const auto path = scratch / "y.nrrd";
  write_image(path, volume.view(), {0, {}});
  std::string header = header_of(path);
  const std::string voxels = read_bytes(path).substr(header.size());
  for (const auto& [from, to] : edits) {
    const auto at = header.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    header.replace(at, std::string(from).size(), to);
  }
  write_file(path, header + data(voxels));
  return path;
}

std::string gzipped(const Scratch& scratch, const std::string& bytes) {
  write_gzipped(scratch / "z.gz", bytes);
  return read_bytes(scratch / "z.gz");
}

TEST(NrrdData, SkipsEndiansAndPlanesAreReadAsItkReadsThem) {
  const Scratch scratch;
  const AnyVolume one = sample(VoxelType::f32), three = sample(VoxelType::f32, 3);
  const auto reversed = [](std::string voxels) {
    for (std::size_t at = 0; at < voxels.size(); at += 4) std::reverse(voxels.begin() + at, voxels.begin() + at + 4);
    return voxels;
  };
  const auto planes = [](const std::string& voxels) {
    std::string moved;
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t n = c; n < voxels.size() / 4; n += 3) moved += voxels.substr(4 * n, 4);
    return moved;
  };
  const auto check = [&](const char* what, const AnyVolume& volume, const std::filesystem::path& path) {
    EXPECT_TRUE(same_bytes(read_image(path), volume)) << what;
    AnyVolume by_itk(volume.geometry(), volume.type(), volume.components());
    itk_read_voxels(path, ItkFormat::nrrd, {by_itk.data(), by_itk.size_bytes()});
    EXPECT_TRUE(same_bytes(by_itk, volume)) << "ITK, " << what;
  };
  check("big endian", one, nrrd_with(scratch, {{"endian: little", "endian: big"}}, reversed, one));
  check("big endian, gzip", one,
        nrrd_with(
            scratch, {{"endian: little", "endian: big"}, {"encoding: raw", "encoding: gz"}},
            [&](const auto& voxels) { return gzipped(scratch, reversed(voxels)); }, one));
  check("line and byte skip", one,
        nrrd_with(
            scratch, {{"encoding: raw", "line skip: 2\nbyte skip: 3\nencoding: raw"}},
            [](const auto& voxels) { return "a line\nanother\nabc" + voxels; }, one));
  check("from the end", one,
        nrrd_with(
            scratch, {{"encoding: raw", "byte skip: -1\nencoding: raw"}},
            [](const auto& voxels) { return "whatever" + voxels; }, one));
  check("skips of gzip", one,
        nrrd_with(
            scratch, {{"encoding: raw", "line skip: 1\nbyte skip: 5\nencoding: gzip"}},
            [&](const auto& voxels) { return "a line\n" + gzipped(scratch, "12345" + voxels); }, one));
  for (const bool gzip : {false, true}) {
    check("components last", three,
          nrrd_with(
              scratch,
              {{"sizes: 3 4 3 5", "sizes: 4 3 5 3"},
               {"space directions: none", "space directions:"},
               {"\nkinds: vector domain domain domain", " none\nkinds: domain domain domain vector"},
               {"encoding: raw", gzip ? "encoding: gzip" : "encoding: raw"}},
              [&](const auto& voxels) { return gzip ? gzipped(scratch, planes(voxels)) : planes(voxels); }, three));
  }
}

TEST(NrrdData, SkipsThatCannotBeAreRefused) {
  const Scratch scratch;
  const AnyVolume one = sample();
  const auto as_they_are = [](const std::string& voxels) { return voxels; };
  for (const char* line :
       {"byte skip: x\nencoding: raw", "byte skip: -2\nencoding: raw", "line skip: -1\nencoding: raw",
        "byte skip: -1\nencoding: gzip", "line skip: 99\nencoding: raw", "byte skip: 1\nencoding: raw",
        "encoding: bzip2", "encoding: hex"})
    EXPECT_EQ(not_refused(nrrd_with(scratch, {{"encoding: raw", line}}, as_they_are, one)), "") << line;
}

TEST(MhaData, BigEndianIsReadAndSizesOfTheHeaderMustBeRight) {
  const Scratch scratch;
  const auto path = scratch / "x.mha";
  by_us(path, 0);
  std::string bytes = read_bytes(path);
  const std::size_t begin = header_of(path).size();
  for (std::size_t at = begin; at < bytes.size(); at += 2) std::swap(bytes[at], bytes[at + 1]);
  bytes.replace(bytes.find("MSB = False"), 11, "MSB = True");
  write_file(path, bytes);
  EXPECT_TRUE(same_bytes(read_image(path), sample()));
  by_us(path, 6);
  bytes = read_bytes(path);
  const auto size = bytes.find("CompressedDataSize = ");
  ASSERT_NE(size, std::string::npos);
  const auto digit = bytes.find_first_of("123456789", size);
  bytes[digit] = bytes[digit] == '1' ? '2' : '1';
  write_file(path, bytes);
  EXPECT_NE(refusal([&] { read_image(path); }).find("compresseddatasize"), std::string::npos);
}

}  // namespace
}  // namespace tetwarp
