// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/picture.h"

#include <png.h>
#include <turbojpeg.h>

#include <memory>
#include <string>

#include "deform/errors.h"

namespace tetwarp::viewer {

namespace {

constexpr int kQuality = 85;        ///< of a JPEG picture; above it edges of bone show no blocks
constexpr int kPngCompression = 1;  ///< a picture at rest is to come soon, and goes to this machine

[[noreturn]] void fail(const char* format, const std::string& reason) {
  throw Error(std::string("cannot make a ") + format + " of a picture (" + reason + ")");
}

void append(png_structp png, png_bytep bytes, std::size_t count) {
  auto& out = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
  const auto* const begin = reinterpret_cast<const std::byte*>(bytes);
  out.insert(out.end(), begin, begin + count);
}

void flush(png_structp) {}

/// libpng calls it for what it cannot do; it must not return.
[[noreturn]] void refuse(png_structp, png_const_charp reason) { fail("PNG", reason); }

}  // namespace

std::vector<std::byte> encode_jpeg(const PaneImage& image) {
  const std::unique_ptr<void, int (*)(tjhandle)> coder(tjInitCompress(), tjDestroy);
  if (!coder) fail("JPEG", tjGetErrorStr2(nullptr));
  const int format = image.is_grey ? TJPF_GRAY : TJPF_RGB, colours = image.is_grey ? TJSAMP_GRAY : TJSAMP_420;
  std::vector<std::byte> bytes(tjBufSize(image.width, image.height, colours));
  auto* at = reinterpret_cast<unsigned char*>(bytes.data());
  unsigned long size = bytes.size();
  if (tjCompress2(coder.get(), image.pixels.data(), image.width, 0, image.height, format, &at, &size, colours, kQuality,
                  TJFLAG_NOREALLOC | TJFLAG_FASTDCT) != 0)
    fail("JPEG", tjGetErrorStr2(coder.get()));
  bytes.resize(size);
  return bytes;
}

std::vector<std::byte> encode_png(const PaneImage& image) {
  struct Writer {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, refuse, nullptr);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    ~Writer() { png_destroy_write_struct(&png, &info); }
  } writer;
  if (!writer.info) fail("PNG", "no memory");
  std::vector<std::byte> bytes;
  png_set_write_fn(writer.png, &bytes, append, flush);
  png_set_compression_level(writer.png, kPngCompression);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
               8, image.is_grey ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  const std::size_t row = static_cast<std::size_t>(image.width) * (image.is_grey ? 1 : 3);
  for (int y = 0; y < image.height; ++y)
    png_write_row(writer.png, image.pixels.data() + row * static_cast<std::size_t>(y));
  png_write_end(writer.png, writer.info);
  return bytes;
}

}  // namespace tetwarp::viewer
