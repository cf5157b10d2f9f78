// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nrrd_names.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

template <class Value>
std::optional<Value> value_of(const std::map<std::string, Value>& names, const std::string& name) {
  const auto found = names.find(name);
  return found == names.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

VoxelType nrrd_type(const std::string& name, const std::string& file) {
  static const std::map<std::string, VoxelType> kTypes = {{"signed char", VoxelType::i8},
                                                          {"int8", VoxelType::i8},
                                                          {"int8_t", VoxelType::i8},
                                                          {"uchar", VoxelType::u8},
                                                          {"unsigned char", VoxelType::u8},
                                                          {"uint8", VoxelType::u8},
                                                          {"uint8_t", VoxelType::u8},
                                                          {"short", VoxelType::i16},
                                                          {"short int", VoxelType::i16},
                                                          {"signed short", VoxelType::i16},
                                                          {"signed short int", VoxelType::i16},
                                                          {"int16", VoxelType::i16},
                                                          {"int16_t", VoxelType::i16},
                                                          {"ushort", VoxelType::u16},
                                                          {"unsigned short", VoxelType::u16},
                                                          {"unsigned short int", VoxelType::u16},
                                                          {"uint16", VoxelType::u16},
                                                          {"uint16_t", VoxelType::u16},
                                                          {"int", VoxelType::i32},
                                                          {"signed int", VoxelType::i32},
                                                          {"int32", VoxelType::i32},
                                                          {"int32_t", VoxelType::i32},
                                                          {"uint", VoxelType::u32},
                                                          {"unsigned int", VoxelType::u32},
                                                          {"uint32", VoxelType::u32},
                                                          {"uint32_t", VoxelType::u32},
                                                          {"float", VoxelType::f32},
                                                          {"double", VoxelType::f64}};
  static const std::map<std::string, const char*> kOthers = {{"longlong", "int64"},
                                                             {"long long", "int64"},
                                                             {"long long int", "int64"},
                                                             {"signed long long", "int64"},
                                                             {"signed long long int", "int64"},
                                                             {"int64", "int64"},
                                                             {"int64_t", "int64"},
                                                             {"ulonglong", "uint64"},
                                                             {"unsigned long long", "uint64"},
                                                             {"unsigned long long int", "uint64"},
                                                             {"uint64", "uint64"},
                                                             {"uint64_t", "uint64"},
                                                             {"block", "block"}};
  const std::string key = lower(name);
  if (const auto type = value_of(kTypes, key)) return *type;
  const auto other = value_of(kOthers, key);
  throw InputError("voxels of type " + (other ? *other : "\"" + shown(name.substr(0, 60)) + "\"") + ", " + file +
                   "; expected integers of 8 to 32 bits, float32 or float64");
}

const char* nrrd_type_name(VoxelType type) {
  constexpr std::array<const char*, 8> kNames = {"unsigned char", "signed char", "unsigned short", "short",
                                                 "unsigned int",  "int",         "float",          "double"};
  return kNames[static_cast<std::size_t>(type)];
}

std::optional<NrrdKind> nrrd_kind(const std::string& name) {
  const NrrdKind place, numbers{false, 0}, two{false, 2}, three{false, 3}, four{false, 4}, one{false, 1};
  const NrrdKind complex{false, 2, "complex"}, rgb{false, 3, "rgb"}, rgba{false, 4, "rgba"},
      tensor{false, 6, "symmetric_second_rank_tensor"}, masked_tensor{false, 7, "symmetric_second_rank_tensor"};
  static const std::map<std::string, NrrdKind> kKinds = {{"none", place},
                                                         {"???", place},
                                                         {"domain", place},
                                                         {"space", place},
                                                         {"time", place},
                                                         {"list", numbers},
                                                         {"point", numbers},
                                                         {"vector", numbers},
                                                         {"contravariant-vector", numbers},
                                                         {"covariant-vector", numbers},
                                                         {"normal", numbers},
                                                         {"stub", one},
                                                         {"scalar", one},
                                                         {"complex", complex},
                                                         {"2-vector", two},
                                                         {"3-color", rgb},
                                                         {"rgb-color", rgb},
                                                         {"rgbcolor", rgb},
                                                         {"rgb", rgb},
                                                         {"hsv-color", three},
                                                         {"hsvcolor", three},
                                                         {"hsv", three},
                                                         {"xyz-color", three},
                                                         {"4-color", rgba},
                                                         {"rgba-color", rgba},
                                                         {"rgbacolor", rgba},
                                                         {"rgba", rgba},
                                                         {"3-vector", three},
                                                         {"3-gradient", three},
                                                         {"3-normal", three},
                                                         {"4-vector", four},
                                                         {"quaternion", four}};
  std::string key = lower(name);
  if (const auto kind = value_of(kKinds, key)) return kind;
  // Matrices, "2D-sym-matrix" say: a matrix is a tensor too, and what is symmetric may say so in full.
  static const std::map<std::string, NrrdKind> kMatrices = {
      {"2d-sym-matrix", three},  {"2d-masked-sym-matrix", four},
      {"2d-matrix", four},       {"2d-masked-matrix", {false, 5}},
      {"3d-sym-matrix", tensor}, {"3d-masked-sym-matrix", masked_tensor},
      {"3d-matrix", {false, 9}}, {"3d-masked-matrix", {false, 10, "masked matrices"}}};
  constexpr std::string_view kSymmetric = "symmetric", kTensor = "-tensor";
  if (const auto at = key.find(kSymmetric); at != std::string::npos) key.replace(at, kSymmetric.size(), "sym");
  if (key.ends_with(kTensor)) key.replace(key.size() - kTensor.size(), kTensor.size(), "-matrix");
  return value_of(kMatrices, key);
}

std::optional<NrrdSpace> nrrd_space(const std::string& name) {
  static const std::map<std::string, NrrdSpace> kShort = {{"ras", {"ras", 3}},
                                                          {"las", {"las", 3}},
                                                          {"lps", {"lps", 3}},
                                                          {"rast", {"right-anterior-superior-time", 4}},
                                                          {"last", {"left-anterior-superior-time", 4}},
                                                          {"lpst", {"left-posterior-superior-time", 4}},
                                                          {"scanner-xyz", {"scanner-xyz", 3}},
                                                          {"scanner-xyz-time", {"scanner-xyz-time", 4}},
                                                          {"scanner-xyzt", {"scanner-xyz-time", 4}}};
  const std::string key = lower(name);
  if (const auto space = value_of(kShort, key)) return space;
  // Longer names have hyphens, or blanks, or nothing between their words.
  for (const auto& [words, found] :
       std::initializer_list<std::pair<std::string, std::string>>{{"right-anterior-superior", "ras"},
                                                                  {"left-anterior-superior", "las"},
                                                                  {"left-posterior-superior", "lps"},
                                                                  {"3d-right-handed", ""},
                                                                  {"3d-left-handed", ""}}) {
    for (const bool with_time : {false, true}) {
      const std::string whole = words + (with_time ? "-time" : "");
      std::string blanks = whole, nothing = whole;
      std::ranges::replace(blanks, '-', ' ');
      std::erase(nothing, '-');
      if (key == whole || key == blanks || key == nothing)
        return NrrdSpace{with_time || found.empty() ? whole : found, with_time ? 4 : 3};
    }
  }
  return {};
}

std::optional<Encoding> nrrd_encoding(const std::string& name) {
  static const std::map<std::string, Encoding> kEncodings = {
      {"raw", Encoding::raw},    {"txt", Encoding::text},  {"text", Encoding::text},
      {"ascii", Encoding::text}, {"hex", Encoding::hex},   {"gz", Encoding::gzip},
      {"gzip", Encoding::gzip},  {"bz2", Encoding::bzip2}, {"bzip2", Encoding::bzip2}};
  return value_of(kEncodings, lower(name));
}

}  // namespace tetwarp
