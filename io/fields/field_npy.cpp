// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_npy.h"

#include <fstream>

#include "io/fields/shared/numpy_array.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"

namespace tetwarp {
namespace {

bool recognizes(const std::filesystem::path& path, std::string_view first_bytes) {
  return lower(path.extension().string()) == ".npy" || first_bytes.starts_with("\x93NUMPY");
}

void check_options(const FieldSource& source) { check_numpy_options(source); }

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  check_options(source);
  require_readable_file(source.path);
  const auto opened = [path = source.path]() -> std::unique_ptr<std::istream> {
    return std::make_unique<std::ifstream>(path, std::ios::binary);
  };
  const NumpyArray array = read_numpy_header(*opened(), std::filesystem::file_size(source.path), source.path.string());
  return numpy_reader(source, array, "NumPy array", opened);
}

}  // namespace

const FieldFormat kFieldFormat_npy = {recognizes, nullptr, check_options, open};

}  // namespace tetwarp
