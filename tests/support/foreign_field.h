#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "deform/vertex_field.h"

/// Has Python write the field of an .mha file as another tool would (tests/support/make_field.py says which).
/// @return  false: Python or a library of it is missing
inline bool make_foreign_field(const std::string& kind, const std::filesystem::path& mha,
                               const std::filesystem::path& output) {
  const std::string command = "'" TETWARP_PYTHON "' '" TETWARP_MAKE_FIELD "' '" + kind + "' '" + mha.string() + "' '" +
                              output.string() + "' > /dev/null";
  const int status = std::system(command.c_str());
  if (WIFEXITED(status) && (WEXITSTATUS(status) == 77 || WEXITSTATUS(status) == 127)) return false;  // 127: no Python
  EXPECT_EQ(status, 0) << command;
  return true;
}

/// At rest but for the corner at the end of i, the begin of j and the end of k: (3, 5, 7) mm.
inline std::vector<glm::vec3> corner_displacement(const tetwarp::Geometry& grid) {
  std::vector<glm::vec3> mm(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(0));
  mm[static_cast<std::size_t>(grid.size.x - 1 + grid.size.x * grid.size.y * (grid.size.z - 1))] = {3, 5, 7};
  return mm;
}
