// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "deform/errors.h"
#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"
#ifdef TETWARP_WITH_ITK
#include "tests/support/itk_image_io.h"
#endif

/// Files of one format, one a line: what ITK makes of each, and what we do.

/// Whether a file is read, and whether ITK 5.2 reads it too. What later ones refuse is not compared.
enum class Reads {
  both,     ///< the same grid and voxels
  neither,  ///< refused by both
  we,       ///< ITK refuses it, or reads other voxels
  itk       ///< we refuse it
};

struct ImageRow {
  std::string what;
  std::string bytes;
  Reads reads = Reads::both;
  bool counts = true;  ///< whether the values are 1, 2, 3 and so on
};

/// `count` values from 1 on, as they lie in memory, or in the other order of bytes.
template <class V>
std::string values_from_1(std::size_t count, bool big_endian = false) {
  std::string bytes;
  for (std::size_t n = 1; n <= count; ++n) append_value(bytes, static_cast<V>(n));
  for (std::size_t at = 0; big_endian && at < bytes.size(); at += sizeof(V))
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + sizeof(V)));
  return bytes;
}

inline std::string in_gzip(const Scratch& scratch, const std::string& bytes) {
  write_gzipped(scratch / "z.gz", bytes);
  return read_bytes(scratch / "z.gz");
}

inline testing::AssertionResult counts_from_1(const tetwarp::AnyVolume& volume) {
  testing::AssertionResult result = testing::AssertionSuccess();
  tetwarp::dispatch(volume.type(), [&](auto v) {
    const auto values = volume.as<decltype(v)>();
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (static_cast<double>(values[n]) != static_cast<double>(n + 1) && result)
        result = testing::AssertionFailure() << "value " << n << " is " << static_cast<double>(values[n]);
    }
  });
  return result;
}

#ifdef TETWARP_WITH_ITK
/// As ITK reads it. @throws InputError
inline tetwarp::AnyVolume read_by_itk(const std::filesystem::path& path) {
  const auto format = path.extension() == ".mha" ? tetwarp::ItkFormat::meta : tetwarp::ItkFormat::nrrd;
  const tetwarp::ItkImageInfo info = tetwarp::itk_read_info(path, format);
  constexpr std::int64_t kLongest = 1000;  // ITK takes a negative size for a huge one
  for (int axis = 0; axis < 3; ++axis)
    tetwarp::require(info.geometry.size[axis] <= kLongest, "no size of these files, " + path.string());
  tetwarp::AnyVolume volume(info.geometry, info.type, info.components);
  tetwarp::itk_read_voxels(path, format, {volume.data(), volume.size_bytes()});
  return volume;
}
#endif

/// Reads the file of each row by us and, in builds with ITK, by ITK.
inline void expect_rows(const std::filesystem::path& path, const std::vector<ImageRow>& rows) {
  for (const ImageRow& row : rows) {
    write_file(path, row.bytes);
    tetwarp::AnyVolume ours;
    const std::string why = refusal([&] { ours = tetwarp::read_image(path); });
    EXPECT_EQ(why.empty(), row.reads == Reads::both || row.reads == Reads::we) << row.what << ": " << why;
    if (!why.empty()) {
      EXPECT_TRUE(why.starts_with("InputError: ") && why.find(path.string()) != std::string::npos) << why;
    } else if (row.counts) {
      EXPECT_TRUE(counts_from_1(ours)) << row.what;
    }
#ifdef TETWARP_WITH_ITK
    tetwarp::AnyVolume itks;
    const std::string why_itk = refusal([&] { itks = read_by_itk(path); });
    if (row.reads != Reads::both && tetwarp::itk_version() != "5.2") continue;
    if (row.reads == Reads::we && row.counts) {
      EXPECT_FALSE(why_itk.empty() && counts_from_1(itks)) << row.what;
      continue;
    }
    EXPECT_EQ(why_itk.empty(), row.reads == Reads::both || row.reads == Reads::itk) << row.what << ": " << why_itk;
    if (!why.empty() || !why_itk.empty()) continue;
    EXPECT_TRUE(same_bytes(ours, itks)) << row.what;
    EXPECT_EQ(ours.geometry(), itks.geometry()) << row.what;
#endif
  }
}
