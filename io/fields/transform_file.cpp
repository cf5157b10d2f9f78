// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/transform_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "deform/errors.h"
#include "io/fields/niftyreg_spline.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"
#include "io/opened_file.h"
#ifdef TETWARP_WITH_ITK
#include "io/files/module.h"
#include "itkbridge/transform_file.h"
#endif

namespace tetwarp {

namespace {

bool has_transform_suffix(const std::filesystem::path& path) {
  const std::string suffix = lower(path.extension().string());
  constexpr std::array<std::string_view, 4> kSuffixes = {".h5", ".hdf5", ".tfm", ".txt"};
  return std::ranges::find(kSuffixes, suffix) != kSuffixes.end();
}

#ifdef TETWARP_WITH_ITK
const char* name_of(TransformTool tool) {
  if (tool == TransformTool::elastix) return "elastix";
  return tool == TransformTool::plastimatch ? "plastimatch" : "ITK";
}

/// ITK's transforms come in a module of their own: their libraries would take their time of every start.
/// @param path  of the file that needs it
template <class Function>
Function* in_module(const char* name, const std::filesystem::path& path) {
  auto* const function = reinterpret_cast<Function*>(find_in_module(TETWARP_TRANSFORM_MODULE, name));
  if (!function) refuse_without_module("transform files", TETWARP_TRANSFORM_MODULE, path.string(), "");
  return function;
}

LoadedTransform load_transform(const std::filesystem::path& path, const std::stop_token& stop) {
  LoadedTransform loaded;
  in_module<decltype(tetwarp_load_transform)>("tetwarp_load_transform", path)(path, stop, loaded);
  return loaded;
}

TransformFile read_with_itk(const std::filesystem::path& path, const std::stop_token& stop) {
  LoadedTransform loaded = load_transform(path, stop);
  const StoredTransform& stored = loaded.stored;
  const std::string file = path.string();
  TransformFile result{.tool = name_of(stored.tool),
                       .classes = {},
                       .pulls = stored.tool != TransformTool::itk,
                       .displacement = {},
                       .beyond = "where ITK does not move them",
                       .outside = std::make_shared<std::atomic<std::uint64_t>>(0)};
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

void add_named_files(const std::filesystem::path& path, std::vector<std::filesystem::path>& files) {
  in_module<decltype(tetwarp_transform_files)>("tetwarp_transform_files", path)(path, files);
}
#else
TransformFile read_with_itk(const std::filesystem::path& path, const std::stop_token&) {
  throw NotCompiled("transform files need ITK, which this build does not have, " + path.string());
}

void add_named_files(const std::filesystem::path&, std::vector<std::filesystem::path>&) {}
#endif

}  // namespace

bool is_transform_file(const std::filesystem::path& path) {
  if (has_transform_suffix(path)) return true;
  if (image_format(path) != ImageFormat::nifti || !is_file(path)) return false;
  try {
    return is_niftyreg_spline(read_nifti_header(path));
  } catch (const InputError&) {
    return false;  // whoever takes it for a volume or a field says why
  }
}

std::vector<std::filesystem::path> files_of_transform(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files = {path};
  if (image_format(path) != ImageFormat::nifti) add_named_files(path, files);
  return files;
}

TransformFile read_transform_file(const std::filesystem::path& path, const std::stop_token& stop) {
  return image_format(path) == ImageFormat::nifti ? read_niftyreg_spline(path) : read_with_itk(path, stop);
}

}  // namespace tetwarp
