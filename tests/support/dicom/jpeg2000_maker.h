// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <openjpeg.h>

#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

/// A JPEG 2000 codestream of one component, made by OpenJPEG.
struct MadeCodestream {
  int rows = 0, columns = 0, precision = 16;
  bool is_signed = false;
  std::vector<int> samples;
  std::function<void(opj_cparameters_t&)> change;  ///< changes the parameters, which are lossless, one tile, one layer

  std::string encode() const;
};

namespace jpeg2000_maker {

struct Sink {
  std::string bytes;
  std::size_t at = 0;
};

inline OPJ_SIZE_T write(void* buffer, OPJ_SIZE_T size, void* data) {
  auto& sink = *static_cast<Sink*>(data);
  if (sink.bytes.size() < sink.at + size) sink.bytes.resize(sink.at + size);
  std::memcpy(sink.bytes.data() + sink.at, buffer, size);
  sink.at += size;
  return size;
}

inline OPJ_BOOL seek(OPJ_OFF_T at, void* data) {
  static_cast<Sink*>(data)->at = static_cast<std::size_t>(at);
  return OPJ_TRUE;
}

inline OPJ_OFF_T skip(OPJ_OFF_T size, void* data) {
  static_cast<Sink*>(data)->at += static_cast<std::size_t>(size);
  return size;
}

}  // namespace jpeg2000_maker

inline std::string MadeCodestream::encode() const {
  using namespace jpeg2000_maker;
  opj_cparameters_t parameters;
  opj_set_default_encoder_parameters(&parameters);
  parameters.tcp_numlayers = 1;
  parameters.cp_disto_alloc = 1;
  if (change) change(parameters);
  opj_image_cmptparm_t component{};
  component.dx = component.dy = 1;
  component.w = static_cast<OPJ_UINT32>(columns);
  component.h = static_cast<OPJ_UINT32>(rows);
  component.prec = static_cast<OPJ_UINT32>(precision);
  component.sgnd = is_signed ? 1 : 0;
  const std::unique_ptr<opj_image_t, void (*)(opj_image_t*)> image(opj_image_create(1, &component, OPJ_CLRSPC_GRAY),
                                                                   opj_image_destroy);
  image->x1 = component.w;
  image->y1 = component.h;
  std::memcpy(image->comps[0].data, samples.data(), samples.size() * sizeof(int));
  Sink sink;
  opj_codec_t* codec = opj_create_compress(OPJ_CODEC_J2K);
  opj_stream_t* stream = opj_stream_create(1 << 16, OPJ_FALSE);
  opj_stream_set_user_data(stream, &sink, nullptr);
  opj_stream_set_write_function(stream, write);
  opj_stream_set_seek_function(stream, seek);
  opj_stream_set_skip_function(stream, skip);
  const bool is_done = opj_setup_encoder(codec, &parameters, image.get()) &&
                       opj_start_compress(codec, image.get(), stream) && opj_encode(codec, stream) &&
                       opj_end_compress(codec, stream);
  opj_stream_destroy(stream);
  opj_destroy_codec(codec);
  if (!is_done) throw std::runtime_error("OpenJPEG cannot encode");
  return sink.bytes;
}
