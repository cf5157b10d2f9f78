// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <zlib.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/vec3.hpp>
#include <iterator>
#include <string>
#include <vector>

#include "deform/volume.h"

/// The 48 ways to lay i, j, k along the patient's axes, with a spacing and origin that no format holds by luck.
inline std::vector<tetwarp::Geometry> all_orientations() {
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  std::vector<tetwarp::Geometry> grids;
  for (const auto& order : kOrders) {
    for (int signs = 0; signs < 8; ++signs) {
      tetwarp::Geometry grid;
      grid.size = {4, 3, 5};
      grid.spacing = {1.95312, 0.1, 1.0 / 3};
      grid.origin = {-228.8, 17.123456789, 1e-3};
      grid.direction = glm::dmat3(0);
      for (int axis = 0; axis < 3; ++axis) grid.direction[axis][order[axis]] = signs >> axis & 1 ? -1 : 1;
      grids.push_back(grid);
    }
  }
  return grids;
}

/// A grid turned by 0.3 about z and 0.2 about x, none of whose numbers is round.
inline tetwarp::Geometry oblique_grid() {
  const double a = std::cos(0.3), b = std::sin(0.3), c = std::cos(0.2), d = std::sin(0.2);
  tetwarp::Geometry grid = all_orientations().front();
  grid.direction = glm::dmat3(a, b, 0, -b * c, a * c, d, b * d, -a * d, c);
  return grid;
}

/// A volume in which every byte differs from its neighbours.
inline tetwarp::AnyVolume numbered(const tetwarp::Geometry& grid, tetwarp::VoxelType type, int components = 1) {
  tetwarp::AnyVolume volume(grid, type, components);
  tetwarp::dispatch(type, [&](auto v) {
    using V = decltype(v);
    const auto values = volume.as<V>();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<V>(37 * i % 101);
    values[0] = std::numeric_limits<V>::lowest();
    values[1] = std::numeric_limits<V>::max();
    values[2] = std::numeric_limits<V>::min();
  });
  return volume;
}

inline bool same_bytes(const tetwarp::AnyVolume& a, const tetwarp::AnyVolume& b) {
  return a.type() == b.type() && a.components() == b.components() && a.size_bytes() == b.size_bytes() &&
         std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void write_gzipped(const std::filesystem::path& path, const std::string& bytes) {
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
}

template <class T>
void put(std::string& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
}
template <class T>
T get(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

/// What `action` throws, as text: "TYPE: MESSAGE"; empty if it throws nothing.
template <class Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const tetwarp::InputError& error) {
    return std::string("InputError: ") + error.what();
  } catch (const tetwarp::Error& error) {
    return std::string("Error: ") + error.what();
  }
  return {};
}
