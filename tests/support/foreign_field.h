// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "io/field_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/write_file.h"

/// Runs a script of tests/support. @return false: Python, or a library that the script needs, is missing
inline bool run_python(const std::string& script_and_arguments) {
  const std::string command = "'" TETWARP_PYTHON "' " + script_and_arguments + " > /dev/null";
  const int status = std::system(command.c_str());
  // 77: the script lacks a library; 127: there is no Python
  if (WIFEXITED(status) && (WEXITSTATUS(status) == 77 || WEXITSTATUS(status) == 127)) return false;
  EXPECT_EQ(status, 0) << command;
  return true;
}

/// Lets Python write the field of an .mha file as another tool would (tests/support/make_field.py lists the kinds).
/// @return false: Python, or a library that the script needs, is missing
inline bool make_foreign_field(const std::string& kind, const std::filesystem::path& mha,
                               const std::filesystem::path& output) {
  return run_python("'" TETWARP_MAKE_FIELD "' '" + kind + "' '" + mha.string() + "' '" + output.string() + "'");
}

/// Displacements that are zero except at one vertex, at the end of i, the begin of j and the end of k: (3, 5, 7) mm.
inline std::vector<glm::vec3> corner_displacement(const tetwarp::Geometry& grid) {
  std::vector<glm::vec3> mm(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(0));
  mm[static_cast<std::size_t>(grid.size.x - 1 + grid.size.x * grid.size.y * (grid.size.z - 1))] = {3, 5, 7};
  return mm;
}

/// Grids to test with: one straight, one with axes exchanged and turned, and one at no right angle to anything.
inline std::vector<tetwarp::Geometry> grids() {
  tetwarp::Geometry flipped = oblique_grid();
  flipped.direction[1] = -flipped.direction[1];
  return {all_orientations()[0], all_orientations()[29], oblique_grid(), flipped};
}

inline std::string error_of(const tetwarp::FieldSource& source) {
  return refusal([&] { read_pull_field(source); });
}

/// Expects the displacements of corner_displacement. @param tolerance_mm  0: exactly the same numbers
inline void expect_corner(const tetwarp::FieldFile& field, const tetwarp::Geometry& grid, double tolerance_mm,
                          const std::string& what) {
  const std::vector<glm::vec3> expected = corner_displacement(grid);
  ASSERT_EQ(field.displacement.size(), expected.size()) << what;
  EXPECT_TRUE(same_grid(field.grid, grid, 2e-5)) << what;
  for (std::size_t v = 0; v < expected.size(); ++v) {
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(field.displacement[v][c], expected[v][c], tolerance_mm) << what << " vertex " << v;
  }
}

/// Changes every byte of a header, one at a time: each file must be read or refused, and nothing else may happen.
inline void expect_read_or_refused(const std::string& good, std::size_t header_bytes,
                                   const tetwarp::FieldSource& source) {
  for (std::size_t at = 0; at < header_bytes; ++at) {
    for (const char byte : {'9', '\x7f', '\xff'}) {
      std::string bytes = good;
      bytes[at] = byte;
      write_file(source.path, bytes);
      const std::string text = error_of(source);
      EXPECT_TRUE(text.empty() || text.starts_with("InputError: ")) << "byte " << at << ": " << text;
    }
  }
}
