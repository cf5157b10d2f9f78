// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "bench/paper/inverse.h"
#include "bench/paper/method.h"

namespace tetwarp::bench {

/// What the paper prints of its own measurements (Sensors 2022, 22, 6276): every cell of its Tables 1 to 4, Appendix A,
/// and what it counts. Times are ms, the mean of 500 frames of 512 x 512 x N voxels; they hold the deformation's
/// formula, the inverse and the sampling, and not the picture.
enum class PublishedGpu : std::uint8_t { rtx_2080, gtx_1650_mobile };

/// Table 1: a data set of 512 x 512 voxels a slice.
struct PublishedData {
  const char* name;
  std::int64_t slices;
  double megabytes;
};

/// One time of Tables 2 to 4. Some stand in two tables: Table 3 (a) is Table 2 (c), and Table 4 repeats the abdomen.
struct PublishedTime {
  int table;
  char column;            ///< a, b or c, from the left; of Table 4 the paper gives the columns no letters
  Method method;          ///< ours by the same name; the paper's has the inverse for every candidate voxel
  const char* transform;  ///< wave, twist or bubble
  const char* data;       ///< of Table 1
  PublishedGpu gpu;
  double ms;
};

/// How many times as fast the last column of a table is as the first, as printed.
struct PublishedSpeedUp {
  int table;
  Method slow, fast;
  const char* transform;
  PublishedGpu gpu;
  double ratio;
};

/// What the text counts and claims.
struct PublishedClaim {
  /// What of ours stands beside it; nothing beside a picture and what others' methods need.
  enum class About : std::uint8_t { frames_a_second, picture, tetrahedra, bytes_a_thread, differences, others };

  About about;
  const char* what;
  const char* printed;
};

/// Eqs. 8 to 10 and Appendix A: a tetrahedron far from the origin, the determinant of its 4 x 4 matrix, and the first
/// four numbers of the inverse, which are its first column.
struct PublishedAppendix {
  Corners<double> corners;
  double determinant_in_double, determinant_in_float;
  std::array<double, 4> inverse_in_double, inverse_in_float;
};

constexpr std::int64_t kPublishedColumns = 512, kPublishedRows = 512;
constexpr int kPublishedFrames = 500;

std::span<const PublishedData> published_data();
std::span<const PublishedTime> published_times();
std::span<const PublishedSpeedUp> published_speed_ups();
std::span<const PublishedClaim> published_claims();
const PublishedAppendix& published_appendix();

/// @throws InputError for a name that Table 1 has not
const PublishedData& published_data(const std::string& name);

/// "GeForce RTX 2080".
std::string name_of(PublishedGpu gpu);

}  // namespace tetwarp::bench
