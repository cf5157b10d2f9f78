// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/io/io.h"

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <utility>

#include "bench/harness/files.h"
#include "bench/io/io_peers.h"
#include "deform/phantom.h"
#include "io/image_file.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;
using Voxels = std::vector<std::int16_t>;
using Contenders = std::vector<Contender>;

constexpr Coding kCodings[] = {Coding::none, Coding::jpeg, Coding::jpeg_ls, Coding::rle};
constexpr double kCompressedOnTwoCores = 1.7;

void require_same(const Voxels& found, const Voxels& expected, const std::string& by, const fs::path& where) {
  if (found != expected) throw Error(by + " reads other voxels than were written, " + where.string());
}

/// A phantom series and recoded copies of it in a folder, and what is measured with them. Before the timing every
/// reader must have given the same voxels.
class Measure {
 public:
  Measure(const Options& options, const fs::path& folder, Json& document)
      : options_(options),
        threads_(options.threads),
        folder_(folder),
        document_(document),
        volume_(make_phantom(options.input.phantom_size(), {1, 1, 1}, kPhantomSeed)) {
    for (const Coding coding : kCodings) {
      options.say("write a series, " + to_string(coding));
      fs::create_directory(series(coding));
      if (coding == Coding::none)
        write_phantom_series(series(coding), view(volume_), kPhantomSeed);
      else
        recode_series(series(Coding::none), series(coding), coding);
    }
  }

  void run(const std::string& step) {
    if (step == "in")
      for (const Coding coding : kCodings) time(kDicomIn + to_string(coding), series_in(coding));
    if (step == "out") time(kDicomOut, series_out());
    if (step == "nifti") nifti();
    if (step != "job") return;
    for (const std::int64_t cell_size : options_.cell_sizes)
      time(kJob + ("cells of " + std::to_string(cell_size)),
           job_contenders(series(Coding::none), folder_, cell_size, threads_));
  }

 private:
  fs::path series(Coding coding) const { return folder_ / ("series-" + std::to_string(static_cast<int>(coding))); }

  void time(const std::string& step, const Contenders& contenders) {
    const std::vector<Samples> times =
        take_turns(contenders, 0, options_.repeats, [&](const std::string& line) { options_.say(step + " " + line); });
    for (std::size_t n = 0; n < contenders.size(); ++n)
      document_["times"].push_back(time_json(step, contenders[n].name, times[n]));
  }

  Contenders series_in(Coding coding) const {
    const fs::path from = series(coding);
    const int threads = threads_;
    require_same(read_series(from, threads).volume.voxels, volume_.voxels, kTetwarp, from);
    require_same(itk_read_series(from).voxels(), volume_.voxels, kItk, from);
    require_same(dcmtk_read_series(from, threads), volume_.voxels, kDcmtk, from);
    Contenders contenders{timed(kTetwarp, [=] { return read_series(from, threads, FileHash::left_out); }),
                          timed(kHashed, [=] { return read_series(from, threads); }),
                          timed(kItk, [=] { return itk_read_series(from); }),
                          timed(kDcmtk, [=] { return dcmtk_read_series(from, threads); })};
    if (coding != Coding::none) contenders.push_back(timed(kDcmtk1, [=] { return dcmtk_read_series(from, 1); }));
    return contenders;
  }

  /// The series as it was read, written again: ITK's writer takes the attributes from its reader, ours from ours.
  Contenders series_out() const {
    const fs::path from = series(Coding::none), out = folder_ / "out";
    const auto ours = std::make_shared<DicomVolume>(read_series(from, threads_));
    const auto itk = itk_read_series(from);
    std::vector<SliceRange> sampled;
    const std::int64_t last = volume_.geometry.size.z - 1;
    for (std::int64_t k = 0; k <= last; ++k) sampled.push_back({k, std::min(k + 1, last)});
    const auto emptied = [=] {
      fs::remove_all(out);
      fs::create_directory(out);
    };
    emptied();
    const auto write_ours = [=, threads = threads_] {
      write_series(out, *ours, view(std::as_const(ours->volume)), sampled, threads);
    };
    return {timed(kTetwarp, write_ours, emptied), timed(
                                                      kItk, [=] { itk.write(out); }, emptied)};
  }

  void nifti() {
    const fs::path scratch = folder_ / "scratch.nii.gz";
    const auto remove = [=] { fs::remove(scratch); };
    time(kNiftiOut, {timed(
                         kTetwarp, [&] { write_image(scratch, view(volume_)); }, remove),
                     timed(
                         kItk, [&] { itk_write_nifti(scratch, volume_); }, remove)});
    for (const std::string by : {kItk, kTetwarp}) {
      const fs::path file = folder_ / (by + ".nii.gz");
      if (by == kItk)
        itk_write_nifti(file, volume_);
      else
        write_image(file, view(volume_));
      document_["sizes"].push_back({{"file", "nii.gz"}, {"by", by}, {"bytes", fs::file_size(file)}});
      const AnyVolume ours = read_image(file);
      require_same({ours.as<std::int16_t>().begin(), ours.as<std::int16_t>().end()}, volume_.voxels, kTetwarp, file);
      require_same(itk_read_nifti(file).voxels(), volume_.voxels, kItk, file);
      time(kNiftiIn + by, {timed(kTetwarp, [=] { return std::make_shared<AnyVolume>(read_image(file)); }),
                           timed(kItk, [=] { return itk_read_nifti(file); })});
    }
  }

  const Options& options_;
  const int threads_;
  const fs::path folder_;
  Json& document_;
  const Volume<std::int16_t> volume_;
};

}  // namespace

Json time_json(const std::string& step, const std::string& by, const Samples& times) {
  return {{"step", step}, {"by", by}, {"ms", summary_of(times, "ms")}, {"cpu_ms", summary_of(times, "cpu_ms")}};
}

Floors find_io_floors(const Json& document) {
  Floors floors;
  const auto found = [&](const char* list, const char* pointer, const Json& like) {
    const Json* row = find_row(rows_of(document, list), like);
    return row ? number(*row, pointer) : std::nullopt;
  };
  const auto ms = [&](const std::string& step, const char* by) {
    return found("times", "/ms", {{"step", step}, {"by", by}});
  };
  const auto bytes = [&](const char* by) { return found("sizes", "/bytes", {{"file", "nii.gz"}, {"by", by}}); };
  const auto beside_itk = [&](const std::string& step, Floors::Limit required, Floors::Limit aim = {}) {
    floors.at_least("ITK / tetwarp", step, ms(step, kItk), ms(step, kTetwarp), required, aim);
  };
  const bool one_thread = document["machine"]["threads"] == 1;
  for (const Coding coding : kCodings) {
    const std::string step = kDicomIn + to_string(coding);
    beside_itk(step, coding == Coding::none ? Floors::Limit(1.5) : std::nullopt);
    if (coding == Coding::none)
      floors.at_most("tetwarp / DCMTK", step, ms(step, kTetwarp), ms(step, kDcmtk), 1.1);
    else
      floors.at_least("DCMTK, 1 thread / tetwarp", step, ms(step, kDcmtk1), ms(step, kTetwarp),
                      one_thread ? std::nullopt : Floors::Limit(kCompressedOnTwoCores));
  }
  beside_itk(kDicomOut, 1, 2);
  beside_itk(kNiftiOut, 12);
  floors.at_most("bytes, tetwarp / ITK", kNiftiOut, bytes(kTetwarp), bytes(kItk), 1.03);
  beside_itk(kNiftiIn + std::string(kItk), 2);
  beside_itk(kNiftiIn + std::string(kTetwarp), {});
  for (const Json& time : rows_of(document, "times")) {
    const std::string step = time["step"];
    const auto sum_of = [&](const std::vector<const char*>& stages) {
      Floors::Limit sum = 0;
      for (const char* stage : stages) sum = sum && ms(step, stage) ? *sum + *ms(step, stage) : Floors::Limit();
      return sum;
    };
    const auto hold = [&](const char* by, const char* ratio, const std::vector<const char*>& stages, double limit) {
      if (time["by"] == by) floors.at_most(ratio, step, number(time, "/ms"), sum_of(stages), limit);
    };
    hold(kJobProgram, "program / sum of its stages", {kJobIn, kJobField, kJobDeform, kJobOut, kJobFree}, 1.05);
    hold(kJobCuda, "program with CUDA / in and out", {kJobIn, kJobOut}, 1.3);
    hold(kJobAwake, "job with CUDA awake / in and out", {kJobIn, kJobOut}, 1.3);
  }
  return floors;
}

int run_io(const Options& options) {
  require_writable(options.json);
  const ScratchFolder folder(options.folder);
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
    limit_itk_threads(options.threads);
  }
  const int threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  Json document = begin_document("io",
                                 {{"width", options.input.width},
                                  {"slices", options.input.slices.front()},
                                  {"steps", options.steps},
                                  {"cell_sizes", options.cell_sizes},
                                  {"repeats", options.repeats}},
                                 describe_machine(-1, threads), "phantom");
  document["size"] = size_json(options.input.phantom_size());
  document["page_cache"] = true;
  document["times"] = document["sizes"] = Json::array();
  Measure measure(options, folder.path(), document);
  for (const std::string& step : options.steps) measure.run(step);
  return conclude(document, find_io_floors(document), options);
}

}  // namespace tetwarp::bench
