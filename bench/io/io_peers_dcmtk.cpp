// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// DCMTK beside `tetwarp-bench io`: the bare loop that reads a series, and its encoders.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>

#include "bench/io/io_peers.h"
#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

void register_codecs() {
  static std::once_flag once;
  std::call_once(once, [] {
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    DcmRLEEncoderRegistration::registerCodecs();
    DJEncoderRegistration::registerCodecs();
    DJLSEncoderRegistration::registerCodecs();
  });
}

void check(const OFCondition& condition, const fs::path& file) {
  if (condition.bad()) throw Error("DCMTK: " + std::string(condition.text()) + ", " + file.string());
}

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) throw Error("no file in " + folder.string());
  return files;
}

E_TransferSyntax syntax_of(Coding coding) {
  switch (coding) {
    case Coding::jpeg: return EXS_JPEGProcess14SV1;
    case Coding::jpeg_ls: return EXS_JPEGLSLossless;
    case Coding::rle: return EXS_RLELossless;
    default: return EXS_LittleEndianExplicit;
  }
}

/// `f(k)` for every k below `count`; 1 thread: a plain loop.
template <class F>
void for_each(std::size_t count, int threads, const F& f) {
  if (threads == 1) {
    for (std::size_t k = 0; k < count; ++k) f(k);
    return;
  }
  tbb::task_arena arena(threads > 1 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, count, f, tbb::simple_partitioner()); });
}

std::size_t pixels_of(const fs::path& file) {
  DcmFileFormat format;
  check(format.loadFileUntilTag(file.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect,
                                DCM_PixelData),
        file);
  Uint16 rows = 0, columns = 0;
  check(format.getDataset()->findAndGetUint16(DCM_Rows, rows), file);
  check(format.getDataset()->findAndGetUint16(DCM_Columns, columns), file);
  return std::size_t{rows} * columns;
}

void read_slice(const fs::path& file, std::int16_t* hu, std::size_t pixels) {
  DcmFileFormat format;
  check(format.loadFile(file.c_str()), file);
  DcmDataset& data = *format.getDataset();
  check(data.chooseRepresentation(EXS_LittleEndianExplicit, nullptr), file);
  Float64 slope = 1, intercept = 0;
  Uint16 is_signed = 0;
  check(data.findAndGetFloat64(DCM_RescaleSlope, slope), file);
  check(data.findAndGetFloat64(DCM_RescaleIntercept, intercept), file);
  check(data.findAndGetUint16(DCM_PixelRepresentation, is_signed), file);
  const Uint16* words = nullptr;
  unsigned long count = 0;
  check(data.findAndGetUint16Array(DCM_PixelData, words, &count), file);
  if (count < pixels) throw Error("DCMTK: not of the size of the first slice, " + file.string());
  for (std::size_t i = 0; i < pixels; ++i) {
    const int stored = is_signed ? static_cast<std::int16_t>(words[i]) : words[i];
    hu[i] = static_cast<std::int16_t>(slope * stored + intercept);
  }
}

}  // namespace

std::string to_string(Coding coding) {
  constexpr const char* kNames[] = {"uncompressed", "JPEG lossless", "JPEG-LS", "RLE"};
  return kNames[static_cast<int>(coding)];
}

void recode_series(const fs::path& from, const fs::path& to, Coding coding) {
  register_codecs();
  const std::vector<fs::path> files = files_of(from);
  for_each(files.size(), 0, [&](std::size_t k) {
    DcmFileFormat format;
    check(format.loadFile(files[k].c_str()), files[k]);
    check(format.getDataset()->chooseRepresentation(syntax_of(coding), nullptr), files[k]);
    const fs::path file = to / files[k].filename();
    check(format.saveFile(file.c_str(), syntax_of(coding)), file);
  });
}

std::vector<std::int16_t> dcmtk_read_series(const fs::path& folder, int threads) {
  register_codecs();
  const std::vector<fs::path> files = files_of(folder);
  const std::size_t pixels = pixels_of(files.front());
  std::vector<std::int16_t> voxels(pixels * files.size());
  for_each(files.size(), threads, [&](std::size_t k) { read_slice(files[k], voxels.data() + k * pixels, pixels); });
  return voxels;
}

}  // namespace tetwarp::bench
