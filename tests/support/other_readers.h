#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "deform/volume.h"

namespace tetwarp::test {

struct Run {
  int status = -1;
  std::string output;  ///< both streams
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

/// Where the one voxel is that is brighter than all others, LPS mm; none if there are several.
inline std::optional<glm::dvec3> brightest(const Volume<std::int16_t>& volume) {
  const auto largest = std::max_element(volume.voxels.begin(), volume.voxels.end());
  if (std::count(largest, volume.voxels.end(), *largest) != 1) return std::nullopt;
  const std::int64_t n = largest - volume.voxels.begin();
  const glm::i64vec3& size = volume.geometry.size;
  return point_from_index(volume.geometry)(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
}

/// Runs check_geometry.py: whether pydicom or dcm2niix see the voxels of a series where we do. A reader that is not
/// there skips the test.
inline void check_with(const std::string& reader, const std::filesystem::path& folder,
                       const Volume<std::int16_t>& volume, const std::filesystem::path& expected_file) {
  const Geometry& g = volume.geometry;
  std::ofstream expected(expected_file);
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
  if (const auto place = brightest(volume)) list("brightest", std::vector{place->x, place->y, place->z});
  expected << "\"hu_sum\": " << std::accumulate(volume.voxels.begin(), volume.voxels.end(), std::int64_t{0}) << '}';
  expected.close();
  const Run run = run_command(TETWARP_PYTHON " " TETWARP_CHECK_GEOMETRY " " + reader + " " + quoted(folder) + " " +
                              quoted(expected_file));
  if (run.status == 77 || run.status == 127) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_NE(run.output.find("corners agree"), std::string::npos) << run.output;
}

}  // namespace tetwarp::test
