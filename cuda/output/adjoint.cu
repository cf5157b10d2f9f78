// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/adjoint.h"

#include <algorithm>
#include <variant>
#include <vector>

#include "cuda/factories.h"
#include "cuda/output/adjoint_maps.cuh"
#include "cuda/runtime/device_buffer.h"
#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/pointer_check.h"
#include "cuda/runtime/warp.cuh"
#include "deform/field_check.h"
#include "deform/snapped_mesh.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

constexpr int kWarps = 4;    ///< of a block: rows
constexpr int kColumn = 16;  ///< voxels along k that a thread goes

/// What a pass finds out of all voxels.
struct Found {
  unsigned long long
      largest;          ///< bits of the largest term, in size; those of a double that is not negative rise with it
  unsigned not_finite;  ///< whether a term is not finite

  /// @param voxels  of the output
  __device__ Quantum quantum(double voxels) const {
    return {voxels, __longlong_as_double(static_cast<long long>(largest))};
  }
};

/// What is known of every voxel of the output.
struct OwnedVoxels {
  const std::uint32_t* tetrahedron;  ///< as `Maps::tetrahedra`
  const std::uint8_t* mapped;        ///< whether it comes from somewhere, perhaps staying; null: if it is owned
  glm::ivec3 size;
  Nudge nudge;

  __device__ bool is_mapped(std::int64_t n) const { return mapped ? mapped[n] != 0 : tetrahedron[n] != kNoTetrahedron; }
  __device__ std::int64_t count() const { return std::int64_t{size.x} * size.y * size.z; }
};

/// Goes along a column of voxels: a thread a column, lanes side by side along i. Calls `hold(number)` where the owner
/// changes, `visit(n, voxel, signs, number)` for each voxel that is owned, and `stay(n, voxel)` for each that stays.
template <class Hold, class Visit, class Stay>
__device__ void for_each_of_column(const OwnedVoxels& owned, Hold&& hold, Visit&& visit, Stay&& stay) {
  const int x = static_cast<int>(blockIdx.x * 32 + (threadIdx.x & 31)),
            y = static_cast<int>(blockIdx.y * kWarps + threadIdx.x / 32),
            begin = static_cast<int>(blockIdx.z) * kColumn;
  if (x >= owned.size.x || y >= owned.size.y) return;
  std::uint32_t held = kNoTetrahedron;
  for (int z = begin; z < min(begin + kColumn, owned.size.z); ++z) {
    const std::int64_t n = (std::int64_t{z} * owned.size.y + y) * owned.size.x + x;
    const std::uint32_t owner = owned.tetrahedron[n];
    const glm::i64vec3 voxel(x, y, z);
    if (owner == kNoTetrahedron) {
      if (owned.is_mapped(n)) stay(n, voxel);
      continue;
    }
    if (owner != held) hold(owner);
    held = owner;
    visit(n, voxel, owned.nudge.signs(voxel), owner);
  }
}

/// Raises `found.largest` to the largest term of a warp; for whole warps.
__device__ void raise(Found* found, double largest, bool not_finite) {
  const unsigned long long most = warp_max(static_cast<unsigned long long>(__double_as_longlong(largest)));
  if (lane_of_warp() == 0 && most > found->largest) atomicMax(&found->largest, most);
  if (not_finite) found->not_finite = 1;
}

/// Makes a table. A thread a tetrahedron.
template <class Tetrahedra>
__global__ void table_kernel(const __grid_constant__ MapTable<Tetrahedra> table, std::int64_t count) {
  const std::int64_t n = thread_of_grid();
  if (n < count) table.make(static_cast<std::uint32_t>(n));
}

/// The gradient with respect to each owner as a whole, and its largest component. Grid: a column a thread, as
/// `for_each_of_column`.
///
/// @param of_owners  a vector a voxel: written where a voxel has an owner
template <class V, class Maps>
__global__ void of_owners_kernel(const __grid_constant__ OwnedVoxels owned, const __grid_constant__ Maps maps,
                                 AdjointPlans<V> plans, glm::vec3* of_owners, Found* found) {
  typename Maps::Place map;
  float largest = 0;
  bool not_finite = false;
  for_each_of_column(
      owned, [&](std::uint32_t number) { map = maps.place(number); },
      [&](std::int64_t n, const glm::i64vec3& voxel, const glm::i32vec3& signs, std::uint32_t number) {
        const auto offset = maps.offset(map, number, voxel, signs);
        const glm::vec3 h = maps.pull_back(map, number, plans.of_place(n, voxel, offset));
        of_owners[n] = h;
        for (int axis = 0; axis < 3; ++axis) {
          const float size = std::fabs(h[axis]);
          not_finite = not_finite || size - size != 0;
          largest = size - size == 0 && size > largest ? size : largest;
        }
      },
      [](std::int64_t, const glm::i64vec3&) {});
  raise(found, largest, not_finite);
}

/// Adds up what the vertices get, in quanta. Grid: a column a thread, as `for_each_of_column`.
///
/// @param of_owners  from `of_owners_kernel`  @param sums  three a vertex
template <class Maps>
__global__ void add_to_vertices_kernel(const __grid_constant__ OwnedVoxels owned, const __grid_constant__ Maps maps,
                                       const glm::vec3* of_owners, const Found* found, unsigned long long* sums) {
  const Quantum quantum = found->quantum(static_cast<double>(owned.count()));
  WeightMap map;
  std::uint32_t vertex[4] = {};
  std::int64_t part[4][3] = {};
  const auto flush = [&] {
    for (int corner = 0; corner < 4; ++corner) {
      for (int axis = 0; axis < 3; ++axis) {
        if (part[corner][axis] != 0)
          atomicAdd(&sums[3 * std::size_t{vertex[corner]} + static_cast<std::size_t>(axis)],
                    static_cast<unsigned long long>(part[corner][axis]));
        part[corner][axis] = 0;
      }
    }
  };
  for_each_of_column(
      owned,
      [&](std::uint32_t number) {
        flush();
        map = maps.weight(number, vertex);
      },
      [&](std::int64_t n, const glm::i64vec3& voxel, const glm::i32vec3& signs, std::uint32_t number) {
        const glm::dvec3 h(of_owners[n]);
        float weight[4];
        map.weights(
            voxel, signs, [&] { return again(maps.tetrahedra, number); }, weight);
        for (int corner = 0; corner < 4; ++corner) {
          for (int axis = 0; axis < 3; ++axis) part[corner][axis] += quantum.steps(double{weight[corner]} * h[axis]);
        }
      },
      [](std::int64_t, const glm::i64vec3&) {});
  flush();
}

/// From sums to the gradient of the displacement, a thread a vertex.
__global__ void finish_vertices_kernel(const std::int64_t* sums, std::int64_t vertices, double voxels,
                                       const __grid_constant__ glm::dmat3 output_from_mm, const Found* found,
                                       glm::vec3* gradient) {
  const std::int64_t n = thread_of_grid();
  if (n >= vertices) return;
  const Quantum quantum = found->quantum(voxels);
  const std::int64_t* of = sums + 3 * n;
  gradient[n] = found->not_finite != 0
                    ? glm::vec3(__int_as_float(0x7fc00000))
                    : per_mm(output_from_mm, {quantum.value(of[0]), quantum.value(of[1]), quantum.value(of[2])});
}

/// The largest value that goes to a source; a thread a voxel.
template <class V>
__global__ void largest_given_kernel(const __grid_constant__ OwnedVoxels owned,
                                     const __grid_constant__ AdjointPlan<V> plan, Found* found) {
  const std::int64_t n = thread_of_grid();
  const double largest = n < owned.count() && owned.is_mapped(n) ? largest_given(plan, n) : 0;
  raise(found, largest, false);
}

/// Adds up what a source gets, in quanta. Grid: a column a thread, as `for_each_of_column`.
template <class V, class Maps>
__global__ void add_to_source_kernel(const __grid_constant__ OwnedVoxels owned, const __grid_constant__ Maps maps,
                                     const __grid_constant__ AdjointPlan<V> plan, Found* found) {
  const Quantum quantum = found->quantum(static_cast<double>(owned.count()));
  const auto add = [](std::int64_t& sum, std::int64_t steps) {
    atomicAdd(reinterpret_cast<unsigned long long*>(&sum), static_cast<unsigned long long>(steps));
  };
  typename Maps::Place map;
  bool finite = true;
  for_each_of_column(
      owned, [&](std::uint32_t number) { map = maps.place(number); },
      [&](std::int64_t n, const glm::i64vec3& voxel, const glm::i32vec3& signs, std::uint32_t number) {
        const auto offset = maps.offset(map, number, voxel, signs);
        finite = add_to_source(plan, n, voxel, offset, quantum, add) && finite;
      },
      [&](std::int64_t n, const glm::i64vec3& voxel) {
        finite = add_to_source(plan, n, voxel, typename Maps::Offset{}, quantum, add) && finite;
      });
  if (!finite) found->not_finite = 1;
}

/// From sums to the gradient of a source, a thread a value.
template <class V>
__global__ void finish_source_kernel(const std::int64_t* sums, std::int64_t count, double voxels, const Found* found,
                                     V* gradient) {
  const std::int64_t n = thread_of_grid();
  if (n >= count) return;
  const Quantum quantum = found->quantum(voxels);
  gradient[n] =
      found->not_finite != 0 ? static_cast<V>(__int_as_float(0x7fc00000)) : static_cast<V>(quantum.value(sums[n]));
}

class Adjoint final : public ResampleAdjoint {
 public:
  Adjoint(const Geometry& output, int device, const Limits& limits)
      : ResampleAdjoint(output),
        device_(device),
        memory_(limits.memory),
        resampler_(make_cuda_resampler(output, device, limits)) {
    require(output.size.x < INT32_MAX / 32 && (output.size.y + kWarps - 1) / kWarps < 65536 &&
                (output.size.z + kColumn - 1) / kColumn < 65536,
            "the output is too large for gradients on a device");
  }

  void set_field(const FieldView& field, const Control& control) override {
    ready_ = false;
    resampler_->set_field(field, {.jacobian_range = false}, {.stop = control.stop, .stream = control.stream});
    const DeviceScope scope(device_);
    const auto stream = static_cast<cudaStream_t>(control.stream);
    const auto voxels = static_cast<std::size_t>(voxel_count(output()));
    Maps maps{.tetrahedra = map_view(owner_.reserve(voxels), VoxelType::u32)};
    const bool rests = field.outside == Outside::rest;
    if (rests) maps.coverage = map_view(mapped_.reserve(voxels), VoxelType::u8);
    resampler_->resample(whole(output()), {}, maps, control);
    owned_ = {owner_.data(), rests ? mapped_.data() : nullptr, glm::ivec3(output().size), {}};
    vertices_ = static_cast<std::size_t>(vertex_count(field));
    if (field.mesh) {
      const SnappedMesh mesh = snap_mesh(output(), field, control);
      const std::vector<glm::u32vec4>& of_mesh = field.mesh->tetrahedra;
      vertex_.upload(mesh.vertices.data(), mesh.vertices.size(), stream);
      tetrahedra_.upload(mesh.tetrahedra.data(), mesh.tetrahedra.size(), stream);
      of_mesh_.upload(of_mesh.data(), of_mesh.size(), stream);
      numbered_ = MeshTetrahedra{vertex_.data(), tetrahedra_.data(),
                                 static_cast<std::uint32_t>(mesh.tetrahedra.size() - of_mesh.size()), of_mesh_.data(),
                                 static_cast<std::uint32_t>(vertices_ - field.mesh->rest.size())};
      owned_.nudge = mesh.nudge;
      coarse_ = mesh.coarse;
      make_table(static_cast<std::int64_t>(mesh.tetrahedra.size()), stream);
    } else {
      const LatticeFrame frame = make_lattice_frame(output(), field);
      const glm::vec3* displacement = field.displacement;
      if (field.memory == Memory::host) {
        displacement_.upload(field.displacement, vertices_, stream);
        displacement = displacement_.data();
      }
      numbered_ = LatticeTetrahedra{frame, displacement};
      owned_.nudge = frame.nudge;
      coarse_ = frame.coarse;
      make_table(frame.cells.x * frame.cells.y * frame.cells.z * kTetrahedraPerCell, stream);
    }
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));  // the next call may be on another stream
    ready_ = true;
  }

  void apply(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement,
             const Control& control) override {
    require(ready_, "apply needs a field: call set_field first");
    check_adjoint(output(), targets, displacement, vertices_);
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    for (const AdjointTarget& target : targets) {
      require_memory(target.source.voxels, target.source.memory, "a source");
      require_memory(target.output_gradient.voxels, target.output_gradient.memory, "the gradient of an output");
      require_memory(target.source_gradient.voxels, target.source_gradient.memory, "the gradient of a source");
    }
    require_memory(displacement.values.data(), displacement.memory, "the gradient of the displacement");
    require_room(targets, displacement);
    if (control.stop.stop_requested()) throw Cancelled();
    if (targets.empty())
      clear(displacement);
    else if (targets.front().source.type == VoxelType::f32)
      apply_to<float>(targets, displacement);
    else
      apply_to<double>(targets, displacement);
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_));
  }

 private:
  template <class T>
  VolumeView map_view(T* values, VoxelType type) const {
    return {&output(), whole(output()), type, 1, reinterpret_cast<std::byte*>(values), Memory::device};
  }

  /// Refuses what the limit of memory has no room for. @throws InputError
  void require_room(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement) const {
    if (memory_ == 0) return;
    std::uint64_t bytes = 0;
    const auto add = [&bytes](const auto& view) {
      if (!view.voxels || view.memory == Memory::device) return;
      bytes += static_cast<std::uint64_t>(voxel_count(*view.geometry) * view.components) * size_bytes(view.type);
    };
    for (const AdjointTarget& target : targets) {
      if (!displacement.values.empty()) add(target.source);
      add(target.output_gradient);
      add(target.source_gradient);
    }
    if (displacement.memory == Memory::host) bytes += displacement.values.size_bytes();
    require(bytes <= memory_, "the gradients want " + std::to_string(bytes) +
                                  " bytes of device memory for copies, and the limit is " + std::to_string(memory_) +
                                  "; gradients are not streamed, so raise the limit or take the CPU");
  }

  void clear(const DisplacementGradient& gradient) const {
    if (gradient.memory == Memory::host)
      std::fill(gradient.values.begin(), gradient.values.end(), glm::vec3(0));
    else
      TETWARP_CUDA_TRY(cudaMemsetAsync(gradient.values.data(), 0, gradient.values.size_bytes(), stream_));
  }

  /// A device's copy of what lies on the host, in a buffer of its own; or what lies on the device.
  template <class V, class View>
  V* on_device(const View& view, std::vector<DeviceBuffer<std::byte>>& copies, std::size_t& next, bool reads) {
    if (!view.voxels || view.memory == Memory::device) return reinterpret_cast<V*>(const_cast<std::byte*>(view.voxels));
    const std::size_t bytes = static_cast<std::size_t>(voxel_count(*view.geometry) * view.components) * sizeof(V);
    DeviceBuffer<std::byte>& copy = copies[next++];
    if (reads)
      copy.upload(view.voxels, bytes, stream_);
    else
      copy.reserve(bytes);
    return reinterpret_cast<V*>(copy.data());
  }

  template <class V>
  void apply_to(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement) {
    std::vector<AdjointPlan<V>> plans;
    std::vector<V*> gradients;
    if (copies_.size() < 3 * targets.size()) copies_ = std::vector<DeviceBuffer<std::byte>>(3 * targets.size());
    std::vector<double> slices;
    std::vector<std::size_t> first_slice;
    std::size_t next = 0, values = 0;
    for (const AdjointTarget& target : targets) {
      const std::vector<double> of_target = uneven_slices(*target.source.geometry);
      first_slice.push_back(of_target.empty() ? SIZE_MAX : slices.size());
      slices.insert(slices.end(), of_target.begin(), of_target.end());
      if (target.source_gradient.voxels)
        values += static_cast<std::size_t>(voxel_count(*target.source.geometry) * target.source.components);
    }
    double* const slices_there = slices_.reserve(slices.size() + 1);
    if (!slices.empty()) slices_.upload(slices.data(), slices.size(), stream_);
    source_sums_.fill(0, values, stream_);
    values = 0;
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const AdjointTarget& target = targets[t];
      const Geometry& grid = *target.source.geometry;
      const glm::i64vec3& size = grid.size;
      const int components = target.source.components;
      const bool wanted = target.source_gradient.voxels != nullptr, moves = !displacement.values.empty();
      ConstVolumeView source = target.source;
      if (!moves) source.voxels = nullptr;
      plans.push_back({{on_device<const V>(source, copies_, next, true), size, glm::i64vec3(0),
                        glm::i64vec3(1, size.x, size.x * size.y) * std::int64_t{components}},
                       relate(grid, output(), first_slice[t] == SIZE_MAX ? nullptr : slices_there + first_slice[t]),
                       components,
                       target.interpolation,
                       on_device<const V>(target.output_gradient, copies_, next, true),
                       wanted ? source_sums_.data() + values : nullptr});
      gradients.push_back(on_device<V>(target.source_gradient, copies_, next, false));
      if (wanted) values += static_cast<std::size_t>(voxel_count(grid) * components);
    }
    std::byte* const there = plans_.reserve(plans.size() * sizeof(AdjointPlan<V>) + 1);
    TETWARP_CUDA_TRY(
        cudaMemcpyAsync(there, plans.data(), plans.size() * sizeof(AdjointPlan<V>), cudaMemcpyHostToDevice, stream_));
    found_.fill(0, 1 + plans.size(), stream_);
    const AdjointPlans<V> given{reinterpret_cast<const AdjointPlan<V>*>(there), static_cast<int>(plans.size())};
    const auto run = [&](const auto& maps) {
      if (!displacement.values.empty()) find_displacement(maps, given, displacement);
      for (std::size_t p = 0; p < plans.size(); ++p)
        if (plans[p].sums) find_source(maps, plans[p], found_.data() + 1 + p, gradients[p]);
    };
    std::visit(
        [&](const auto& tetrahedra) {
          using Tetrahedra = std::decay_t<decltype(tetrahedra)>;
          if (has_table_)
            run(MapTable<Tetrahedra>{tetrahedra, table_.data()});
          else if (coarse_)
            run(MadeMaps<true, Tetrahedra>{tetrahedra});
          else
            run(MadeMaps<false, Tetrahedra>{tetrahedra});
        },
        numbered_);
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const VolumeView& view = targets[t].source_gradient;
      if (!view.voxels || view.memory == Memory::device) continue;
      const std::size_t bytes = static_cast<std::size_t>(voxel_count(*view.geometry) * view.components) * sizeof(V);
      TETWARP_CUDA_TRY(cudaMemcpyAsync(view.voxels, gradients[t], bytes, cudaMemcpyDeviceToHost, stream_));
    }
  }

  /// Makes the maps of a coarse field, where they do not take too much memory.
  void make_table(std::int64_t count, cudaStream_t stream) {
    constexpr std::int64_t kMost = 12;  // bytes for each voxel of the output, as many as the gradients of a call take
    has_table_ = coarse_ && count * kTableQuads * std::int64_t{sizeof(int4)} <= kMost * voxel_count(output()) &&
                 table_.try_reserve(static_cast<std::size_t>(count * kTableQuads));
    if (!has_table_) return table_.release();
    int4* const records = table_.data();
    std::visit(
        [&](const auto& tetrahedra) {
          using Tetrahedra = std::decay_t<decltype(tetrahedra)>;
          table_kernel<<<blocks_for(count), kThreads, 0, stream>>>(MapTable<Tetrahedra>{tetrahedra, records}, count);
        },
        numbered_);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  dim3 columns() const {
    const glm::ivec3& size = owned_.size;
    return {static_cast<unsigned>((size.x + 31) / 32), static_cast<unsigned>((size.y + kWarps - 1) / kWarps),
            static_cast<unsigned>((size.z + kColumn - 1) / kColumn)};
  }
  double voxels() const { return static_cast<double>(voxel_count(output())); }

  template <class V, class Maps>
  void find_displacement(const Maps& maps, const AdjointPlans<V>& plans, const DisplacementGradient& displacement) {
    Found* const found = found_.data();
    vertex_sums_.fill(0, 3 * vertices_, stream_);
    glm::vec3* const of_owners = of_owners_.reserve(static_cast<std::size_t>(voxel_count(output())));
    of_owners_kernel<<<columns(), 32 * kWarps, 0, stream_>>>(owned_, maps, plans, of_owners, found);
    add_to_vertices_kernel<<<columns(), 32 * kWarps, 0, stream_>>>(
        owned_, maps, of_owners, found, reinterpret_cast<unsigned long long*>(vertex_sums_.data()));
    glm::vec3* const to =
        displacement.memory == Memory::device ? displacement.values.data() : vertex_gradient_.reserve(vertices_);
    finish_vertices_kernel<<<blocks_for(static_cast<std::int64_t>(vertices_)), kThreads, 0, stream_>>>(
        vertex_sums_.data(), static_cast<std::int64_t>(vertices_), voxels(), index_from_point(output()).linear, found,
        to);
    TETWARP_CUDA_TRY(cudaGetLastError());
    if (displacement.memory == Memory::host) vertex_gradient_.download(displacement.values.data(), vertices_, stream_);
  }

  template <class V, class Maps>
  void find_source(const Maps& maps, const AdjointPlan<V>& plan, Found* found, V* gradient) {
    largest_given_kernel<<<blocks_for(voxel_count(output())), kThreads, 0, stream_>>>(owned_, plan, found);
    add_to_source_kernel<<<columns(), 32 * kWarps, 0, stream_>>>(owned_, maps, plan, found);
    const std::int64_t count = plan.source.size.x * plan.source.size.y * plan.source.size.z * plan.components;
    finish_source_kernel<<<blocks_for(count), kThreads, 0, stream_>>>(plan.sums, count, voxels(), found, gradient);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  int device_;
  std::uint64_t memory_;  ///< `Limits::memory`
  std::unique_ptr<ForwardResampler> resampler_;
  cudaStream_t stream_ = nullptr;  ///< of the call
  bool ready_ = false, coarse_ = false, has_table_ = false;
  std::size_t vertices_ = 0;
  OwnedVoxels owned_{};
  std::variant<LatticeTetrahedra, MeshTetrahedra> numbered_;
  DeviceBuffer<std::uint32_t> owner_;
  DeviceBuffer<std::uint8_t> mapped_;
  DeviceBuffer<glm::vec3> displacement_;  ///< of a lattice on the host
  DeviceBuffer<Vertex> vertex_;           ///< of a mesh
  DeviceBuffer<glm::u32vec4> tetrahedra_, of_mesh_;
  DeviceBuffer<int4> table_;  ///< `MapTable`, where there is one
  DeviceBuffer<std::byte> plans_;
  DeviceBuffer<double> slices_;
  std::vector<DeviceBuffer<std::byte>> copies_;  ///< of what lies on the host
  DeviceBuffer<std::int64_t> source_sums_, vertex_sums_;
  DeviceBuffer<glm::vec3> of_owners_;  ///< of a call: a vector a voxel
  DeviceBuffer<glm::vec3> vertex_gradient_;
  DeviceBuffer<Found> found_;  ///< of the gradient of the displacement, and of that of each target's source
};

}  // namespace

}  // namespace cuda_detail

std::unique_ptr<ResampleAdjoint> make_cuda_adjoint(const Geometry& output, int device, const Limits& limits) {
  return std::make_unique<cuda_detail::Adjoint>(output, device, limits);
}

}  // namespace tetwarp
