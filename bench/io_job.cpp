#include "bench/io_job.h"

#include <spawn.h>
#include <sys/wait.h>

#include <future>
#include <memory>

#include "bench/series.h"
#include "cuda/devices.h"
#include "deform/fields/formula.h"
#include "io/hash.h"
#include "io/staged_output.h"

extern char** environ;

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

constexpr char kField[] = "wave:amplitude=8,wavelength=64";

/// Runs a program to its end. @throws Error when it cannot be run or fails
void run_program(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  int status = ::posix_spawn(&child, argv.front(), nullptr, nullptr, argv.data(), environ);
  if (status == 0 && ::waitpid(child, &status, 0) != child) status = -1;
  if (status != 0) throw Error(arguments.front() + " failed, status " + std::to_string(status));
}

/// What one stage leaves to the next.
struct Job {
  DicomVolume input;
  VertexField field;
  AnyVolume output;
  std::vector<SliceRange> sampled;
};

VertexField make_field(const Geometry& grid, std::int64_t cell_size, int threads) {
  return sample_on(lattice_over(grid, cell_size), parse_formula(kField, grid), {.threads = threads});
}

/// As the program has it: the field is hashed while the volume is deformed.
void deform(Job& job, int threads) {
  const Geometry& grid = job.input.volume.geometry;
  const std::future<std::string> hash = std::async(
      std::launch::async, [&] { return Sha256().add(std::as_bytes(std::span(job.field.displacement))).hex(); });
  const auto resampler = make_cpu_resampler(grid, {.threads = threads});
  resampler->set_field(view(job.field));
  job.output = AnyVolume(grid, VoxelType::i16);
  job.sampled.resize(static_cast<std::size_t>(grid.size.z));
  const Target target{.source = view(job.input.volume),
                      .output = job.output.view(),
                      .background = -1024,
                      .padding = job.input.padding,
                      .sampled_slices = job.sampled};
  resampler->resample(whole(grid), {&target, 1});
  hash.wait();
}

void write(const Job& job, const fs::path& folder, int threads) {
  StagedOutput staged(folder, StagedOutput::Kind::folder, false);
  write_series(staged.path(), job.input, job.output.view(), job.sampled, threads);
  staged.commit();
}

}  // namespace

fs::path tetwarp_program() {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "tetwarp";
  return fs::exists(program) ? program : fs::path();
}

void add_job(Turns& turns, const fs::path& series, const fs::path& scratch, std::int64_t cell_size, int threads) {
  const std::string step = kJob + ("cells of " + std::to_string(cell_size));
  const fs::path out = scratch / "derived", sidecar = scratch / "derived.json";
  const auto remove = [=] {
    fs::remove_all(out);
    fs::remove(sidecar);
  };
  const fs::path program = tetwarp_program();
  if (!program.empty()) {
    const auto run_on = [=](const char* backend) {
      run_program({program, "deform", series, "-f", kField, "--cell-size", std::to_string(cell_size), "-o", out,
                   "--backend", backend, "--threads", std::to_string(threads), "--quiet"});
    };
    turns.add(step, kJobProgram, nothing([=] { run_on("cpu"); }), remove);
    if (cuda_device_count() != 0) turns.add(step, kJobCuda, nothing([=] { run_on("cuda"); }), remove);
  }
  const auto job = std::make_shared<Job>();
  turns.add(step, kJobIn, nothing([=] { job->input = read_series(series, threads); }));
  turns.add(step, kJobField, nothing([=] { job->field = make_field(job->input.volume.geometry, cell_size, threads); }));
  turns.add(step, kJobDeform, nothing([=] { deform(*job, threads); }));
  turns.add(step, kJobOut, nothing([=] { write(*job, out, threads); }), [=] {
    remove();
    *job = {};  // the program has the memory to itself
  });
}

}  // namespace tetwarp::bench
