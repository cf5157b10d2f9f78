// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu_methods.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>

#include "bench/gpu/gpu_fields.h"
#include "bench/paper/paper_cpu.h"
#include "bench/peers/peers.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

namespace {

using Clock = std::chrono::steady_clock;

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

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

/// Milliseconds of each repeat.
struct OwnSamples {
  std::vector<double> set_field, resample, new_field;
  std::vector<double> resting;  ///< RestingSlices, where there are such

  OwnTimes summary() const { return {summarize(set_field), summarize(resample), summarize(new_field)}; }
};

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
  void run(const Scene& scene, OwnSamples& samples) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads_));
    const auto start = Clock::now();
    resampler_->set_field(view(scene.field), FieldOptions{.jacobian_range = true});
    const auto set = Clock::now();
    report_ = resample(whole(volume_.geometry));
    const auto done = Clock::now();
    samples.set_field.push_back(ms_between(start, set));
    samples.resample.push_back(ms_between(set, done));
    samples.new_field.push_back(ms_between(start, done));
    if (scene.resting.empty()) return;
    double resting = 0;
    for (const Region& slices : scene.resting) resting += run_resting(scene.field, slices);
    samples.resting.push_back(resting);
  }
  /// Two volumes at once through the field that was set. @return ms
  double run_two() {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads_));
    if (second_.voxels.empty()) second_ = second_output_ = volume_;
    const Target targets[] = {target_of(volume_, output_), target_of(second_, second_output_)};
    const auto start = Clock::now();
    resampler_->resample(whole(volume_.geometry), targets);
    return ms_between(start, Clock::now());
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
    const auto start = Clock::now();
    resample(slices);
    alone->set_field(FieldView{&grid, vertices}, FieldOptions{.jacobian_range = true});
    return ms_between(start, Clock::now());
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

class PaperLoop final : public Peer {
 public:
  PaperLoop(const PeerInput& input, const VertexField& field, std::int64_t cell_size)
      : input_(input), field_(field), cell_size_(cell_size), output_(input.volume.voxels.size()) {}

  void run() override {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(input_.threads));
    std::fill(output_.begin(), output_.end(), input_.background);
    run_paper_loop(input_.volume, field_, cell_size_, output_.data());
  }
  std::span<const std::int16_t> output() const override { return output_; }

 private:
  const PeerInput input_;
  const VertexField& field_;
  const std::int64_t cell_size_;
  std::vector<std::int16_t> output_;
};

class BytesMoved final : public Peer {
 public:
  BytesMoved(const PeerInput& input, const VertexField& field)
      : input_(input), field_(field), output_(input.volume.voxels.size()) {}

  void run() override {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(input_.threads));
    seen_ = move_bytes(input_.volume, field_, output_);
  }
  std::span<const std::int16_t> output() const override { return output_; }

 private:
  const PeerInput input_;
  const VertexField& field_;
  std::vector<std::int16_t> output_;
  volatile std::uint32_t seen_ = 0;
};

/// A peer with its times.
struct Entrant {
  std::unique_ptr<Peer> peer;  ///< null: not asked for, or not in this build
  int repeats;
  bool runs_before;  ///< once, untimed
  std::vector<double> ms = {};

  void run(int repeat) {
    if (!peer || repeat >= repeats || (repeat < 0 && !runs_before)) return;
    const auto start = Clock::now();
    peer->run();
    if (repeat >= 0) ms.push_back(ms_between(start, Clock::now()));
  }
  std::optional<PeerTimes> times(const Exact& exact) const {
    if (!peer) return {};
    return PeerTimes{summarize(ms), differing_fraction(exact, peer->output())};
  }
};

/// Everything that runs on one field, each made when it is asked for.
struct Entrants {
  Entrant bytes, paper, itk_warp, itk_invert_and_warp, vtk_probe;

  void run(int repeat) {
    for (Entrant* entrant : {&bytes, &paper, &itk_warp, &itk_invert_and_warp, &vtk_probe}) entrant->run(repeat);
  }
  bool any_peer() const { return paper.peer || itk_warp.peer || itk_invert_and_warp.peer || vtk_probe.peer; }
};

Entrants make_entrants(const Beside& beside, const PeerInput& input, const VertexField& field, std::int64_t cell_size,
                       const PullField& inverse, int repeats) {
  constexpr int kSlow = 1;
  return {
      .bytes = {beside.bytes ? std::make_unique<BytesMoved>(input, field) : nullptr, repeats, true},
      .paper = {beside.paper ? std::make_unique<PaperLoop>(input, field, cell_size) : nullptr, repeats, false},
      .itk_warp = {beside.itk_warp ? make_itk_warp(input, inverse) : nullptr, repeats, true},
      .itk_invert_and_warp = {beside.itk_invert_and_warp ? make_itk_invert_and_warp(input, field) : nullptr, kSlow,
                              false},
      .vtk_probe = {beside.vtk_probe ? make_vtk_probe(input, field) : nullptr, kSlow, false},
  };
}

}  // namespace

CpuRun measure_run(const Volume<std::int16_t>& volume, const FieldOnLattice& field, const Beside& beside, int threads,
                   int repeats) {
  const Scene scene = make_scene(field, volume.geometry);
  Own own(volume, threads);
  OwnSamples samples, untimed;
  own.run(scene, untimed);
  const PullField inverse = beside.itk_warp && itk_version() ? own.inverse() : PullField{};
  Entrants others =
      make_entrants(beside, {volume, own.background(), threads}, scene.field, field.cell_size, inverse, repeats);
  others.run(-1);
  if (beside.second_volume) own.run_two();
  std::vector<double> two;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    own.run(scene, samples);
    if (beside.second_volume) two.push_back(own.run_two());
    others.run(repeat);
  }
  CpuRun run{.size = volume.geometry.size,
             .field = field.name,
             .cell_size = field.cell_size,
             .at_rest = scene.at_rest,
             .covered = own.covered(),
             .ours = samples.summary()};
  if (!scene.resting.empty()) run.resting = {own.resting_share(scene), summarize(samples.resting)};
  if (beside.second_volume) run.two_ms = summarize(two);
  if (others.bytes.peer) run.bytes_ms = summarize(others.bytes.ms);
  if (!others.any_peer()) return run;
  const Exact exact = own.exact();
  run.paper = others.paper.times(exact);
  run.itk_warp = others.itk_warp.times(exact);
  run.itk_invert_and_warp = others.itk_invert_and_warp.times(exact);
  run.vtk_probe = others.vtk_probe.times(exact);
  return run;
}

Scaling measure_scaling(const Volume<std::int16_t>& volume, const std::string& field, int threads, int repeats) {
  const Scene scene = make_scene({field}, volume.geometry);
  Own one(volume, 1), all(volume, threads);
  OwnSamples of_one, of_all, untimed;
  one.run(scene, untimed);
  all.run(scene, untimed);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    one.run(scene, of_one);
    all.run(scene, of_all);
  }
  return {field, threads, of_one.summary(), of_all.summary()};
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
