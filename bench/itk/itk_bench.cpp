// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_bench.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "bench/harness/machine.h"
#include "bench/harness/markdown.h"
#include "bench/itk/itk_process.h"
#include "bench/peers/peers.h"
#include "deform/phantom.h"
#include "io/image_file.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;
using Say = std::function<void(const std::string&)>;

constexpr char kStreamField[] = "elastic", kSpline[] = "B-spline";
constexpr std::int64_t kStreamCells = 8, kSplineCells = 2;
constexpr int kDivisions[] = {1, 4, 16};

std::array<double, 2> load_averages() {
  double loads[3] = {};
  if (::getloadavg(loads, 3) != 3) return {};
  return {loads[0], loads[2]};
}

void write_field(const fs::path& path, PullField field) { write_image(path, samples_of(field)); }

void write_forward(const fs::path& path, const SmoothField& field, const Geometry& lattice, int threads) {
  VertexField vertices = sample_on(lattice, field.displacement, {.threads = threads});
  write_field(path, {vertices.lattice, std::move(vertices.displacement)});
}

/// The same contender's answers, repeat by repeat.
struct Answers {
  std::vector<double> ms, cpu_ms, peak_bytes;
  ItkAnswer last;

  void add(const ItkAnswer& answer) {
    ms.push_back(answer.ms);
    cpu_ms.push_back(answer.cpu_ms);
    peak_bytes.push_back(static_cast<double>(answer.peak_bytes));
    last = answer;
  }
  std::uint64_t median_peak() const { return static_cast<std::uint64_t>(summarize(peak_bytes).median); }
};

/// Bytes in which two files differ, what only one of them has among them.
std::uint64_t differing_bytes(const fs::path& a, const fs::path& b) {
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  std::vector<char> left(1 << 20), right(left.size());
  std::uint64_t sum = 0;
  while (first || second) {
    first.read(left.data(), static_cast<std::streamsize>(left.size()));
    second.read(right.data(), static_cast<std::streamsize>(right.size()));
    const auto shorter = std::min(first.gcount(), second.gcount()), longer = std::max(first.gcount(), second.gcount());
    for (std::streamsize n = 0; n < shorter; ++n)
      sum += left[static_cast<std::size_t>(n)] != right[static_cast<std::size_t>(n)];
    sum += static_cast<std::uint64_t>(longer - shorter);
  }
  return sum;
}

class Measure {
 public:
  Measure(const ItkOptions& options, const fs::path& folder, const Say& say, ItkResults& results)
      : options_(options), files_{folder}, say_(say), results_(results) {}

  void run() {
    const glm::i64vec3 size{options_.width, options_.width, options_.slices};
    Volume<std::int16_t> volume = make_phantom(size, {1, 1, 1}, kPhantomSeed);
    volume.geometry.origin = glm::dvec3(0);
    grid_ = volume.geometry;
    write_image(files_.volume(), view(std::as_const(volume)));
    volume = {};
    for (const std::string& field : options_.fields) run_field(field);
    if (asks_for(kTransform)) run_task(kTransform, kSpline, kSplineCells);
    if (asks_for(kStream)) run_streams();
  }

 private:
  bool asks_for(const std::string& task) const {
    return std::find(options_.tasks.begin(), options_.tasks.end(), task) != options_.tasks.end();
  }

  void write_cells(const std::string& name, const SmoothField& field, std::int64_t cell_size) {
    const Geometry lattice = lattice_over(grid_, cell_size);
    say_("write " + name + ", cells of " + std::to_string(cell_size));
    write_forward(files_.forward(name, cell_size), field, lattice, results_.machine.threads);
    write_field(files_.inverse(name, cell_size), invert_closely(field, lattice, results_.machine.threads));
  }

  void run_field(const std::string& name) {
    const bool has_cells = asks_for(kPull) || asks_for(kForward) || asks_for(kInvert);
    if (!has_cells && !asks_for(kDeterminant)) return;
    const SmoothField field = make_smooth_field(name, grid_.size);
    write_cells(name, field, 1);  // the truth, too
    if (asks_for(kDeterminant)) run_task(kDeterminant, name, 1);
    for (const std::int64_t cell_size : has_cells ? options_.cell_sizes : std::vector<std::int64_t>()) {
      if (cell_size != 1) write_cells(name, field, cell_size);
      for (const char* task : {kPull, kForward, kInvert}) {
        if (asks_for(task)) run_task(task, name, cell_size);
      }
      if (cell_size != 1) remove_cells(name, cell_size);
    }
    remove_cells(name, 1);
  }

  void remove_cells(const std::string& name, std::int64_t cell_size) const {
    fs::remove(files_.forward(name, cell_size));
    fs::remove(files_.inverse(name, cell_size));
  }

  ItkAnswer ask(const ItkContender& by, const ItkRequest& request, int repeat) const {
    const ItkAnswer answer = ask_alone(request, files_);
    say_(format("%d/%d  %-8s cells of %lld, %2d pieces  %-60s %8.1f ms, CPU %8.1f, %7.1f MB", repeat, options_.repeats,
                request.field.c_str(), static_cast<long long>(request.cell_size), request.divisions, by.filters.c_str(),
                answer.ms, answer.cpu_ms, 1e-6 * static_cast<double>(answer.peak_bytes)));
    return answer;
  }

  void run_task(const std::string& key, const std::string& field, std::int64_t cell_size) {
    const std::vector<ItkContender>& contenders = itk_task(key).contenders;
    std::vector<Answers> answers(contenders.size());
    for (int repeat = 1; repeat <= options_.repeats; ++repeat) {
      for (std::size_t n = 0; n < contenders.size(); ++n) {
        answers[n].add(ask(contenders[n],
                           {.method = contenders[n].method,
                            .field = field,
                            .cell_size = cell_size,
                            .threads = results_.machine.threads,
                            .is_compared = repeat == options_.repeats},
                           repeat));
      }
    }
    for (std::size_t n = 0; n < contenders.size(); ++n) {
      const Answers& found = answers[n];
      results_.runs.push_back({.task = key,
                               .field = field,
                               .cell_size = cell_size,
                               .by = contenders[n],
                               .ms = summarize(found.ms),
                               .cpu_ms = summarize(found.cpu_ms),
                               .input_bytes = found.last.input_bytes,
                               .output_bytes = found.last.output_bytes,
                               .peak_bytes = found.median_peak(),
                               .deviation = found.last.deviation});
    }
  }

  /// The first file of each contender is written whole; all others of it are held against that one.
  void run_streams() {
    write_cells(kStreamField, make_smooth_field(kStreamField, grid_.size), kStreamCells);
    const std::vector<ItkContender>& contenders = itk_task(kStream).contenders;
    struct Stream {
      Answers answers;
      std::uint64_t differing = 0;
    };
    std::vector<Stream> streams(contenders.size() * std::size(kDivisions));
    for (int repeat = 1; repeat <= options_.repeats; ++repeat) {
      for (std::size_t n = 0; n < streams.size(); ++n) {
        const ItkContender& by = contenders[n % contenders.size()];
        streams[n].answers.add(ask(by,
                                   {.method = by.method,
                                    .field = kStreamField,
                                    .cell_size = kStreamCells,
                                    .threads = results_.machine.threads,
                                    .divisions = kDivisions[n / contenders.size()]},
                                   repeat));
        const fs::path whole = files_.folder / (by.method + ".mha");
        if (fs::exists(whole))
          streams[n].differing += differing_bytes(files_.streamed(), whole);
        else
          fs::rename(files_.streamed(), whole);
        fs::remove(files_.streamed());
      }
    }
    for (std::size_t n = 0; n < streams.size(); ++n) {
      results_.streams.push_back({.by = contenders[n % contenders.size()],
                                  .divisions = kDivisions[n / contenders.size()],
                                  .ms = summarize(streams[n].answers.ms),
                                  .cpu_ms = summarize(streams[n].answers.cpu_ms),
                                  .peak_bytes = streams[n].answers.median_peak(),
                                  .differing_bytes = streams[n].differing});
    }
  }

  const ItkOptions& options_;
  ItkFiles files_;
  const Say& say_;
  ItkResults& results_;
  Geometry grid_;
};

}  // namespace

ItkResults measure_itk(const ItkOptions& options, const fs::path& folder, const Say& say) {
  ItkResults results{.options = options,
                     .machine = describe_machine(-1, options.threads),
                     .itk = itk_version().value_or("?"),
                     .load_before = load_averages()};
  Measure(options, folder, say, results).run();
  results.load_after = load_averages();
  const auto place = [](const ItkRun& run) {
    const auto& tasks = itk_tasks();
    return std::find_if(tasks.begin(), tasks.end(), [&](const ItkTask& task) { return task.key == run.task; });
  };
  std::ranges::stable_sort(results.runs, {}, place);
  return results;
}

}  // namespace tetwarp::bench
