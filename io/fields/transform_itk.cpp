// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_itk.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "deform/errors.h"
#include "io/lower_case.h"
#ifdef TETWARP_WITH_ITK
#include "io/files/module.h"
#include "itkbridge/transform_file.h"
#endif

namespace tetwarp {
namespace {

bool recognizes(const std::filesystem::path& path, std::string_view) {
  const std::string suffix = lower(path.extension().string());
  constexpr std::array<std::string_view, 6> kSuffixes = {".h5", ".hdf5", ".tfm", ".txt", ".mat", ".toml"};
  return std::ranges::find(kSuffixes, suffix) != kSuffixes.end();
}

#ifdef TETWARP_WITH_ITK
const char* name_of(TransformTool tool) {
  if (tool == TransformTool::elastix) return "elastix";
  return tool == TransformTool::plastimatch ? "plastimatch" : "ITK";
}

/// A function of the module with ITK's transforms. It is a module of its own since loading ITK's libraries would slow
/// every start of the program.
/// @param path  the file to read, for the message where the module is missing
template <class Function>
Function* in_module(const char* name, const std::filesystem::path& path) {
  return function_in_module<Function>(TETWARP_TRANSFORM_MODULE, name, "transform files", path.string());
}

TransformFile read(const FieldSource& source, const std::stop_token& stop) {
  const std::string file = source.path.string();
  LoadedTransform loaded;
  in_module<decltype(tetwarp_load_transform)>("tetwarp_load_transform", source.path)(source.path, stop, loaded);
  const StoredTransform& stored = loaded.stored;
  TransformFile result;
  result.tool = name_of(stored.tool);
  if (stored.tool != TransformTool::itk) result.direction = Direction::pull;
  result.affine = loaded.affine;
  result.beyond = "where ITK does not move them";
  result.outside = std::make_shared<std::atomic<std::uint64_t>>(0);
  for (const TransformRecord& part : stored.parts) {
    result.classes.push_back(part.type);
    result.parameters += part.parameters.size();
  }
  result.displacement = [transform = std::move(loaded.map), outside = result.outside, file](const glm::dvec3& point) {
    bool is_outside = false;
    const glm::dvec3 by = transform(point, is_outside) - point;
    if (is_outside) outside->fetch_add(1, std::memory_order_relaxed);
    const glm::vec3 stored_by(by);
    require(std::isfinite(stored_by.x) && std::isfinite(stored_by.y) && std::isfinite(stored_by.z),
            "a point is moved to infinity, " + file);
    return by;
  };
  return result;
}

void add_files(const FieldSource& source, std::vector<std::filesystem::path>& files) {
  in_module<decltype(tetwarp_transform_files)>("tetwarp_transform_files", source.path)(source.path, files);
}
#else
TransformFile read(const FieldSource& source, const std::stop_token&) {
  throw NotCompiled("transform files need ITK, which this build does not have, " + source.path.string());
}

void add_files(const FieldSource&, std::vector<std::filesystem::path>&) {}
#endif

}  // namespace

const TransformFormat kTransformFormat_itk = {recognizes, nullptr, nullptr, read, add_files};

}  // namespace tetwarp
