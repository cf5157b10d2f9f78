// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>

#include "backend/devices.h"
#include "backend/factories.h"
#include "bench/harness/files.h"
#include "bench/io/io.h"
#include "deform/fields/formula.h"
#include "io/hash.h"
#include "io/staged_output.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

constexpr char kField[] = "wave:amplitude=8,wavelength=64";

/// What one stage leaves to the next.
struct Job {
  DicomVolume input;
  VertexField field;
  AnyVolume output;
  std::vector<SliceRange> sampled;
};

DicomDerivation made_up_derivation() {
  return {.field_sha256 = std::string(64, '0'),
          .parameters = "interpolation=linear outside=refuse background=-1024.0 direction=forward",
          .description = "Deformed by a field of vertices, linear interpolation"};
}

VertexField make_field(const Geometry& grid, std::int64_t cell_size, int threads) {
  return sample_on(lattice_over(grid, cell_size), parse_formula(kField, grid), {.threads = threads});
}

/// As the program has it: the field is hashed, too. @param finished  told of slices that are done
void deform(Job& job, ForwardResampler& resampler, int threads, const PartSink& finished = {}) {
  const Geometry& grid = job.input.volume.geometry;
  Sha256().add_blocks(std::as_bytes(std::span(job.field.displacement)), threads);
  resampler.set_field(view(job.field));
  job.output = AnyVolume(grid, VoxelType::i16);
  job.sampled.assign(static_cast<std::size_t>(grid.size.z), {});
  const Target target{.source = view(job.input.volume),
                      .output = job.output.view(),
                      .background = -1024,
                      .padding = job.input.padding,
                      .sampled_slices = job.sampled};
  resampler.resample(whole(grid), {&target, 1}, {}, {}, finished);
}

void write(const Job& job, const fs::path& folder, int threads) {
  StagedOutput staged(folder, StagedOutput::Kind::folder, false);
  write_series(staged.path(), job.input, job.output.view(), job.sampled, threads);
  staged.commit();
}

/// From series to series, slices being written while others are deformed.
void run_with_cuda(const fs::path& series, const fs::path& folder, std::int64_t cell_size, int threads) {
  Job job;
  job.input = read_series(series, threads);
  const Geometry& grid = job.input.volume.geometry;
  job.field = make_field(grid, cell_size, threads);
  StagedOutput staged(folder, StagedOutput::Kind::folder, false);
  DerivedSeriesWriter writer(staged.path(), grid, *job.input.headers, made_up_derivation());
  deform(job, *make_forward_resampler(BackendKind::cuda, grid), threads, [&](const Region& slices) {
    writer.write(job.output.view(), slices.begin.z, slices.end.z, job.sampled, threads);
  });
  staged.commit();
}

/// The program tetwarp beside this one; empty if there is none.
fs::path tetwarp_program() {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "tetwarp";
  return fs::exists(program) ? program : fs::path();
}

}  // namespace

DicomVolume read_series(const fs::path& folder, int threads, FileHash hash) {
  const DicomScan scan = scan_dicom(folder);
  require(scan.series.size() == 1,
          std::to_string(scan.series.size()) + " series in " + folder.string() + "; expected one");
  return load_dicom(scan.series.front(), threads, {}, hash);
}

void write_series(const fs::path& folder, const DicomVolume& source, const ConstVolumeView& volume,
                  const std::vector<SliceRange>& sampled, int threads) {
  write_derived_series(folder, volume, *source.headers, made_up_derivation(), sampled, threads);
}

std::vector<Contender> job_contenders(const fs::path& series, const fs::path& scratch, std::int64_t cell_size,
                                      int threads) {
  std::vector<Contender> contenders;
  const fs::path out = scratch / "derived", sidecar = scratch / "derived.json";
  const auto remove = [=] {
    fs::remove_all(out);
    fs::remove(sidecar);
  };
  const fs::path program = tetwarp_program();
  const bool has_device = device_count() != 0;
  const auto run_on = [=](const char* backend) {
    run_program({program, "deform", series, "-f", kField, "--cell-size", std::to_string(cell_size), "-o", out,
                 "--backend", backend, "--threads", std::to_string(threads), "--quiet"});
  };
  if (!program.empty())
    contenders.push_back(timed(
        kJobProgram, [=] { run_on("cpu"); }, remove));
  if (!program.empty() && has_device)
    contenders.push_back(timed(
        kJobCuda, [=] { run_on("cuda"); }, remove));
  if (has_device)
    contenders.push_back(timed(
        kJobAwake, [=] { run_with_cuda(series, out, cell_size, threads); }, remove));
  const auto job = std::make_shared<Job>();
  const auto add = [&](const char* stage, auto run, std::function<void()> after = {}) {
    contenders.push_back(timed(stage, run, after));
  };
  add(kJobIn, [=] { job->input = read_series(series, threads); });
  add(kJobField, [=] { job->field = make_field(job->input.volume.geometry, cell_size, threads); });
  add(kJobDeform,
      [=] { deform(*job, *make_cpu_resampler(job->input.volume.geometry, {.threads = threads}), threads); });
  add(
      kJobOut, [=] { write(*job, out, threads); }, remove);
  add(kJobFree, [=] { *job = {}; });
  return contenders;
}

}  // namespace tetwarp::bench
