// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Field files of one suffix, and volumes where the suffix is theirs. kFuzzOptions: what is said behind the name
// of a field that does not say it itself, one reading per text.
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

/// NrrdIO of ITK 5.2.1 loses the words of its errors.
extern "C" const char* __lsan_default_suppressions() { return "leak:libITKNrrdIO"; }

namespace {

/// A file without a grid of its own is taken for a volume of its size.
void read_field(tetwarp::FieldSource source) {
  const auto header = tetwarp::read_field_header(source);
  if (!header.has_own_grid) {
    source.grid.emplace();
    source.grid->size = header.grid.size;
  }
  accepted([&] { tetwarp::read_forward_field(source); });
  tetwarp::read_pull_field(source);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  if (tetwarp::has_image_suffix(file.path())) accepted([] { tetwarp::read_image(file.path()); });
  asked([] { tetwarp::is_field_file(file.path()); });
  for (const char* const* options = kFuzzOptions; *options; ++options) {
    accepted([&] { read_field(tetwarp::parse_field_source(file.path().string() + *options)); });
  }
  return 0;
}
