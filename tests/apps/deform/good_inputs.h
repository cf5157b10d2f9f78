// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp::test {

/// A series or volume of the real data that can be deformed, or a slice that can be deformed as a stack of two.
struct GoodInput {
  std::string name;                ///< name of the test
  std::filesystem::path at;        ///< folder or file below $TETWARP_TEST_DATA
  int number = 1;                  ///< number of the series, as --series takes it
  const char* dcm2niix = nullptr;  ///< the reason, where dcm2niix disagrees with the identity; null: it agrees
  bool thinned = false;            ///< only some of its slices are deformed, since the whole takes too long
  bool alike = false;              ///< it differs from an earlier input only in how its pixels are coded
};

inline void PrintTo(const GoodInput& input, std::ostream* out) { *out << input.at.string() << " " << input.number; }

/// Series of several slices.
std::vector<GoodInput> good_series();
/// DICOM files of one slice that belongs to no series of several slices.
std::vector<GoodInput> good_slices();
/// Volume files.
std::vector<GoodInput> good_files();

/// The folder that $TETWARP_TEST_DATA names; empty if it is not set.
std::filesystem::path test_data();

}  // namespace tetwarp::test
