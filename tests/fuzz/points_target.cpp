// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Files of points of one suffix: read, written again as they are, and read back.
#include <stdexcept>

#include "io/points_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  for (const auto told : {std::optional<tetwarp::PointFrame>(), {tetwarp::PointFrame::ras}}) {
    accepted([&] {
      const tetwarp::PointsFile read(file.path(), told);
      const std::vector<tetwarp::PointStatus> status(read.points().size(), tetwarp::PointStatus::moved);
      read.write(file.written(), read.points(), status);
      std::size_t count = 0;
      const bool again = accepted([&] { count = tetwarp::PointsFile(file.written(), told).points().size(); });
      if (!again || count != read.points().size()) throw std::logic_error("what was written cannot be read back");
    });
  }
  return 0;
}
