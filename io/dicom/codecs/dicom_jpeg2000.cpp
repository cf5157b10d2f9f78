// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <openjpeg.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>

#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/codecs/jpeg2000_codestream.h"
#include "io/dicom/pixels/dicom_samples.h"

namespace tetwarp {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// The bytes that OpenJPEG reads, and how far it is.
struct Source {
  Bytes bytes;
  std::size_t at = 0;
};

OPJ_SIZE_T read_source(void* buffer, OPJ_SIZE_T size, void* data) {
  auto& source = *static_cast<Source*>(data);
  const std::size_t count = std::min<std::size_t>(size, source.bytes.size() - source.at);
  if (count == 0) return static_cast<OPJ_SIZE_T>(-1);
  std::memcpy(buffer, source.bytes.data() + source.at, count);
  source.at += count;
  return count;
}

OPJ_OFF_T skip_source(OPJ_OFF_T size, void* data) {
  auto& source = *static_cast<Source*>(data);
  if (size < 0 || static_cast<std::size_t>(size) > source.bytes.size() - source.at) return -1;
  source.at += static_cast<std::size_t>(size);
  return size;
}

OPJ_BOOL seek_source(OPJ_OFF_T at, void* data) {
  auto& source = *static_cast<Source*>(data);
  if (at < 0 || static_cast<std::size_t>(at) > source.bytes.size()) return OPJ_FALSE;
  source.at = static_cast<std::size_t>(at);
  return OPJ_TRUE;
}

/// Keeps the first thing that OpenJPEG complains of. A warning counts as an error: pixels that are made up follow it.
void keep_first(const char* message, void* data) {
  // By how many bytes the end of a code-block may lie from where its coder stopped. Encoders differ by some bytes:
  // those of Kakadu cut off what a decoder can do without, others flush more than they need.
  constexpr int kUsualBytes = 8;
  int bytes = 0;
  if (std::sscanf(message, "PTERM check failure: %d", &bytes) == 1 && bytes <= kUsualBytes) return;
  auto& first = *static_cast<std::string*>(data);
  if (!first.empty()) return;
  first = message;
  first.erase(first.find_last_not_of(" \n") + 1);
}

/// A copy of the codestream that states "predictable termination" (T.800 D.4.2): every code-block ends where its coder
/// does. OpenJPEG decodes the same pixels from it, and warns where the statement is false. For undamaged data it is
/// true within a few bytes, since every encoder ends like this; for damaged ones it is hardly ever true, and nothing
/// else would show the damage.
std::vector<std::uint8_t> with_checked_ends(const Jpeg2000Image& image) {
  constexpr std::uint8_t kPredictable = 0x10, kHighThroughput = 0x40;
  std::vector<std::uint8_t> bytes(image.codestream.begin(), image.codestream.end());
  std::uint8_t& style = bytes[image.block_style_at];
  if ((style & kHighThroughput) == 0) style |= kPredictable;  // the high-throughput coder ends in another way
  return bytes;
}

// OpenJPEG's two handles are both void* to the compiler, so each type has the function that ends it.
using Stream = std::unique_ptr<opj_stream_t, decltype([](opj_stream_t* stream) { opj_stream_destroy(stream); })>;
using Codec = std::unique_ptr<opj_codec_t, decltype([](opj_codec_t* codec) { opj_destroy_codec(codec); })>;
using Image = std::unique_ptr<opj_image_t, decltype([](opj_image_t* image) { opj_image_destroy(image); })>;

Stream make_stream(Source& source) {
  constexpr OPJ_SIZE_T kBuffer = 1 << 16;
  Stream stream(opj_stream_create(kBuffer, OPJ_TRUE));
  if (!stream) return stream;
  opj_stream_set_user_data(stream.get(), &source, nullptr);
  opj_stream_set_user_data_length(stream.get(), source.bytes.size());
  opj_stream_set_read_function(stream.get(), read_source);
  opj_stream_set_skip_function(stream.get(), skip_source);
  opj_stream_set_seek_function(stream.get(), seek_source);
  return stream;
}

/// Decodes a codestream.
/// @param complaint  set to why there is no image
Image decode(Bytes codestream, std::string& complaint) {
  Source source{codestream};
  const Stream stream = make_stream(source);
  const Codec codec(opj_create_decompress(OPJ_CODEC_J2K));
  Image image;
  opj_dparameters_t parameters;
  opj_set_default_decoder_parameters(&parameters);
  opj_image_t* read = nullptr;
  const bool is_ready =
      stream && codec && opj_set_error_handler(codec.get(), keep_first, &complaint) &&
      opj_set_warning_handler(codec.get(), keep_first, &complaint) && opj_setup_decoder(codec.get(), &parameters) &&
      opj_decoder_set_strict_mode(codec.get(), OPJ_TRUE) && opj_read_header(stream.get(), codec.get(), &read);
  image.reset(read);
  const bool is_decoded =
      is_ready && opj_decode(codec.get(), stream.get(), image.get()) && opj_end_decompress(codec.get(), stream.get());
  if (!is_decoded && complaint.empty()) complaint = "OpenJPEG fails without a reason";
  return image;
}

CodedSamples coded_samples(const Jpeg2000Image& image) {
  return {image.precision, image.is_signed ? CodedSamples::Sign::extended : CodedSamples::Sign::none};
}

/// Refuses an image whose codestream disagrees with the attributes. Bits that neither of them uses are not compared.
void check(const Jpeg2000Image& image, const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  if (std::cmp_not_equal(image.rows, pixels.rows) || std::cmp_not_equal(image.columns, pixels.columns)) {
    refuse_pixels(header, "expected an image of " + size_text(pixels) + ", found one of " + std::to_string(image.rows) +
                              " x " + std::to_string(image.columns));
  }
  if (image.components != 1) refuse_pixels(header, "expected 1 component, found " + std::to_string(image.components));
  const std::string problem = sample_problem(pixels, coded_samples(image));
  if (!problem.empty()) refuse_pixels(header, problem);
}

}  // namespace

bool decodes_jpeg_2000() { return true; }

std::vector<std::uint16_t> decode_jpeg_2000(Bytes frame, const DicomFileHeader& header) {
  std::string problem;
  const Jpeg2000Image expected = read_jpeg_2000(frame, problem);
  if (!problem.empty()) refuse_pixels(header, problem);
  check(expected, header);
  const Image image = decode(with_checked_ends(expected), problem);
  if (!problem.empty()) refuse_pixels(header, "the coded data are damaged (OpenJPEG: " + problem + ")");
  const opj_image_comp_t* samples = image && image->numcomps == 1 ? image->comps : nullptr;
  if (!samples || !samples->data || samples->w != expected.columns || samples->h != expected.rows) {
    refuse_pixels(header, "expected an image of " + size_text(header.pixels) + ", found none");
  }
  const std::size_t count = std::size_t{expected.columns} * expected.rows;
  std::vector<std::uint16_t> words(count);
  std::transform(samples->data, samples->data + count, words.begin(),
                 SampleWords(header.pixels, coded_samples(expected)));
  return words;
}

}  // namespace tetwarp
