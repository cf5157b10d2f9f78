// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Rows of manifests of `tetwarp batch`.
#include <stdexcept>

#include "apps/batch/manifest_rows.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tetwarp::apps;
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  accepted([&] {
    ManifestErrors errors(file.path());
    const auto is_list = [](const std::string& key) { return key == "field" || key == "with"; };
    for (const ManifestRow& row : read_rows(file.path(), is_list, errors)) {
      for (const auto& [key, values] : row.values) {
        if (values.empty()) throw std::logic_error("a key without a value: " + key);
        row.text(key);
      }
    }
    errors.throw_if_any();
  });
  return 0;
}
