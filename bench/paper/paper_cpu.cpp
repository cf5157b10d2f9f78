// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "bench/paper/backend.h"
#include "bench/paper/baselines.h"

namespace tetwarp::bench {

namespace {

/// What a texture unit does, in float: linear along x, y, z; clamped to the outermost voxel centres.
struct SoftwareTexture {
  const std::int16_t* voxels;
  Grid grid;

  float at(int x, int y, int z) const { return static_cast<float>(voxels[grid.offset(x, y, z)]); }
  float operator()(float x, float y, float z) const {
    const Place px(x, grid.nx), py(y, grid.ny), pz(z, grid.nz);
    const auto row = [&](int j, int k) { return mix(at(px.low, j, k), at(px.high, j, k), px.t); };
    const auto slice = [&](int k) { return mix(row(py.low, k), row(py.high, k), py.t); };
    return mix(slice(pz.low), slice(pz.high), pz.t);
  }

 private:
  struct Place {
    int low, high;
    float t;

    Place(float x, int size) {
      const float clamped = std::fmin(std::fmax(x, 0.0f), static_cast<float>(size - 1));
      low = static_cast<int>(clamped);
      high = low + 1 < size ? low + 1 : low;
      t = clamped - static_cast<float>(low);
    }
  };
  static float mix(float a, float b, float t) { return a + t * (b - a); }
};

/// setValue of the paper. A voxel may be written by several threads; the last one wins.
struct SetValue {
  std::int16_t* output;
  std::uint32_t* writes;  ///< null where time is taken
  Grid grid;

  template <class Real>
  void operator()(int x, int y, int z, Real value) const {
    const std::int64_t n = grid.offset(x, y, z);
    std::atomic_ref(output[n]).store(to_short(value), std::memory_order_relaxed);
    if (writes) std::atomic_ref(writes[n]).fetch_add(1, std::memory_order_relaxed);
  }
};

/// Calls `f(i, j, k)` for every cell, rows of cells in parallel.
template <class F>
void for_each_cell(const Grid& grid, const F& f) {
  const int cells_x = grid.vertices_x - 1, cells_y = grid.vertices_y - 1, cells_z = grid.vertices_z - 1;
  tbb::parallel_for(tbb::blocked_range<int>(0, cells_y * cells_z), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row) {
      for (int i = 0; i < cells_x; ++i) f(i, row % cells_y, row / cells_y);
    }
  });
}

template <class Field>
void run_gascon(const Grid& grid, const Field& field, const SoftwareTexture& texture, const SetValue& write) {
  for_each_cell(grid, [&](int i, int j, int k) {
    for (int t = 0; t < kTetrahedraPerCell; ++t) {
      CellVertex corners[4];
      for (int n = 0; n < 4; ++n) corners[n] = make_tetrahedron_vertex(grid, field, i, j, k, t, n);
      walk_tetrahedron<InverseIn::loop_as_compiled>(grid, corners, 0, 1, texture, write);
    }
  });
}

template <class Field>
void run_method(Method method, const Grid& grid, const Field& field, const SoftwareTexture& texture,
                const SetValue& write) {
  if (method == Method::gascon) return run_gascon(grid, field, texture, write);
  with_cell_method(method, [&]<class M, InverseIn kWhen>() {
    for_each_cell(grid, [&](int i, int j, int k) { deform_cell<M, kWhen>(grid, i, j, k, field, texture, write); });
  });
}

class CpuBackend final : public Backend {
 public:
  explicit CpuBackend(int threads) : Backend(threads) {}

  Samples time(Method method, FieldSource source, const FrameCount& frames) override {
    const auto run = [&](Samples& times) {
      if (method == Method::tetwarp)
        run_tetwarp(source, times);
      else
        run_baseline(method, source, times);
    };
    return take_turns({{name_of(method), run}}, frames.warmup, frames.timed).front();
  }

  const std::vector<std::int16_t>& output() override { return output_.voxels; }

 private:
  std::unique_ptr<ForwardResampler> make_resampler(const Geometry& geometry) const override {
    return make_cpu_resampler(geometry, Limits{.threads = threads_});
  }

  void volume_changed() override { output_ = {volume_->geometry, std::vector<std::int16_t>(volume_->voxels.size())}; }

  void fill_field() override {
    const Grid grid = make_grid(volume_->geometry, field_.lattice, cell_size_);
    const FormulaField formula{formula_};
    tbb::parallel_for(0, grid.vertices_y * grid.vertices_z, [&](int row) {
      const int j = row % grid.vertices_y, k = row / grid.vertices_y;
      for (int i = 0; i < grid.vertices_x; ++i) {
        field_.displacement[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.vertices_x) +
                            static_cast<std::size_t>(i)] = formula(i, j, k, grid.rest(i, j, k));
      }
    });
  }

  void run(Method method, FieldSource source, std::int16_t* output, std::uint32_t* writes) const {
    const Grid grid = make_grid(volume_->geometry, field_.lattice, cell_size_);
    const SetValue write{output, writes, grid};
    if (source == FieldSource::kernel) {
      run_on(FormulaField{formula_}, method, grid, write);
    } else {
      run_on(MemoryField{field_.displacement.data(), grid.vertices_x, grid.vertices_y}, method, grid, write);
    }
  }
  template <class Field>
  void run_on(const Field& field, Method method, const Grid& grid, const SetValue& write) const {
    const SoftwareTexture texture{volume_->voxels.data(), grid};
    run_method(method, grid, field, texture, write);
  }

  void run_baseline(Method method, FieldSource source, Samples& times) {
    const Stopwatch whole_frame;
    std::fill(output_.voxels.begin(), output_.voxels.end(), background_);
    const Stopwatch watch;
    run(method, source, output_.voxels.data(), nullptr);
    times["kernel_ms"].push_back(watch.ms());
    times["end_to_end_ms"].push_back(whole_frame.ms());
  }

  void run_tetwarp(FieldSource source, Samples& times) {
    const Stopwatch watch;
    if (source == FieldSource::kernel) fill_field();
    resampler_->set_field(view(field_));
    const double field_ms = watch.ms();
    const Target target{
        .source = view(*volume_), .output = view(output_), .background = static_cast<double>(background_)};
    resampler_->resample(whole(volume_->geometry), {&target, 1});
    const double total_ms = watch.ms();
    times["field_ms"].push_back(field_ms);
    times["kernel_ms"].push_back(total_ms - field_ms);
    times["total_ms"].push_back(total_ms);
    times["end_to_end_ms"].push_back(total_ms);
  }

  std::vector<std::uint32_t> count_baseline_writes(Method method, FieldSource source) override {
    std::vector<std::int16_t> scratch(volume_->voxels.size());  // the timed frame's output stays
    std::vector<std::uint32_t> writes(volume_->voxels.size());
    run(method, source, scratch.data(), writes.data());
    return writes;
  }

  Volume<std::int16_t> output_;
};

}  // namespace

void run_paper_loop(const Volume<std::int16_t>& volume, const VertexField& field, std::int64_t cell_size,
                    std::int16_t* output) {
  const Grid grid = make_grid(volume.geometry, field.lattice, cell_size);
  run_method(Method::paper, grid, MemoryField{field.displacement.data(), grid.vertices_x, grid.vertices_y},
             SoftwareTexture{volume.voxels.data(), grid}, SetValue{output, nullptr, grid});
}

std::unique_ptr<Backend> make_cpu_backend(int threads) { return std::make_unique<CpuBackend>(threads); }

}  // namespace tetwarp::bench
