// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transfer functions: read, and looked through at a few voxels.
#include <utility>

#include "deform/render/renderer.h"
#include "io/transfer_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

namespace {

void look_through(const tetwarp::TransferFunction& transfer) {
  static const tetwarp::Geometry kGrid = {.size = {3, 3, 3}, .spacing = {2, 2, 3}, .origin = {-7, 3, 1}};
  static const tetwarp::Volume<std::int16_t> kVolume{
      kGrid,
      {-1000, 0, 40, 700, 3000, -32768, 32767, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20}};
  static const auto kRenderer = tetwarp::make_cpu_renderer({.threads = 1});
  const tetwarp::ViewPlane plane = tetwarp::view_plane({.angle_deg = 30, .width = 16, .height = 16}, kGrid);
  std::uint8_t rgb[3 * 16 * 16];
  kRenderer->set_volume(tetwarp::view(kVolume));
  kRenderer->set_style({.transfer = transfer});
  kRenderer->render(plane, rgb);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  accepted([&] {
    const tetwarp::TransferFunction transfer = tetwarp::read_transfer_file(file.path());
    asked([&] { look_through(transfer); });
  });
  return 0;
}
