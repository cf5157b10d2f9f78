// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a command line says of a field: a formula, or a file with options.
#include <string_view>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tetwarp::Geometry kVolume = {.size = {20, 16, 12}, .spacing = {0.75, 0.5, 2}, .origin = {-7, 3, 1}};
  const std::string text(reinterpret_cast<const char*>(data), size);
  accepted([&] { tetwarp::parse_field_source(text); });
  if (!tetwarp::is_formula(text)) return 0;
  accepted([&] {
    const tetwarp::PointMap map = tetwarp::parse_formula(text, kVolume);
    for (const double along : {0.0, 3.25, -1e6}) map({along, 2 * along, 1 - along});
  });
  return 0;
}
