// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/png.h"

#include <png.h>

#include <string>

#include "deform/errors.h"

namespace tetwarp {

Picture::Picture(int width, int height, Colour colour) : width_(width), height_(height) {
  bytes_.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  fill(0, 0, width, height, colour);
}

Colour Picture::at(int x, int y) const {
  const std::uint8_t* pixel = bytes_.data() + offset(x, y);
  return {pixel[0], pixel[1], pixel[2]};
}

void Picture::set(int x, int y, Colour colour) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  std::copy(colour.begin(), colour.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset(x, y)));
}

void Picture::fill(int x, int y, int width, int height, Colour colour) {
  for (int row = y; row < y + height; ++row) {
    for (int column = x; column < x + width; ++column) set(column, row, colour);
  }
}

namespace {

png_image described(const Picture& picture) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width());
  image.height = static_cast<png_uint_32>(picture.height());
  image.format = PNG_FORMAT_RGB;
  return image;
}

}  // namespace

void write_png(const std::filesystem::path& path, const Picture& picture) {
  png_image image = described(picture);
  if (!png_image_write_to_file(&image, path.c_str(), 0, picture.data(), 0, nullptr)) {
    const std::string reason = image.message;
    png_image_free(&image);
    throw Error("cannot write the picture, " + path.string() + " (" + reason +
                "); check the folder and the free space");
  }
}

std::vector<std::uint8_t> png_bytes(const Picture& picture) {
  png_image image = described(picture);
  std::vector<std::uint8_t> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t used = bytes.size();
  if (!png_image_write_to_memory(&image, bytes.data(), &used, 0, picture.data(), 0, nullptr)) {
    const std::string reason = image.message;
    png_image_free(&image);
    throw Error("cannot make a PNG of a picture (" + reason + ")");
  }
  bytes.resize(used);
  return bytes;
}

}  // namespace tetwarp
