// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <utility>

#include "bench/harness/files.h"
#include "bench/peers/peers.h"
#include "deform/phantom.h"
#include "io/image_file.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

constexpr char kStreamField[] = "elastic";
constexpr std::int64_t kStreamCells = 8, kSplineCells = 2;
constexpr int kDivisions[] = {1, 4, 16};
constexpr double kStreamedMemory = 0.5;  ///< of the whole, in 16 pieces
constexpr double kSameError = 0.99;      ///< ITK's over ours: not larger, to a hundredth

std::array<double, 2> load_averages() {
  double loads[3] = {};
  if (::getloadavg(loads, 3) != 3) return {};
  return {loads[0], loads[2]};
}

/// Bytes in which two files differ, what only one of them has among them.
std::uint64_t differing_bytes(const fs::path& a, const fs::path& b) {
  const auto bytes = [](const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return std::vector<char>(std::istreambuf_iterator<char>(file), {});
  };
  const std::vector<char> first = bytes(a), second = bytes(b);
  const std::size_t shorter = std::min(first.size(), second.size());
  std::uint64_t sum = std::max(first.size(), second.size()) - shorter;
  for (std::size_t n = 0; n < shorter; ++n) sum += first[n] != second[n];
  return sum;
}

/// A phantom and fields in a folder, and what is measured with them, each time by this program run again.
class Measure {
 public:
  Measure(const Options& options, const fs::path& folder, Json& document)
      : options_(options), files_{folder}, document_(document), threads_(document["machine"]["threads"]) {}

  void run() {
    Volume<std::int16_t> volume = make_phantom(options_.input.phantom_size(), {1, 1, 1}, kPhantomSeed);
    volume.geometry.origin = glm::dvec3(0);
    grid_ = volume.geometry;
    write_image(files_.volume(), view(std::as_const(volume)));
    volume = {};
    for (const std::string& field : options_.fields) run_field(field);
    if (asks_for("transform")) run_task("transform", "B-spline", kSplineCells);
    if (asks_for("stream")) run_streams();
  }

 private:
  bool asks_for(const std::string& task) const {
    return std::find(options_.tasks.begin(), options_.tasks.end(), task) != options_.tasks.end();
  }

  void write_cells(const std::string& name, const SmoothField& field, std::int64_t cell_size) const {
    const Geometry lattice = lattice_over(grid_, cell_size);
    options_.say("write " + name + ", cells of " + std::to_string(cell_size));
    VertexField vertices = sample_on(lattice, field.displacement, {.threads = threads_});
    PullField forward{vertices.lattice, std::move(vertices.displacement)},
        inverse = invert_closely(field, lattice, threads_);
    write_image(files_.forward(name, cell_size), samples_of(forward));
    write_image(files_.inverse(name, cell_size), samples_of(inverse));
  }

  void remove_cells(const std::string& name, std::int64_t cell_size) const {
    fs::remove(files_.forward(name, cell_size));
    fs::remove(files_.inverse(name, cell_size));
  }

  void run_field(const std::string& name) {
    const bool has_cells = asks_for("pull") || asks_for("forward") || asks_for("invert");
    if (!has_cells && !asks_for("determinant")) return;
    const SmoothField field = make_smooth_field(name, grid_.size);
    write_cells(name, field, 1);  // the truth, too
    if (asks_for("determinant")) run_task("determinant", name, 1);
    for (const std::int64_t cell_size : has_cells ? options_.cell_sizes : std::vector<std::int64_t>()) {
      if (cell_size != 1) write_cells(name, field, cell_size);
      for (const char* task : {"pull", "forward", "invert"})
        if (asks_for(task)) run_task(task, name, cell_size);
      if (cell_size != 1) remove_cells(name, cell_size);
    }
    remove_cells(name, 1);
  }

  /// A contender that asks a process; what that answers is kept in `last`.
  Contender asking(const ItkContender& by, ItkRequest request, Json& last) const {
    const auto run = [this, request, &last](Samples& samples) mutable {
      request.is_compared = samples["ms"].size() + 1 == static_cast<std::size_t>(options_.repeats);
      last = ask_alone(request, files_);
      for (const char* name : {"ms", "cpu_ms", "peak_bytes"}) samples[name].push_back(last[name]);
    };
    return {request.field + ", cells of " + std::to_string(request.cell_size) + ", " +
                std::to_string(request.divisions) + " pieces, " + by.filters,
            run};
  }

  std::vector<Samples> turns(const std::vector<Contender>& contenders) const {
    return take_turns(contenders, 0, options_.repeats, [&](const std::string& line) { options_.say(line); });
  }

  static std::uint64_t median_peak(const Samples& times) {
    return static_cast<std::uint64_t>(summarize(times.at("peak_bytes"))["median"].get<double>());
  }

  void run_task(const std::string& key, const std::string& field, std::int64_t cell_size) {
    const ItkTask& task = itk_task(key);
    std::vector<Json> last(task.contenders.size());
    std::vector<Contender> contenders;
    for (const ItkContender& by : task.contenders)
      contenders.push_back(asking(by, {by.method, field, cell_size, threads_}, last[contenders.size()]));
    const std::vector<Samples> times = turns(contenders);
    for (std::size_t n = 0; n < contenders.size(); ++n) {
      Json row{{"task", key},
               {"field", field},
               {"cell_size", cell_size},
               {"filters", task.contenders[n].filters},
               {"own", task.contenders[n].own},
               {"ms", summary_of(times[n], "ms")},
               {"cpu_ms", summary_of(times[n], "cpu_ms")},
               {"input_bytes", last[n]["input_bytes"]},
               {"output_bytes", last[n]["output_bytes"]},
               {"peak_bytes_beyond_inputs", median_peak(times[n])},
               {"error", last[n]["error"]}};
      if (!row["error"].is_null()) row["error"]["unit"] = task.unit;
      document_["runs"].push_back(row);
    }
  }

  /// The first file of each contender is written whole; all others of it are held against that one.
  void run_streams() {
    write_cells(kStreamField, make_smooth_field(kStreamField, grid_.size), kStreamCells);
    const std::vector<ItkContender>& filters = itk_task("stream").contenders;
    const std::size_t count = filters.size() * std::size(kDivisions);
    std::vector<std::uint64_t> differing(count);
    std::vector<Json> last(count);
    std::vector<Contender> contenders;
    for (std::size_t n = 0; n < count; ++n) {
      const ItkContender& by = filters[n % filters.size()];
      const ItkRequest request{by.method, kStreamField, kStreamCells, threads_, kDivisions[n / filters.size()]};
      Contender one = asking(by, request, last[n]);
      one.run = [this, &by, &sum = differing[n], ask = one.run](Samples& samples) {
        ask(samples);
        const fs::path whole = files_.folder / (by.method + ".mha");
        if (fs::exists(whole))
          sum += differing_bytes(files_.streamed(), whole);
        else
          fs::rename(files_.streamed(), whole);
        fs::remove(files_.streamed());
      };
      contenders.push_back(one);
    }
    const std::vector<Samples> times = turns(contenders);
    for (std::size_t n = 0; n < count; ++n)
      document_["streams"].push_back({{"filters", filters[n % filters.size()].filters},
                                      {"own", filters[n % filters.size()].own},
                                      {"pieces", kDivisions[n / filters.size()]},
                                      {"ms", summary_of(times[n], "ms")},
                                      {"cpu_ms", summary_of(times[n], "cpu_ms")},
                                      {"peak_bytes_beyond_field", median_peak(times[n])},
                                      {"differing_bytes", differing[n]}});
  }

  const Options& options_;
  const ItkFiles files_;
  Json& document_;
  const int threads_;
  Geometry grid_;
};

/// Both sides sample a B-spline by the same call: its time and error are told and held against nothing. Nor is the
/// error of determinants: ours is that of the tetrahedron's map, ITK's a difference over two voxels, and the truth is
/// smooth; their time is an aim, for ours asks for the owner of each voxel first. Nor are errors with larger cells:
/// what lies between vertices is for each side to say.
void add_peer(const Json& peer, const Json& own, Floors& floors) {
  const std::string where = itk_task(peer["task"]).question + ", " + peer["field"].get<std::string>() + ", cells of " +
                            peer["cell_size"].dump() + ", " + peer["filters"].get<std::string>();
  const auto unless = [](bool told, double limit) { return told ? std::nullopt : std::optional(limit); };
  const bool same_work = peer["task"] == "transform", is_aim = peer["task"] == "determinant";
  floors.at_least("time / tetwarp's", where, number(peer, "/ms"), number(own, "/ms"), unless(same_work || is_aim, 1),
                  unless(!is_aim, 1));
  const bool told = same_work || is_aim || peer["cell_size"] > 1;
  floors.at_least("rms error / tetwarp's", where, number(peer, "/error/rms"), number(own, "/error/rms"),
                  unless(told, kSameError));
}

void add_stream(const Json& stream, const Json* whole, Floors& floors) {
  const std::string where = stream["filters"].get<std::string>() + ", " + stream["pieces"].dump() + " pieces";
  const auto if_held = [](bool held, double limit) { return held ? std::optional(limit) : std::nullopt; };
  const bool own = stream["own"];
  floors.at_most("bytes that differ from the whole", where, number(stream, "/differing_bytes"), 1, if_held(own, 0));
  if (whole && stream["pieces"] != 1)
    floors.at_most("memory / that of the whole", where, number(stream, "/peak_bytes_beyond_field"),
                   number(*whole, "/peak_bytes_beyond_field"),
                   if_held(own && stream["pieces"] >= kDivisions[2], kStreamedMemory));
}

}  // namespace

const std::vector<ItkTask>& itk_tasks() {
  static const std::vector<ItkTask> kTasks{
      {"pull",
       "warp, the inverse field is given",
       "HU",
       {{"pull", "PullFieldResampleImageFilter", true},
        {"itk-resample", "ResampleImageFilter, DisplacementFieldTransform"},
        {"itk-warp", "WarpImageFilter"}}},
      {"forward",
       "warp, the forward field is given",
       "HU",
       {{"forward", "VertexFieldResampleImageFilter", true},
        {"itk-invert-warp", "InvertDisplacementFieldImageFilter, WarpImageFilter"}}},
      {"invert",
       "invert a displacement field",
       "voxels",
       {{"invert", "ExactInvertDisplacementFieldImageFilter", true},
        {"itk-invert", "InvertDisplacementFieldImageFilter"},
        {"itk-invert-free", "InvertDisplacementFieldImageFilter, EnforceBoundaryConditionOff"}}},
      {"determinant",
       "Jacobian determinant",
       "",
       {{"determinant", "VertexFieldToJacobianDeterminantFilter", true},
        {"itk-determinant", "DisplacementFieldJacobianDeterminantFilter"}}},
      {"transform",
       "sample a B-spline transform",
       "voxels",
       {{"transform", "TransformToVertexFieldFilter", true}, {"itk-transform", "TransformToDisplacementFieldFilter"}}},
      {"stream",
       "read, warp and write in pieces",
       "",
       {{"stream", "VertexFieldResampleImageFilter", true}, {"itk-stream", "WarpImageFilter"}}},
  };
  return kTasks;
}

const ItkTask& itk_task(const std::string& key) {
  const auto& tasks = itk_tasks();
  const auto found = std::find_if(tasks.begin(), tasks.end(), [&](const ItkTask& task) { return task.key == key; });
  require(found != tasks.end(), "no task \"" + key + "\"");
  return *found;
}

Floors find_itk_floors(const Json& document) {
  Floors floors;
  const Json &runs = rows_of(document, "runs"), &streams = rows_of(document, "streams");
  for (const Json& run : runs) {
    const Json* own = find_row(
        runs, {{"own", true}, {"task", run["task"]}, {"field", run["field"]}, {"cell_size", run["cell_size"]}});
    if (own && run["own"] == false) add_peer(run, *own, floors);
  }
  for (const Json& stream : streams)
    add_stream(stream, find_row(streams, {{"filters", stream["filters"]}, {"pieces", 1}}), floors);
  return floors;
}

int run_itk(const Options& options) {
  require_writable(options.json);
  const ScratchFolder folder(options.folder);
  Json document = begin_document("itk",
                                 {{"tasks", options.tasks},
                                  {"fields", options.fields},
                                  {"cell_sizes", options.cell_sizes},
                                  {"width", options.input.width},
                                  {"slices", options.input.slices.front()},
                                  {"repeats", options.repeats}},
                                 describe_machine(-1, options.threads), "phantom");
  document["itk"] = itk_version().value_or("?");
  document["runs"] = document["streams"] = Json::array();
  Json loads{{"minutes", {1, 15}}, {"before", load_averages()}};
  Measure(options, folder.path(), document).run();
  loads["after"] = load_averages();
  document["load_averages"] = loads;
  const auto place = [](const Json& run) {
    const auto& tasks = itk_tasks();
    return std::find_if(tasks.begin(), tasks.end(),
                        [&](const ItkTask& task) { return task.key == run["task"].get<std::string>(); });
  };
  std::stable_sort(document["runs"].begin(), document["runs"].end(),
                   [&](const Json& a, const Json& b) { return place(a) < place(b); });
  return conclude(document, find_itk_floors(document), options);
}

}  // namespace tetwarp::bench
