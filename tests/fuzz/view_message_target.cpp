// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Messages of a page to the viewer.
#include "tests/fuzz/input_file.h"
#include "view/server/messages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  accepted([&] { tetwarp::viewer::read_message({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
