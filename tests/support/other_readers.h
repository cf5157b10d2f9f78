// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "deform/volume.h"

namespace tetwarp::test {

struct Run {
  int status = -1;
  std::string output;  ///< standard output and standard error together
};

inline Run run_command(const std::string& command) {
  Run run;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (!pipe) return run;
  char buffer[4096];
  for (std::size_t count; (count = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) run.output.append(buffer, count);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) run.status = WEXITSTATUS(status);
  return run;
}

inline std::string quoted(const std::filesystem::path& path) {
  return std::string("'").append(path.string()).append("'");
}

inline bool is_installed(const std::string& program) { return run_command("command -v " + program).status == 0; }

/// Writes a volume in the form that check_geometry.py reads: FILE, and its voxels in FILE.raw.
inline void write_expected(const Volume<std::int16_t>& volume, const std::filesystem::path& file) {
  const std::string voxels = file.string() + ".raw";
  std::ofstream(voxels, std::ios::binary)
      .write(reinterpret_cast<const char*>(volume.voxels.data()),
             static_cast<std::streamsize>(volume.voxels.size() * sizeof(std::int16_t)));
  const Geometry& g = volume.geometry;
  std::ofstream expected(file);
  expected.precision(17);
  const auto list = [&](const char* name, const auto& values) {
    expected << '"' << name << "\": [";
    for (std::size_t n = 0; n < values.size(); ++n) expected << (n ? ", " : "") << values[n];
    expected << "], ";
  };
  std::vector<double> direction;
  for (int c = 0; c < 3; ++c) direction.insert(direction.end(), &g.direction[c].x, &g.direction[c].x + 3);
  expected << '{';
  list("size", std::vector{g.size.x, g.size.y, g.size.z});
  list("spacing", std::vector{g.spacing.x, g.spacing.y, g.spacing.z});
  list("origin", std::vector{g.origin.x, g.origin.y, g.origin.z});
  list("direction", direction);
  expected << "\"voxels\": " << '"' << voxels << "\"}";
}

/// Runs check_geometry.py. It compares what pydicom, dcm2niix or nibabel (several with commas) make of a series or a
/// NIfTI file with a file of write_expected() or another NIfTI file.
inline Run check_geometry(const std::string& readers, const std::filesystem::path& path,
                          const std::filesystem::path& expected) {
  return run_command(TETWARP_PYTHON " " TETWARP_CHECK_GEOMETRY " " + readers + " " + quoted(path) + " " +
                     quoted(expected));
}

/// Whether a run of a script says that a reader is missing.
inline bool is_missing(const Run& run) { return run.status == 77 || run.status == 127; }

/// Expects that pydicom or dcm2niix see every voxel of a series where and as this project does. If the reader is not
/// installed the test is skipped.
inline void check_with(const std::string& reader, const std::filesystem::path& folder,
                       const Volume<std::int16_t>& volume, const std::filesystem::path& expected_file) {
  write_expected(volume, expected_file);
  const Run run = check_geometry(reader, folder, expected_file);
  if (is_missing(run)) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_NE(run.output.find("voxels agree"), std::string::npos) << run.output;
}

}  // namespace tetwarp::test
