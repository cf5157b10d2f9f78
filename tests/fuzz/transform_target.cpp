// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transform files: ITK's text and HDF5, elastix's parameters, plastimatch's B-spline. The content decides which.
#include "io/transform_file.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(TETWARP_FUZZ_SUFFIX);
  file.fill(data, size);
  accepted([] {
    const auto transform = tetwarp::read_transform_file(file.path());
    for (const double along : {0.0, -31.5, 1e6}) {
      accepted([&] { transform.displacement({along, -along, 0.5 * along}); });
    }
  });
  return 0;
}
