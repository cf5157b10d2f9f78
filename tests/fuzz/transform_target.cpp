// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transform files: ITK's text, HDF5 and .mat, elastix's parameters in both forms, plastimatch's B-spline, matrices,
// LTA. The content decides which. kFuzzOptions: what is said behind the name, one reading per text.
#include "io/transform_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  for (const char* const* options = kFuzzOptions; *options; ++options) {
    accepted([&] {
      const auto transform = tetwarp::read_transform_file(tetwarp::parse_field_source(file.path().string() + *options));
      for (const double along : {0.0, -31.5, 1e6}) {
        accepted([&] { transform.displacement({along, -along, 0.5 * along}); });
      }
    });
  }
  return 0;
}
