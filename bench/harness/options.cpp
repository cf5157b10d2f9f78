// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/options.h"

#include <algorithm>
#include <cstdio>

namespace tetwarp::bench {

namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

bool Options::has_field(const std::string& name) const { return contains(fields, name); }
bool Options::has_peer(const std::string& name) const { return contains(peers, name); }

void Options::say(const std::string& line) const {
  if (verbose) std::fprintf(stderr, "%s\n", line.c_str());
}

Options default_options(const std::string& family) {
  const std::vector<std::int64_t> larger_cells{4, 8, 16};
  if (family == "paper")  // our fields, and the paper's as they are written: bench/paper/fields.h
    return {.input = {.slices = {141, 300, 316, 600}},
            .fields = {"identity", "wave", "twist", "bubble", "wave-paper-1", "wave-paper-16", "twist-paper-1",
                       "twist-paper-16", "bubble-paper-1", "bubble-paper-16"},
            .methods = {"inverse4x4-double", "inverse3x3-double", "inverse3x3-float", "paper",
                        "inverse4x4-double-per-voxel", "inverse3x3-double-per-voxel", "inverse3x3-float-per-voxel",
                        "paper-per-voxel", "tetwarp"},
            .cell_sizes = larger_cells};
  if (family == "gpu")  // everything on the first volume, one field on the others
    return {.input = {.slices = {300, 600}},
            .fields = {"identity", "wave", "twist", "bubble", "elastic", "noise", "rotation", "folds", "local"},
            .cell_sizes = larger_cells,
            .frames = 15};
  if (family == "cpu")
    return {.fields = {"identity", "wave", "twist", "bubble", "elastic", "local"},
            .peers = {"paper", "itk-warp", "itk-invert", "vtk-probe"},
            .cell_sizes = larger_cells};
  if (family == "invert")
    return {.input = {.width = 256, .slices = {150}},
            .fields = {"wave", "twist", "bubble", "folds"},
            .peers = {"itk-invert", "itk-invert-free", "itk-iterative"}};
  if (family == "io") return {.steps = {"in", "out", "nifti", "job"}, .cell_sizes = {1, 16}, .repeats = 5};
  if (family == "itk")
    return {.fields = {"bubble", "elastic"},
            .tasks = {"pull", "forward", "invert", "determinant", "transform", "stream"},
            .cell_sizes = {1, 4}};
  require(family == "simulate", "no family of measurements \"" + family + "\"");
  return {.methods = {"chainmail", "mass-spring"}, .backends = {"cpu"}, .frames = 60};
}

}  // namespace tetwarp::bench
