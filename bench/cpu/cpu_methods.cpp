// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <span>

#include "bench/gpu/gpu_fields.h"
#include "bench/paper/backend.h"
#include "bench/peers/peers.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

namespace {

/// Threads that oneTBB may use while it stands.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads)
      : limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)) {}

 private:
  tbb::global_control limit_;
};

/// A field on a lattice over a volume.
struct Scene {
  VertexField field;
  double at_rest = 0;           ///< fraction of its vertices
  std::vector<Region> resting;  ///< slices of the volume that rest, and those beside them
};

/// Where vertices lie on voxels: slices that rest, and so do those beside them; two or more together.
std::vector<Region> find_resting(const VertexField& field) {
  const glm::i64vec3 size = field.lattice.size;
  const auto rests = [&](std::int64_t k) {
    const auto begin = field.displacement.begin() + k * size.x * size.y;
    return std::all_of(begin, begin + size.x * size.y, [](const glm::vec3& by) { return by == glm::vec3(0); });
  };
  std::vector<Region> regions;
  for (std::int64_t begin = 0, end = 0; begin < size.z; begin = end + 1) {
    for (end = begin; end < size.z && rests(end);) ++end;
    const std::int64_t first = begin == 0 ? 0 : begin + 1, last = end == size.z ? end : end - 1;
    if (last - first >= 2) regions.push_back({{0, 0, first}, {size.x, size.y, last}});
  }
  return regions;
}

Scene make_scene(const FieldOnLattice& of, const Geometry& volume) {
  TestField test = make_test_field(of.name, of.like.value_or(volume.size));
  test.formula.centre = make_formula("identity", volume.size).centre;
  Scene scene;
  VertexField& field = scene.field;
  field.lattice = lattice_over(volume, of.cell_size);
  const glm::i64vec3 size = field.lattice.size;
  field.displacement.resize(static_cast<std::size_t>(voxel_count(field.lattice)));
  const auto fill_rows = [&](const tbb::blocked_range<std::int64_t>& rows, std::int64_t resting) {
    for (std::int64_t row = rows.begin(); row != rows.end(); ++row) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const glm::vec3 rest = glm::vec3(glm::i64vec3(i, row % size.y, row / size.y) * of.cell_size);
        const glm::vec3 by = displacement_at(test, rest);
        field.displacement[static_cast<std::size_t>(row * size.x + i)] = by;
        resting += by == glm::vec3(0);
      }
    }
    return resting;
  };
  const std::int64_t resting = tbb::parallel_reduce(tbb::blocked_range<std::int64_t>(0, size.y * size.z),
                                                    std::int64_t{0}, fill_rows, std::plus<std::int64_t>());
  scene.at_rest = static_cast<double>(resting) / static_cast<double>(voxel_count(field.lattice));
  if (of.cell_size == 1 && scene.at_rest < 1) scene.resting = find_resting(field);
  return scene;
}

/// Tetwarp on one volume.
class Own {
 public:
  Own(const Volume<std::int16_t>& volume, int threads)
      : volume_(volume),
        threads_(threads),
        background_(*std::min_element(volume.voxels.begin(), volume.voxels.end())),
        resampler_(make_cpu_resampler(volume.geometry, {.threads = threads})),
        output_{volume.geometry, std::vector<std::int16_t>(volume.voxels.size())} {}

  /// A new field, with one volume.
  void run(const Scene& scene, Samples& samples) {
    const ThreadLimit limit(threads_);
    const Stopwatch watch;
    resampler_->set_field(view(scene.field), FieldOptions{.jacobian_range = true});
    const double set_ms = watch.ms();
    report_ = resample(whole(volume_.geometry));
    const double all_ms = watch.ms();
    samples["set_field_ms"].push_back(set_ms);
    samples["resample_ms"].push_back(all_ms - set_ms);
    samples["new_field_ms"].push_back(all_ms);
    if (scene.resting.empty()) return;
    double resting = 0;
    for (const Region& slices : scene.resting) resting += run_resting(scene.field, slices);
    samples["resting"].push_back(resting);
  }
  /// Two volumes at once through the field that was set. @return ms
  double run_two() {
    const ThreadLimit limit(threads_);
    if (second_.voxels.empty()) second_ = second_output_ = volume_;
    const Target targets[] = {target_of(volume_, output_), target_of(second_, second_output_)};
    const Stopwatch watch;
    resampler_->resample(whole(volume_.geometry), targets);
    return watch.ms();
  }
  /// Of all slices.
  double resting_share(const Scene& scene) const {
    std::int64_t slices = 0;
    for (const Region& region : scene.resting) slices += region.end.z - region.begin.z;
    return static_cast<double>(slices) / static_cast<double>(volume_.geometry.size.z);
  }

  /// Of the last field that was run: `coverage`, and the inverse with 0 where nothing maps.
  Exact exact() {
    Volume<std::uint8_t> coverage{volume_.geometry, std::vector<std::uint8_t>(volume_.voxels.size())};
    resample(whole(volume_.geometry), {.coverage = view(coverage)});
    return {output_.voxels, std::move(coverage.voxels)};
  }
  PullField inverse() {
    PullField inverse{volume_.geometry, std::vector<glm::vec3>(volume_.voxels.size())};
    resample(whole(volume_.geometry), {.inverse_mm = samples_of(inverse)});
    for (glm::vec3& by : inverse.displacement) {
      if (std::isnan(by.x)) by = glm::vec3(0);
    }
    return inverse;
  }

  std::int16_t background() const { return background_; }
  std::uint64_t covered() const { return report_.covered; }

 private:
  /// Resamples some slices of the field that was set, and sets them alone. @return ms
  double run_resting(const VertexField& field, const Region& slices) {
    Geometry grid = field.lattice;
    grid.size.z = slices.end.z - slices.begin.z;
    grid.origin.z += static_cast<double>(slices.begin.z) * grid.spacing.z;
    const auto alone = make_cpu_resampler(grid, {.threads = threads_});
    const glm::vec3* vertices = field.displacement.data() + slices.begin.z * grid.size.x * grid.size.y;
    const Stopwatch watch;
    resample(slices);
    alone->set_field(FieldView{&grid, vertices}, FieldOptions{.jacobian_range = true});
    return watch.ms();
  }

  Target target_of(const Volume<std::int16_t>& source, Volume<std::int16_t>& output) const {
    return {.source = view(source), .output = view(output), .background = static_cast<double>(background_)};
  }

  Report resample(const Region& region, const Maps& maps = {}) {
    const Target target = target_of(volume_, output_);
    return resampler_->resample(region, {&target, 1}, maps);
  }

  const Volume<std::int16_t>& volume_;
  const int threads_;
  const std::int16_t background_;
  std::unique_ptr<ForwardResampler> resampler_;
  Volume<std::int16_t> output_, second_, second_output_;
  Report report_;
};

/// The output of a loop of our own that fills one.
template <class Fill>
Peer filling(const PeerInput& input, Fill fill) {
  return [=, output = std::make_shared<std::vector<std::int16_t>>(input.volume.voxels.size())] {
    const ThreadLimit limit(input.threads);
    fill(*output);
    return std::span<const std::int16_t>(*output);
  };
}

/// A peer beside Tetwarp.
struct Entrant {
  const char* name;
  Peer peer;  ///< empty where it is not asked for or not in this build
  bool warms_up = false, is_slow = false;
  std::span<const std::int16_t> output = {};

  Contender contender() {
    if (!peer) return {name, [](Samples&) {}};
    const auto run = [this](Samples& samples) {
      const Stopwatch watch;
      output = peer();
      samples["ms"].push_back(watch.ms());
    };
    return {name, run, warms_up, is_slow ? 1 : std::numeric_limits<int>::max()};
  }
};

/// Bytes first, which have no output to compare.
std::vector<Entrant> make_entrants(const Beside& beside, const PeerInput& input, const PullField& inverse,
                                   const VertexField& field, std::int64_t cell_size) {
  std::vector<Entrant> all{{"bytes_ms", {}, true},
                           {"paper", {}},
                           {"itk_warp", {}, true},
                           {"itk_invert_and_warp", {}, false, true},
                           {"vtk_probe", {}, false, true}};
  if (beside.bytes)
    all[0].peer = filling(input, [&source = input.volume, &field](std::vector<std::int16_t>& output) {
      [[maybe_unused]] const volatile std::uint32_t seen = move_bytes(source, field, output);
    });
  if (beside.paper)
    all[1].peer = filling(input, [=, &field](std::vector<std::int16_t>& output) {
      std::fill(output.begin(), output.end(), input.background);
      run_paper_loop(input.volume, field, cell_size, output.data());
    });
  if (!inverse.displacement.empty()) all[2].peer = make_itk_warp(input, inverse);
  if (beside.itk_invert_and_warp) all[3].peer = make_itk_invert_and_warp(input, field);
  if (beside.vtk_probe) all[4].peer = make_vtk_probe(input, field);
  return all;
}

}  // namespace

Json measure_run(const Volume<std::int16_t>& volume, const FieldOnLattice& field, const Beside& beside, int threads,
                 int repeats) {
  const Scene scene = make_scene(field, volume.geometry);
  Own own(volume, threads);
  Samples untimed;
  own.run(scene, untimed);
  const PullField inverse = beside.itk_warp && itk_version() ? own.inverse() : PullField{};
  std::vector<Entrant> entrants =
      make_entrants(beside, {volume, own.background(), threads}, inverse, scene.field, field.cell_size);
  std::vector<Contender> contenders{{"own", [&](Samples& samples) { own.run(scene, samples); }, false}};
  if (beside.second_volume)
    contenders.push_back({"two", [&](Samples& samples) { samples["two_volumes_ms"].push_back(own.run_two()); }});
  const std::size_t first = contenders.size();
  for (Entrant& one : entrants) contenders.push_back(one.contender());
  const std::vector<Samples> times = take_turns(contenders, 1, repeats);

  Json run{{"size", size_json(volume.geometry.size)},
           {"field", field.name},
           {"cell_size", field.cell_size},
           {"at_rest", scene.at_rest},
           {"covered", own.covered()}};
  for (const char* name : {"set_field_ms", "resample_ms", "new_field_ms"}) run[name] = summary_of(times[0], name);
  run["new_field_ns_a_voxel"] = *number(run, "/new_field_ms") * 1e6 / static_cast<double>(voxel_count(volume.geometry));
  run["resting"] = nullptr;
  if (!scene.resting.empty())
    run["resting"] = {{"share", own.resting_share(scene)}, {"new_field_ms", summary_of(times[0], "resting")}};
  run["two_volumes_ms"] = beside.second_volume ? summary_of(times[1], "two_volumes_ms") : Json(nullptr);
  run["bytes_ms"] = summary_of(times[first], "ms");
  std::optional<Exact> exact;
  for (std::size_t n = 1; n < entrants.size(); ++n) {
    const Entrant& one = entrants[n];
    if (one.peer && !exact) exact = own.exact();
    run[one.name] = nullptr;
    if (one.peer)
      run[one.name] = {{"ms", summary_of(times[first + n], "ms")},
                       {"differing", differing_fraction(*exact, one.output)}};
  }
  return run;
}

Json measure_scaling(const Volume<std::int16_t>& volume, const std::string& field, int threads, int repeats) {
  const Scene scene = make_scene({field}, volume.geometry);
  Own one(volume, 1), all(volume, threads);
  const std::vector<Samples> times = take_turns({{"one thread", [&](Samples& samples) { one.run(scene, samples); }},
                                                 {"all threads", [&](Samples& samples) { all.run(scene, samples); }}},
                                                1, repeats);
  Json scaling{{"field", field}, {"threads", threads}};
  for (std::size_t n = 0; n < 2; ++n)
    for (const char* name : {"set_field_ms", "resample_ms", "new_field_ms"})
      scaling[n == 0 ? "one" : "all"][name] = summary_of(times[n], name);
  scaling["efficiency"] = *number(scaling, "/one/new_field_ms") / (threads * *number(scaling, "/all/new_field_ms"));
  return scaling;
}

std::uint32_t move_bytes(const Volume<std::int16_t>& source, const VertexField& field,
                         std::vector<std::int16_t>& output) {
  constexpr std::size_t kBlock = std::size_t{1} << 14;
  const std::size_t voxels = source.voxels.size(), numbers = 3 * field.displacement.size();
  const float* vertices = &field.displacement.data()->x;
  require(output.size() == voxels, "an output of another size than the source cannot take its bytes");
  const std::size_t blocks = (voxels + kBlock - 1) / kBlock;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, blocks), std::uint32_t{0},
      [&](const tbb::blocked_range<std::size_t>& range, std::uint32_t seen) {
        for (std::size_t block = range.begin(); block != range.end(); ++block) {
          const std::size_t first = block * kBlock, last = std::min(first + kBlock, voxels);
          std::copy(source.voxels.begin() + static_cast<std::ptrdiff_t>(first),
                    source.voxels.begin() + static_cast<std::ptrdiff_t>(last),
                    output.begin() + static_cast<std::ptrdiff_t>(first));
          for (std::size_t n = numbers * block / blocks; n != numbers * (block + 1) / blocks; ++n) {
            seen |= std::bit_cast<std::uint32_t>(vertices[n]);
          }
        }
        return seen;
      },
      std::bit_or<std::uint32_t>());
}

}  // namespace tetwarp::bench
