// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <png.h>

#include <filesystem>
#include <vector>

#include "deform/errors.h"
#include "io/png.h"

namespace tetwarp::test {

/// Reads a PNG with libpng.
inline Picture read_png(const std::filesystem::path& path) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) throw Error(image.message);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, bytes.data(), 0, nullptr)) throw Error(image.message);
  Picture picture(static_cast<int>(image.width), static_cast<int>(image.height));
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const std::uint8_t* pixel = &bytes[3 * static_cast<std::size_t>(y * picture.width() + x)];
      picture.set(x, y, {pixel[0], pixel[1], pixel[2]});
    }
  }
  return picture;
}

}  // namespace tetwarp::test
