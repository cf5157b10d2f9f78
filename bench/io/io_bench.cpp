// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/io/io_bench.h"

#include <algorithm>
#include <utility>

#include "bench/harness/turns.h"
#include "bench/io/io_job.h"
#include "bench/io/io_peers.h"
#include "bench/io/series.h"
#include "deform/errors.h"
#include "deform/phantom.h"
#include "io/image_file.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;
using Voxels = std::vector<std::int16_t>;

constexpr Coding kCodings[] = {Coding::none, Coding::jpeg, Coding::jpeg_ls, Coding::rle};

void require_same(const Voxels& found, const Voxels& expected, const std::string& by, const fs::path& where) {
  if (found != expected) throw Error(by + " reads other voxels than were written, " + where.string());
}

/// The files and what is in them.
struct Scene {
  fs::path folder;
  Volume<std::int16_t> volume;

  fs::path series(Coding coding) const { return folder / ("series-" + std::to_string(static_cast<int>(coding))); }
  fs::path nifti(const std::string& by) const { return folder / (by + ".nii.gz"); }
};

void write_codings(const Scene& scene, const std::function<void(const std::string&)>& say) {
  for (const Coding coding : kCodings) {
    say("write a series, " + to_string(coding));
    fs::create_directory(scene.series(coding));
    if (coding == Coding::none)
      write_phantom_series(scene.series(coding), view(scene.volume), kPhantomSeed);
    else
      recode_series(scene.series(Coding::none), scene.series(coding), coding);
  }
}

/// An empty folder, made again after each run.
std::function<void()> emptied(const fs::path& folder) {
  return [=] {
    fs::remove_all(folder);
    fs::create_directory(folder);
  };
}

void add_series_in(Turns& turns, const Scene& scene, int threads) {
  for (const Coding coding : kCodings) {
    const std::string step = kDicomIn + to_string(coding);
    const fs::path series = scene.series(coding);
    require_same(read_series(series, threads).volume.voxels, scene.volume.voxels, kTetwarp, series);
    require_same(itk_read_series(series)->voxels(), scene.volume.voxels, kItk, series);
    require_same(dcmtk_read_series(series, threads), scene.volume.voxels, kDcmtk, series);
    turns.add(step, kTetwarp, [=] { return read_series(series, threads, FileHash::left_out); });
    turns.add(step, kHashed, [=] { return read_series(series, threads); });
    turns.add(step, kItk, [=] { return itk_read_series(series); });
    turns.add(step, kDcmtk, [=] { return dcmtk_read_series(series, threads); });
    if (coding != Coding::none) turns.add(step, kDcmtk1, [=] { return dcmtk_read_series(series, 1); });
  }
}

/// The series as it was read, written again: ITK's writer takes the attributes from its reader, ours from ours.
void add_series_out(Turns& turns, const Scene& scene, int threads) {
  const fs::path series = scene.series(Coding::none), out = scene.folder / "out";
  const auto ours = std::make_shared<DicomVolume>(read_series(series, threads));
  const auto itk = itk_read_series(series);
  std::vector<SliceRange> sampled;
  const std::int64_t last = scene.volume.geometry.size.z - 1;
  for (std::int64_t k = 0; k <= last; ++k) sampled.push_back({k, std::min(k + 1, last)});
  emptied(out)();
  turns.add(kDicomOut, kTetwarp,
            nothing([=] { write_series(out, *ours, view(std::as_const(ours->volume)), sampled, threads); }),
            emptied(out));
  turns.add(kDicomOut, kItk, nothing([=] { itk->write(out); }), emptied(out));
}

void add_nifti(Turns& turns, const Scene& scene, IoResults& results) {
  const auto write_ours = [&scene](const fs::path& path) { write_image(path, view(scene.volume)); };
  write_ours(scene.nifti(kTetwarp));
  itk_write_nifti(scene.nifti(kItk), scene.volume);
  const fs::path scratch = scene.folder / "scratch.nii.gz";
  const auto remove = [=] { fs::remove(scratch); };
  turns.add(kNiftiOut, kTetwarp, nothing([=] { write_ours(scratch); }), remove);
  turns.add(kNiftiOut, kItk, nothing([=, &scene] { itk_write_nifti(scratch, scene.volume); }), remove);
  for (const std::string by : {kItk, kTetwarp}) {
    const fs::path file = scene.nifti(by);
    results.sizes.push_back({"nii.gz", by, fs::file_size(file)});
    const AnyVolume ours = read_image(file);
    require_same({ours.as<std::int16_t>().begin(), ours.as<std::int16_t>().end()}, scene.volume.voxels, kTetwarp, file);
    require_same(itk_read_nifti(file)->voxels(), scene.volume.voxels, kItk, file);
    turns.add(kNiftiIn + by, kTetwarp, [=] { return std::make_shared<AnyVolume>(read_image(file)); });
    turns.add(kNiftiIn + by, kItk, [=] { return itk_read_nifti(file); });
  }
}

}  // namespace

IoResults measure_io(const IoOptions& options, const fs::path& folder,
                     const std::function<void(const std::string&)>& say) {
  if (options.threads > 0) limit_itk_threads(options.threads);
  IoResults results{.options = options, .machine = {}, .size = {options.width, options.width, options.slices}};
  const Scene scene{folder, make_phantom(results.size, {1, 1, 1}, kPhantomSeed)};
  write_codings(scene, say);
  const auto measure = [&](const auto& add) {
    Turns turns;
    add(turns);
    const std::vector<IoTime> times = turns.run(options.repeats, say);
    results.times.insert(results.times.end(), times.begin(), times.end());
  };
  const fs::path series = scene.series(Coding::none);
  for (const std::string& step : options.steps) {
    if (step == "in") measure([&](Turns& turns) { add_series_in(turns, scene, options.threads); });
    if (step == "out") measure([&](Turns& turns) { add_series_out(turns, scene, options.threads); });
    if (step == "nifti") measure([&](Turns& turns) { add_nifti(turns, scene, results); });
    if (step != "job") continue;
    for (const std::int64_t cell_size : options.cell_sizes) {
      measure([&](Turns& turns) { add_job(turns, series, folder, cell_size, options.threads); });
    }
  }
  return results;
}

}  // namespace tetwarp::bench
