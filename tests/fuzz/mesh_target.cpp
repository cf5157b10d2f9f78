// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Mesh files of one suffix: whether it is one, its header, and the whole of it, as it is, as its own deformed mesh, and
// under each text of kFuzzOptions.
#include "io/mesh_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

namespace {

void read_mesh(const std::string& text) {
  const auto source = tetwarp::parse_field_source(text);
  asked([&] { tetwarp::read_mesh_header(source); });
  accepted([&] { tetwarp::read_mesh_file(source); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  asked([] { tetwarp::is_mesh_file(file.path()); });
  read_mesh(file.path().string());
  read_mesh(file.path().string() + ":deformed=" + file.path().string());
  for (const char* const* options = kFuzzOptions; *options; ++options) read_mesh(file.path().string() + *options);
  return 0;
}
