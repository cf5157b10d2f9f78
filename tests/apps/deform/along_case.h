// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "io/dicom_dose.h"
#include "io/dicom_segmentation.h"
#include "io/image_file.h"
#include "tests/support/dicom/dose_maker.h"
#include "tests/support/dicom/seg_maker.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

/// A made-up CT series of 12 x 10 x 6 voxels, and objects that may go along with it.
struct AlongCase {
  static constexpr int kColumns = 12, kRows = 10, kSlices = 6, kVoxels = kColumns * kRows * kSlices;
  Scratch scratch;

  AlongCase() {
    write_ct([](MadeSlice&) {});
  }

  void write_ct(const std::function<void(MadeSlice&)>& change) const {
    write_stack(scratch / "ct", kSlices, [&](int k, MadeSlice& slice) {
      slice.columns = kColumns;
      slice.rows = kRows;
      for (int n = 0; n < kColumns * kRows; ++n) slice.words.push_back(static_cast<std::uint16_t>(n * 7 + k * 50));
      change(slice);
    });
  }

  static tetwarp::Geometry grid() {
    return {{kColumns, kRows, kSlices}, {0.5, 0.75, 2.5}, {-10, -20, 30}, glm::dmat3(1)};
  }

  /// A dose on the grid of the series, with another value in every voxel.
  static MadeDose dose() {
    MadeDose made{.frames = "6", .offsets = "0\\2.5\\5\\7.5\\10\\12.5", .position = "-10\\-20\\30"};
    made.columns = kColumns;
    made.rows = kRows;
    made.count = kVoxels;
    made.spacing = "0.75\\0.5";
    made.stored = [](unsigned n) { return n * 7919 % 40009; };
    return made;
  }

  /// Two segments that overlap, and leave slices out.
  static int organs(int segment, int i, int j, int k) {
    if (segment == 0) return (i - 5) * (i - 5) + (j - 4) * (j - 4) + 3 * (k - 2) * (k - 2) < 14 ? 1 : 0;
    return k >= 2 && k != 4 && i >= 4 && i < 10 && j >= 3 && j < 8 ? 1 : 0;
  }
  static MadeSeg seg() {
    MadeSeg made;
    made.columns = kColumns;
    made.rows = kRows;
    made.slices = kSlices;
    made.value = organs;
    return made;
  }
  /// A fractional segmentation of the same segments.
  static MadeSeg fractions() {
    MadeSeg made = seg();
    made.fractional = true;
    made.largest = 200;
    made.value = [](int n, int i, int j, int k) { return organs(n, i, j, k) * (200 - 9 * i - 3 * j); };
    return made;
  }

  /// Writes a segment of a segmentation as an image on the grid of the series.
  void write_mask(const MadeSeg& made, int segment, const std::string& name) const {
    tetwarp::Volume<std::uint8_t> mask{grid(), {}};
    for (int n = 0; n < kVoxels; ++n)
      mask.voxels.push_back(
          static_cast<std::uint8_t>(made.value(segment, n % kColumns, n / kColumns % kRows, n / (kColumns * kRows))));
    tetwarp::write_image(scratch / name, view(std::as_const(mask)));
  }

  tetwarp::AnyVolume image(const std::string& name) const { return tetwarp::read_image(scratch / name); }

  void run(const std::string& arguments, int status = 0) const {
    const Outcome outcome = run_tetwarp(scratch.path(), arguments);
    ASSERT_EQ(outcome.status, status) << arguments << "\n" << outcome.err;
  }
  std::string said(const std::string& arguments, int status) const {
    const Outcome outcome = run_tetwarp(scratch.path(), arguments);
    EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.err;
    return outcome.err;
  }
  nlohmann::json with(const std::string& sidecar) const {
    return nlohmann::json::parse(read_text(scratch / sidecar))["with"];
  }

  /// Runs check_along.py with `object` of `source` and the series "out", and returns its exit status.
  int check(const std::string& object, const std::string& source, const std::string& dump) const {
    return run_program(scratch.path(), TETWARP_PYTHON,
                       "'" TETWARP_CHECK_ALONG "' out '" + object + "' '" + source + "' " + dump)
        .status;
  }
  std::string findings() const { return read_text(scratch / ".stdout") + read_text(scratch / ".stderr"); }

  template <class V>
  std::vector<V> dumped(const std::string& name) const {
    const std::string bytes = read_text(scratch / name);
    std::vector<V> values(bytes.size() / sizeof(V));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(V));
    return values;
  }
};

/// Runs a check of AlongCase; the test is skipped where pydicom is missing.
#define TETWARP_CHECK_ALONG_WITH(kase, object, source, dump)                         \
  do {                                                                               \
    const int checked = (kase).check((object), (source), (dump));                    \
    if (checked == 77) GTEST_SKIP() << "no pydicom or NumPy: " << (kase).findings(); \
    ASSERT_EQ(checked, 0) << (object) << ": " << (kase).findings();                  \
  } while (false)
